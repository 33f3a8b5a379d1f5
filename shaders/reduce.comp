// Merges the pre-segments of lists that have too many, in rounds, until they fit. Twin of mergeCheapest in
// vdi/reference/SegmentByMerging.cpp. One invocation streams through the pre-segments of a list. This program
// is for devices and lists that reduce_subgroup.comp does not support.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/reduce.h"

layout(local_size_x = reduceGroup) in;
layout(push_constant, scalar) uniform Push { ReduceConstants push; };

#include "merging.glsl"

struct PreSegment {
  StoredPreSegment stored;
  vec4 appearance;
};

// The list's pre-segments in sequence; the next one is loading while one is used.
PreSegmentArray preSegments;
uint preSegmentCount;
uint nextRead;
StoredPreSegment preSegmentAhead;

void beginReading(uint count) {
  preSegmentCount = count;
  nextRead = 1u;
  preSegmentAhead = preSegments.at[0];
}

PreSegment readPreSegment() {
  StoredPreSegment preSegment = preSegmentAhead;
  if (nextRead < preSegmentCount) preSegmentAhead = preSegments.at[nextRead];
  ++nextRead;
  return PreSegment(preSegment, appearanceOf(preSegment, push.step));
}

float costOf(PreSegment a, PreSegment b) { return costOf(a.stored, a.appearance, b.stored, b.appearance); }

// Sum and number of the costs of the possible mergers.
float costSum;
float costsFinite;

void beginCosts() {
  costSum = 0.0;
  costsFinite = 0.0;
}

void addCost(float cost) {
  bool finite = cost < unlimited;
  costSum += finite ? cost : 0.0;
  costsFinite += finite ? 1.0 : 0.0;
}

// Requires at least two pre-segments.
void sumCosts(uint count) {
  beginReading(count);
  beginCosts();
  PreSegment a = readPreSegment();
  for (uint i = 1u; i < count; ++i) {
    PreSegment b = readPreSegment();
    addCost(costOf(a, b));
    a = b;
  }
}

// One round, in place, which requires at least two pre-segments and removes at most `excess`. Returns the
// number left.
uint mergeOnce(uint count, uint excess, float limit) {
  uint left = 0u;
  float previous = unlimited;
  beginReading(count);
  PreSegment a = readPreSegment();
  PreSegment b = readPreSegment();
  float cost = costOf(a, b);
  beginCosts();
  for (uint i = 0u; i < count;) {
    PreSegment c = b;
    float next = unlimited;
    if (i + 2u < count) {
      c = readPreSegment();
      next = costOf(b, c);
    }
    bool merges = excess > 0u && isCheapest(i, previous, cost, next, limit);
    if (merges) {
      a.stored = merged(a.stored, a.appearance, b.stored, b.appearance);
      --excess;
    }
    preSegments.at[left++] = a.stored;
    previous = merges ? next : cost;
    addCost(previous);
    i += merges ? 2u : 1u;
    a = merges ? c : b;
    b = c;
    cost = next;
    if (merges) {
      cost = unlimited;
      if (i + 1u < count) {
        b = readPreSegment();
        cost = costOf(a, b);
      }
    }
  }
  return left;
}

void main() {
  if (push.guard.at[0] == 0u) return;
  uint list = gl_GlobalInvocationID.x;
  if (list >= push.listCount) return;
  uint count = push.written.at[list];
  uint maxCount = push.left.at[list];
  if (count <= maxCount || count <= push.subgroupCapacity) return;
  preSegments = preSegmentsFrom(push.preSegments, push.preSegmentOffsets.at[list]);
  sumCosts(count);
  bool isStuck = false;
  while (count > maxCount) {
    if (costsFinite == 0.0) break;  // only cuts are left, and these do not exceed the limit
    uint before = count;
    count = mergeOnce(count, count - maxCount, limitOf(costSum, costsFinite));
    // This stops as in reduce_subgroup.comp.
    if (isStuck && count == before) break;
    isStuck = count == before;
  }
}
