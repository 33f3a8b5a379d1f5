// Casts one ray per pixel through a rank's blocks. It renders DVR; or searches each list's sensitivity and
// writes its supersegments; or counts its pre-segments and writes them. Twin of castRay, renderVolume and
// generate in vdi/reference/Reference.cpp.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_shuffle : require
#include "shared/cast.h"

// The workgroup is one-dimensional, so that the invocations that share a ray are adjacent in one subgroup.
layout(local_size_x = castGroupX * castGroupY) in;
// The program's purpose. The build makes a module of each program, and for CPU devices another one without
// the code of the other programs.
const uint castProgram = PROGRAM;
layout(constant_id = 1) const uint pageCount = 1;
// Adjacent invocations that share a ray while pre-segments are counted, because with few rays a GPU waits for
// the longest. Each takes its share of the samples, and counts for its share of the tolerances.
layout(constant_id = 4) const uint lanesPerRay = 1;
uint rayLane = 0u;
// These are constants, because variables would occupy registers along the whole ray: whether supersegments
// must end at gaps; and whether a list gets the number that it needs (CastParams::level).
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
#include "raycast.glsl"

// The results of useSample: a pixel's light, or a list's pre-segments. castRay has no parameter for
// them, because a search's results are the globals of search.glsl.
vec4 accumulated;
float firstDepth;
ListState list;

// Uses a sample as an interval of a list, or as light of a pixel.
void useSample(float front, float back, Sample it) {
  if (volumeOnly) {
    if (it.opacity > 0.0 && accumulated.a == 0.0) firstDepth = front;
    accumulated += (1.0 - accumulated.a) * it.opacity * vec4(it.color, 1.0);
  } else if (countsPreSegments || writesPreSegments) {
    addInterval(list, Interval(front, back, it.color * it.opacity, it.opacity, it.opticalDepth,
                               vec4(it.color, 1.0) * it.overStep));
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
  setUpRay(x, y);
  setUpScene();

  if (countsPreSegments) {
    if (fillsHistogram) clearGroupHistogram();
    if (hasRay || !fillsHistogram) {
      list = beginCounting(samplesAtOnce);
      castRay();
    }
    endCounting(list, listIndex, hasRay);
    return;
  }

  if (writesPreSegments) {
    if (params.capacities.at[listIndex] == 0u) {
      storeCounts(0u, 0u, listIndex);
      return;
    }
    list = beginWriting(listIndex);
    castRay();
    endWriting(list, listIndex);
    return;
  }

  if (volumeOnly) {
    accumulated = vec4(0.0);
    firstDepth = uintBitsToFloat(0x7f800000u);
    extreme = noExtreme;
    castRay();
    if (projects) {
      params.extremes.at[listIndex] = extremeKey();
      return;
    }
    params.colors.at[listIndex] = accumulated;
    params.depths.at[listIndex] = firstDepth;
    return;
  }

  searchOrWriteList(push.mode == castModeWrite);
}
