// Segments merged lists again, to at most N_S supersegments each: sub-supersegments are samples of varying length.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/composite.h"

layout(local_size_x = compositeGroup) in;
layout(push_constant, scalar) uniform Push { CompositeConstants push; };

#include "lists.glsl"

void walk() {
  uint end = push.params.value.mergedOffsets.at[listIndex + 1u];
  for (uint i = push.params.value.mergedOffsets.at[listIndex]; i < end; ++i) {
    Segment s = push.params.value.merged.at[i];
    searchAdd(s.front, s.back, vec3(s.red, s.green, s.blue), opticalDepthOf(s.opacity));
  }
}

void main() {
  listIndex = gl_GlobalInvocationID.x;
  if (listIndex >= push.params.value.listCount) return;
  searchOrWriteList(push.mode == compositeModeWrite);
}
