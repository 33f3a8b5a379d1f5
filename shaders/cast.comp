// Casts one ray per pixel through a rank's blocks: DVR; or the search for each list's sensitivity, and the writing of
// its supersegments; or the counting of its pre-segments, and the writing of them. Twin of castRay, renderVolume and
// generate in vdi/reference/Reference.cpp.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_shuffle : require
#include "shared/cast.h"

// All along x, as whole subgroups must be: those that share a ray are side by side in one.
layout(local_size_x = castGroupX * castGroupY) in;
// What the program is for; the others' code is left out.
layout(constant_id = 0) const uint castProgram = castProgramSearch;
layout(constant_id = 1) const uint pageCount = 1;
// Invocations side by side that share a ray, where pre-segments are counted: a GPU waits for the longest of few rays.
// Each takes its share of the samples, and counts for its share of the tolerances.
layout(constant_id = 4) const uint lanesPerRay = 1;
uint rayLane = 0u;
// Constants, for what they take is live all along the ray: whether supersegments must end at gaps; and whether a list gets what it
// needs (CastParams::level).
layout(constant_id = 5) const bool cutAtGaps = false;
layout(constant_id = 6) const bool byNeed = false;

layout(set = 0, binding = 0) uniform sampler3D pages[castMaxPages];

layout(set = 0, binding = 2) uniform sampler2D slabs;  // core/SlabTable.h

layout(push_constant, scalar) uniform Push { CastConstants push; };
layout(set = 0, binding = 1, scalar) uniform Params { CastParams params; };

const bool volumeOnly = castProgram == castProgramVolume;
const bool fillsHistogram = castProgram == castProgramHistogram;
const bool countsLevels = castProgram == castProgramCountLevels;
const bool countsPreSegments = castProgram == castProgramCountPreSegments || fillsHistogram || countsLevels;
const bool writesPreSegments = castProgram == castProgramWritePreSegments;

#define SEVERAL_RANKS
#include "lists.glsl"
#include "pre_segments.glsl"

vec4 accumulated;
float firstDepth;

#include "raycast.glsl"

// What a sample is for: an interval of a list, or light of a pixel.
void useSample(float front, float back, Sample it) {
  if (volumeOnly) {
    if (it.opacity > 0.0 && accumulated.a == 0.0) firstDepth = front;
    accumulated += (1.0 - accumulated.a) * it.opacity * vec4(it.color, 1.0);
  } else if (countsPreSegments || writesPreSegments) {
    preSegmentsAdd(front, back, it.color * it.opacity, it.opacity, it.opticalDepth, vec4(it.color, 1.0) * it.overStep);
  } else {
    searchAdd(front, back, it.color * it.opacity, it.opticalDepth);
  }
}

void feedIntervals() { castRay(); }

void main() {
  if (writesPreSegments && params.guard.at[0] == 0u) return;
  uvec2 at = gl_WorkGroupID.xy * uvec2(castGroupX, castGroupY) +
             uvec2(gl_LocalInvocationIndex % castGroupX, gl_LocalInvocationIndex / castGroupX);
  uint x = at.x;
  uint y = at.y + push.firstRow;
  uint endRow = push.lastRow;
  listIndex = y * params.width + x;
  if (countsPreSegments) {
    uint stride = params.countedStride;
    uint column = at.x / lanesPerRay;
    rayLane = at.x % lanesPerRay;
    x = column * stride;
    y = at.y * stride + push.firstRow;
    endRow = min(push.lastRow + stride - 1u, params.height);
    listIndex = at.y * params.countedWidth + column;
  }
  bool hasRay = x < params.width && y < endRow;
  if (!hasRay && !fillsHistogram) return;
  samplesAtOnce = countsPreSegments ? params.countedSamples : 1u;
  preSegmentsAtOnce = samplesAtOnce;
  setUpRay(x, y);
  setUpScene();

  if (fillsHistogram) {
    addToHistogram(hasRay);
    return;
  }

  if (volumeOnly) {
    accumulated = vec4(0.0);
    firstDepth = uintBitsToFloat(0x7f800000u);
    castRay();
    params.colors.at[listIndex] = accumulated;
    params.depths.at[listIndex] = firstDepth;
    return;
  }

  if (countsLevels) {
    countLevels();
  } else if (countsPreSegments) {
    countPreSegments();
  } else if (writesPreSegments) {
    writePreSegments();
  } else {
    searchOrWriteList(push.mode == castModeWrite);
  }
}
