// Texels of pages, by a page's number. Devices need a constant index into an array of images.
#ifndef VDI_PAGES_GLSL
#define VDI_PAGES_GLSL
#include "shared/cast.h"

layout(constant_id = 0) const uint pageCount = 1;
layout(set = 0, binding = 0) uniform sampler3D pages[castMaxPages];

float texelAt(uint page, ivec3 at) {
  float value = 0.0;
  if (pageCount == 1u || page == 0u) value = texelFetch(pages[0], at, 0).r;
  if (pageCount > 1u && page == 1u) value = texelFetch(pages[1], at, 0).r;
  if (pageCount > 2u && page == 2u) value = texelFetch(pages[2], at, 0).r;
  if (pageCount > 3u && page == 3u) value = texelFetch(pages[3], at, 0).r;
  if (pageCount > 4u && page == 4u) value = texelFetch(pages[4], at, 0).r;
  if (pageCount > 5u && page == 5u) value = texelFetch(pages[5], at, 0).r;
  if (pageCount > 6u && page == 6u) value = texelFetch(pages[6], at, 0).r;
  if (pageCount > 7u && page == 7u) value = texelFetch(pages[7], at, 0).r;
  return value;
}

#endif
