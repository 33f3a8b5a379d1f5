// Pre-segments in memory.
#ifndef VDI_STORED_PRE_SEGMENT_GLSL
#define VDI_STORED_PRE_SEGMENT_GLSL
#include "shared/lists.h"

vec4 lightOf(StoredPreSegment preSegment) { return vec4(preSegment.light.rgb, abs(preSegment.light.a)); }

bool isCut(StoredPreSegment preSegment) { return preSegment.light.a < 0.0; }

StoredPreSegment storedPreSegment(vec2 span, float before, vec4 light, bool cut) {
  return StoredPreSegment(span, before, 0.0, vec4(light.rgb, cut ? -light.a : light.a));
}

#endif
