// Turns intervals into supersegments for one sensitivity: the exchangeable part. This is
// segmentWithSensitivity of vdi/reference/Segmenter.cpp as a state machine that takes one interval at a time.
//
// The program provides bool cutAtGaps, constant; void emitSegment(OpticalSegment segment).
#ifndef VDI_SEGMENTER_GLSL
#define VDI_SEGMENTER_GLSL
#include "appearance.glsl"
#include "store.glsl"

void emitSegment(OpticalSegment segment);

struct SegmenterState {
  float sensitivity;
  bool open;
  float front;
  float reach;  // end of the last absorbed interval
  float back;   // end of the last visible interval
  vec3 color;
  float opticalDepth;
};

SegmenterState segmenter;
float segmenterStep;      // depth to which both sides of Eq. 1 are normalised

void segmenterBegin(float sensitivity) {
  segmenter.sensitivity = sensitivity;
  segmenter.open = false;
  segmenter.reach = -1.0;
  segmenter.opticalDepth = 0.0;
}

void segmenterClose() {
  emitSegment(OpticalSegment(segmenter.front, segmenter.back, segmenter.color, segmenter.opticalDepth));
  segmenter.open = false;
}

void segmenterAbsorb(float back, vec3 color, float opticalDepth) {
  segmenter.reach = back;
  if (!(opticalDepth > 0.0)) return;
  segmenter.back = back;
  segmenter.color += (1.0 - opacityOf(segmenter.opticalDepth)) * color;
  segmenter.opticalDepth = min(segmenter.opticalDepth + opticalDepth, maxOpticalDepth);
}

void segmenterAdd(float front, float back, vec3 color, float opticalDepth) {
  if (segmenter.open) {
    vec4 mine = appearanceOf(segmenter.color, segmenter.opticalDepth, segmenter.reach - segmenter.front,
                             segmenterStep);
    if (front > segmenter.reach) {
      // The gap is a transparent sample.
      if (cutAtGaps || length(mine) > segmenter.sensitivity) {
        segmenterClose();
      } else {
        segmenter.reach = front;
        mine = appearanceOf(segmenter.color, segmenter.opticalDepth, segmenter.reach - segmenter.front,
                            segmenterStep);
      }
    }
    if (segmenter.open) {
      vec4 other = appearanceOf(color, opticalDepth, back - front, segmenterStep);
      if (length(mine - other) > segmenter.sensitivity) segmenterClose();
    }
  }
  if (segmenter.open) {
    segmenterAbsorb(back, color, opticalDepth);
  } else if (opticalDepth > 0.0) {
    segmenter.open = true;
    segmenter.front = front;
    segmenter.reach = back;
    segmenter.back = back;
    segmenter.color = color;
    segmenter.opticalDepth = opticalDepth;
  }
}

void segmenterEnd() {
  if (segmenter.open) segmenterClose();
}

#endif
