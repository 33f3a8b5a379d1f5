// Segments merged lists again, to at most N_S supersegments each: sub-supersegments are samples of varying length.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/composite.h"

layout(local_size_x = compositeGroup) in;
layout(push_constant, scalar) uniform Push { CompositeConstants push; };

layout(constant_id = 0) const uint compositeProgram = compositeProgramSearch;
const bool countsGrains = compositeProgram == compositeProgramCountGrains;
const bool writesGrains = compositeProgram == compositeProgramWriteGrains;

#include "lists.glsl"
#include "grains.glsl"

void walk() {
  uint end = push.params.value.mergedOffsets.at[listIndex + 1u];
  for (uint i = push.params.value.mergedOffsets.at[listIndex]; i < end; ++i) {
    Segment s = push.params.value.merged.at[i];
    vec3 color = vec3(s.red, s.green, s.blue);
    float opticalDepth = opticalDepthOf(s.opacity);
    if (countsGrains || writesGrains) {
      vec4 x = appearanceOf(color, opticalDepth, s.back - s.front, push.params.value.step);
      grainsAdd(s.front, s.back, color, s.opacity, opticalDepth, x);
    } else {
      searchAdd(s.front, s.back, color, opticalDepth);
    }
  }
}

void main() {
  listIndex = gl_GlobalInvocationID.x;
  if (listIndex >= push.params.value.listCount) return;
  if (countsGrains) {
    countGrains();
  } else if (writesGrains) {
    writeGrains();
  } else {
    searchOrWriteList(push.mode == compositeModeWrite);
  }
}
