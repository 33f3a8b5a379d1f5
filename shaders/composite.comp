// Segments interleaved lists again, to at most N_S supersegments each. Their intervals are sub-supersegments.
// Twin of composite in vdi/reference/Reference.cpp, together with interleave.comp.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/composite.h"

layout(local_size_x = compositeGroup) in;
layout(push_constant, scalar) uniform Push { CompositeConstants push; };
layout(set = 0, binding = 1, scalar) uniform Params { CompositeParams params; };

const uint compositeProgram = PROGRAM;  // as in cast.comp
layout(constant_id = 1) const bool byNeed = false;  // CompositeParams::level
const bool fillsHistogram = compositeProgram == compositeProgramHistogram;
const bool countsPreSegments = compositeProgram == compositeProgramCountPreSegments || fillsHistogram;
const bool writesPreSegments = compositeProgram == compositeProgramWritePreSegments;

const uint lanesPerRay = 1u;
const uint rayLane = 0u;
const bool cutAtGaps = false;  // a gap is a transparent sample

#include "lists.glsl"
#include "pre_segments.glsl"

ListState list;

void feedIntervals() {
  SegmentArray interleaved = params.interleaved;
  StoredForm form = params.form;
  uint end = params.interleavedOffsets.at[listIndex + 1u];
  for (uint i = params.interleavedOffsets.at[listIndex]; i < end; ++i) {
    OpticalSegment s = loadSegment(interleaved, i, form);
    if (countsPreSegments || writesPreSegments) {
      vec4 x = appearanceOf(s.color, s.opticalDepth, s.back - s.front, params.step);
      addInterval(list,
                  Interval(s.front, s.back, s.color, opacityOf(s.opticalDepth), s.opticalDepth, x));
    } else {
      searchAdd(s.front, s.back, s.color, s.opticalDepth);
    }
  }
}

void main() {
  if (writesPreSegments && params.guard.at[0] == 0u) return;
  listIndex = gl_GlobalInvocationID.x;
  bool hasList = listIndex < params.listCount;
  if (fillsHistogram) {
    clearGroupHistogram();
    if (hasList) {
      list = beginCounting(1u);
      feedIntervals();
    }
    endCounting(list, listIndex, hasList);
    return;
  }
  if (!hasList) return;
  // A list that fits stays unchanged: store.comp copies it from the interleaved lists.
  uint count = params.interleavedOffsets.at[listIndex + 1u] - params.interleavedOffsets.at[listIndex];
  bool fits = !byNeed && count <= params.budget;
  if (fits && countsPreSegments) {
    params.thresholds.at[listIndex] = -1.0;
    params.capacities.at[listIndex] = 0u;
    return;
  }
  if (fits && writesPreSegments) {
    params.written.at[listIndex] = 0u;
    params.left.at[listIndex] = count;
    return;
  }
  if (countsPreSegments) {
    list = beginCounting(1u);
    feedIntervals();
    endCounting(list, listIndex, true);
  } else if (writesPreSegments) {
    if (params.capacities.at[listIndex] == 0u) {
      storeCounts(0u, 0u, listIndex);
      return;
    }
    list = beginWriting(listIndex);
    feedIntervals();
    endWriting(list, listIndex);
  } else {
    searchOrWriteList(push.mode == compositeModeWrite);
  }
}
