// Makes texels from values as simulations store them. writeRow in VolumeUpload.cpp does the same on the host.
// Also copies texels that another block of the rank has.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/cast.h"
#include "shared/cells.h"
#include "shared/place.h"
#include "pages.glsl"

layout(local_size_x = placeGroup) in;
layout(set = 0, binding = 3) writeonly uniform image3D stores[castMaxPages];
layout(push_constant, scalar) uniform Push { PlaceConstants push; };

uint jobOf(uint group) {
  uint low = 0u;
  uint high = push.jobCount;
  while (high - low > 1u) {
    uint middle = (low + high) / 2u;
    if (push.jobs.at[middle].firstGroup <= group) {
      low = middle;
    } else {
      high = middle;
    }
  }
  return low;
}

// Infinite texels become finite ones: they would turn what is interpolated with them into NaN.
float filterable(uint bits) {
  bool isInfinite = (bits & 0x7fffffffu) == 0x7f800000u;
  return uintBitsToFloat(isInfinite ? (bits & 0x80000000u) | infiniteTexelBits : bits);
}

float texelOf(PlaceJob job, uint index, uvec3 at) {
  if (job.type == placeTexel) return texelAt(job.fromPage, ivec3(job.from + at));
  if (job.type <= placeI8) {
    uint value = (job.values.at[index >> 2] >> (8u * (index & 3u))) & 0xffu;
    return float(job.type == placeI8 ? value ^ 0x80u : value) / 255.0;
  }
  if (job.type <= placeI16) {
    uint value = (job.values.at[index >> 1] >> (16u * (index & 1u))) & 0xffffu;
    return float(job.type == placeI16 ? value ^ 0x8000u : value) / 65535.0;
  }
  uint bits = job.values.at[index];
  if (job.type == placeF32) return filterable(bits);
  double value = job.type == placeI32 ? double(int(bits)) : double(bits);
  return float((value - job.offset) / job.scale);
}

void store(uint page, ivec3 at, float texel) {
  vec4 color = vec4(texel, 0.0, 0.0, 0.0);
  if (pageCount == 1u || page == 0u) imageStore(stores[0], at, color);
  if (pageCount > 1u && page == 1u) imageStore(stores[1], at, color);
  if (pageCount > 2u && page == 2u) imageStore(stores[2], at, color);
  if (pageCount > 3u && page == 3u) imageStore(stores[3], at, color);
  if (pageCount > 4u && page == 4u) imageStore(stores[4], at, color);
  if (pageCount > 5u && page == 5u) imageStore(stores[5], at, color);
  if (pageCount > 6u && page == 6u) imageStore(stores[6], at, color);
  if (pageCount > 7u && page == 7u) imageStore(stores[7], at, color);
}

void main() {
  uint group = gl_WorkGroupID.x + gl_WorkGroupID.y * gl_NumWorkGroups.x;
  if (group >= push.groupCount) return;
  PlaceJob job = push.jobs.at[jobOf(group)];
  uint count = job.size.x * job.size.y * job.size.z;
  uint first = (group - job.firstGroup) * placeGroup * placeEach + gl_LocalInvocationIndex;
  for (uint i = 0u; i < placeEach; ++i) {
    uint index = first + i * placeGroup;
    if (index >= count) break;
    uint row = index / job.size.x;
    uvec3 at = uvec3(index - row * job.size.x, row % job.size.y, row / job.size.y);
    store(job.page, ivec3(job.place + at), texelOf(job, index, at));
  }
}
