// Casts one ray per pixel through a rank's blocks: DVR; or the search for each list's sensitivity, and the writing of its
// supersegments; or the counting of its grains, and the writing of them. Twin of castRay, renderVolume and generate in vdi/reference/Reference.cpp.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "shared/cast.h"

layout(local_size_x = castGroupX, local_size_y = castGroupY) in;
// What the program is for; the others' code is left out.
layout(constant_id = 0) const uint castProgram = castProgramSearch;
layout(constant_id = 1) const uint pageCount = 1;
// Invocations side by side that count the grains of one ray, each for its share of the tolerances: a GPU waits for the longest
// of few rays.
layout(constant_id = 4) const uint countShares = 1;

layout(set = 0, binding = 0) uniform sampler3D pages[castMaxPages];

layout(push_constant, scalar) uniform Push { CastConstants push; };
layout(set = 0, binding = 1, scalar) uniform Params { CastParams params; };

const bool volumeOnly = castProgram == castProgramVolume;
const bool surveysGrains = castProgram == castProgramSurvey;
const bool countsGrains = castProgram == castProgramCountGrains || surveysGrains;
const bool writesByNeed = castProgram == castProgramWriteByNeed;
const bool writesGrains = castProgram == castProgramWriteGrains || writesByNeed;

#include "lists.glsl"
#include "grains.glsl"

vec4 accumulated;
float firstDepth;

// What a sample is for: an interval of a list, or light of a pixel.
void useSample(float front, float back, vec3 color, float opticalDepth) {
  if (volumeOnly) {
    float opacity = opacityOf(opticalDepth);
    if (opacity > 0.0 && accumulated.a == 0.0) firstDepth = front;
    accumulated += (1.0 - accumulated.a) * opacity * vec4(color, 1.0);
  } else if (countsGrains || writesGrains) {
    float opacity = opacityOf(opticalDepth);
    // Nearly all intervals are one sample long.
    float part = back - front == params.step ? opacity : opacityOf(opticalDepth * params.step / (back - front));
    grainsAdd(front, back, color * opacity, opacity, opticalDepth, vec4(color, 1.0) * part);
  } else {
    searchAdd(front, back, color * opacityOf(opticalDepth), opticalDepth);
  }
}

#include "raycast.glsl"

void walk() { castRay(); }

void main() {
  uint x = gl_GlobalInvocationID.x;
  uint y = gl_GlobalInvocationID.y + push.firstRow;
  uint endRow = push.lastRow;
  listIndex = y * params.width + x;
  if (countsGrains) {
    uint stride = params.countedStride;
    uint column = gl_GlobalInvocationID.x / countShares;
    countShare = gl_GlobalInvocationID.x % countShares;
    x = column * stride;
    y = gl_GlobalInvocationID.y * stride + push.firstRow;
    endRow = min(push.lastRow + stride - 1u, params.height);
    listIndex = gl_GlobalInvocationID.y * params.countedWidth + column;
  }
  bool hasRay = x < params.width && y < endRow;
  if (!hasRay && !surveysGrains) return;
  samplesAtOnce = countsGrains ? params.countedSamples : 1u;
  grainsAtOnce = samplesAtOnce;
  setUpRay(x, y);
  setUpScene();

  if (surveysGrains) {
    surveyGrains(hasRay);
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

  if (countsGrains) {
    countGrains();
  } else if (writesGrains) {
    writeGrains();
  } else {
    searchOrWriteList(push.mode == castModeWrite);
  }
}
