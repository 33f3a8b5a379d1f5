// An interval of a list, and the list's progress: what it has met so far.
//
// The program provides params with step.
#ifndef VDI_INTERVAL_GLSL
#define VDI_INTERVAL_GLSL
#include "appearance.glsl"

struct Interval {
  float front;
  float back;
  vec3 color;  // premultiplied
  float opacity;
  float opticalDepth;
  vec4 appearance;
};

struct ListProgress {
  float before;         // transmittance of all intervals so far
  float reach;          // end of the last interval
  float stepsPerDepth;  // 1 / length of a sample
  uint samplesAtOnce;   // samples that an interval represents
  uint visible;         // visible samples
  uint runs;            // a run ends at a gap, which is a part of the ray without intervals
  bool inRun;           // whether the next visible interval belongs to a run, if no gap precedes it
};

ListProgress progressAtFront(uint samplesAtOnce) {
  return ListProgress(1.0, 0.0, 1.0 / params.step, samplesAtOnce, 0u, 0u, false);
}

void countVisible(inout ListProgress progress) {
  progress.visible += progress.samplesAtOnce;
  if (!progress.inRun) ++progress.runs;
  progress.inRun = true;
}

#endif
