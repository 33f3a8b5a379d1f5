// Segments merged lists again, to at most N_S supersegments each: sub-supersegments are samples of varying length.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/composite.h"

layout(local_size_x = compositeGroup) in;
layout(push_constant, scalar) uniform Push { CompositeConstants push; };
layout(set = 0, binding = 1, scalar) uniform Params { CompositeParams params; };

layout(constant_id = 0) const uint compositeProgram = compositeProgramSearch;
layout(constant_id = 1) const bool byNeed = false;  // CompositeParams::level
const bool surveysGrains = compositeProgram == compositeProgramSurvey;
const bool countsGrains = compositeProgram == compositeProgramCountGrains || surveysGrains;
const bool writesGrains = compositeProgram == compositeProgramWriteGrains;

const uint rayShares = 1u;
const uint rayShare = 0u;
const bool cutAtGaps = false;  // a gap is a transparent sample

#include "lists.glsl"
#include "grains.glsl"

void walk() {
  SegmentArray merged = params.merged;
  StoredForm form = params.form;
  uint end = params.mergedOffsets.at[listIndex + 1u];
  for (uint i = params.mergedOffsets.at[listIndex]; i < end; ++i) {
    Material s = loadSegment(merged, i, form);
    if (countsGrains || writesGrains) {
      vec4 x = appearanceOf(s.color, s.opticalDepth, s.back - s.front, params.step);
      grainsAdd(s.front, s.back, s.color, opacityOf(s.opticalDepth), s.opticalDepth, x);
    } else {
      searchAdd(s.front, s.back, s.color, s.opticalDepth);
    }
  }
}

void main() {
  if (writesGrains && params.guard.at[0] == 0u) return;
  listIndex = gl_GlobalInvocationID.x;
  bool hasList = listIndex < params.listCount;
  if (surveysGrains) {
    surveyGrains(hasList);
    return;
  }
  if (!hasList) return;
  // A list that fits stays as it is: store.comp takes it from what was merged.
  uint count = params.mergedOffsets.at[listIndex + 1u] - params.mergedOffsets.at[listIndex];
  bool fits = !byNeed && count <= params.budget;
  if (fits && countsGrains) {
    params.sensitivities.at[listIndex] = -1.0;
    params.counts.at[listIndex] = 0u;
    return;
  }
  if (fits && writesGrains) {
    params.written.at[listIndex] = 0u;
    params.left.at[listIndex] = count;
    return;
  }
  if (countsGrains) {
    countGrains();
  } else if (writesGrains) {
    writeGrains();
  } else {
    searchOrWriteList(push.mode == compositeModeWrite);
  }
}
