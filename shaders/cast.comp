// Casts one ray per pixel through a rank's blocks: DVR, or the search for each list's sensitivity, or the writing of its
// supersegments. Twin of castRay, renderVolume and generate in vdi/reference/Reference.cpp.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/cast.h"

layout(local_size_x = castGroupX, local_size_y = castGroupY) in;
layout(constant_id = 0) const bool volumeOnly = false;  // DVR alone: leaves the search out of the program
layout(constant_id = 1) const uint pageCount = 1;

layout(set = 0, binding = 0) uniform sampler3D pages[castMaxPages];

layout(push_constant, scalar) uniform Push { CastConstants push; };

#include "lists.glsl"

vec4 accumulated;
float firstDepth;

// What a sample is for: an interval of a list, or light of a pixel.
void useSample(float front, float back, vec3 color, float opticalDepth) {
  if (volumeOnly) {
    float opacity = opacityOf(opticalDepth);
    if (opacity > 0.0 && accumulated.a == 0.0) firstDepth = front;
    accumulated += (1.0 - accumulated.a) * opacity * vec4(color, 1.0);
  } else {
    searchAdd(front, back, color * opacityOf(opticalDepth), opticalDepth);
  }
}

#include "raycast.glsl"

void walk() { castRay(); }

void main() {
  uint x = gl_GlobalInvocationID.x;
  uint y = gl_GlobalInvocationID.y + push.firstRow;
  if (x >= push.params.value.width || y >= push.lastRow) return;
  listIndex = y * push.params.value.width + x;
  setUpRay(x, y);
  setUpScene();

  if (volumeOnly) {
    accumulated = vec4(0.0);
    firstDepth = uintBitsToFloat(0x7f800000u);
    castRay();
    push.params.value.colors.at[listIndex] = accumulated;
    push.params.value.depths.at[listIndex] = firstDepth;
    return;
  }

  searchOrWriteList(push.mode == castModeWrite);
}
