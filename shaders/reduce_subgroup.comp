// Like reduce.comp, but with a subgroup, which is a whole workgroup, for each list. Its invocations work on
// the pre-segments side by side in shared memory, so few lists keep a GPU busy, and it reads and writes them
// once. Subgroups take one list after the other from those that long_lists.comp found.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_basic : require
#include "shared/reduce.h"

layout(local_size_x_id = 0) in;  // gl_SubgroupSize, at most 32
layout(constant_id = 1) const uint capacity = 16u;  // pre-segments of a list
layout(push_constant, scalar) uniform Push { ReduceConstants push; };

#include "merging.glsl"

// The list's pre-segments, in one array per member, so that neighbouring invocations read neighbouring banks.
shared vec4 lights[capacity];
shared vec4 appearances[capacity];
shared vec2 spans[capacity];
shared float befores[capacity];
shared float costs[capacity];  // cost of merging each with the next one; unlimited for the last

const uint subgroupSize = gl_WorkGroupSize.x;
uint own;  // index of the invocation in the subgroup

StoredPreSegment load(uint i) { return StoredPreSegment(spans[i], befores[i], 0.0, lights[i]); }

void store(uint i, StoredPreSegment preSegment, vec4 appearance) {
  spans[i] = preSegment.span;
  befores[i] = preSegment.before;
  lights[i] = preSegment.light;
  appearances[i] = appearance;
}

// Loads the list from device memory; returns how many pre-segments must not merge with the previous one.
// `ahead` is the invocation's first one.
uint loadList(PreSegmentArray preSegments, uint count, StoredPreSegment ahead) {
  uint cuts = 0u;
  for (uint i = own; i < count; i += subgroupSize) {
    StoredPreSegment preSegment = ahead;
    if (i >= subgroupSize) preSegment = preSegments.at[i];
    store(i, preSegment, appearanceOf(preSegment, push.step));
    if (i > 0u && isCut(preSegment)) ++cuts;
  }
  subgroupBarrier();
  return subgroupAdd(cuts);
}

void storeList(PreSegmentArray preSegments, uint count) {
  for (uint i = own; i < count; i += subgroupSize) preSegments.at[i] = load(i);
  subgroupBarrier();
}

// Returns the sum of the invocation's own costs that are not unlimited.
float findCosts(uint count) {
  float mine = 0.0;
  for (uint i = own; i < count; i += subgroupSize) {
    float cost = unlimited;
    if (i + 1u < count) cost = costOf(load(i), appearances[i], load(i + 1u), appearances[i + 1u]);
    costs[i] = cost;
    mine += cost < unlimited ? cost : 0.0;
  }
  subgroupBarrier();
  return mine;
}

// One round, which removes at most `excess` pre-segments, front to back. Returns the number left. `others` is
// the sum of the costs of the mergers not made, among the invocation's own.
uint mergeOnce(uint count, uint excess, float limit, out float others) {
  uint left = 0u;
  uint absorbed = 0u;  // 1: the last pre-segment of the turn before absorbs the first one of this turn
  others = 0.0;
  for (uint first = 0u; first < count; first += subgroupSize) {
    uint i = first + own;
    bool present = i < count;
    float cost = unlimited;
    bool chosen = false;
    StoredPreSegment preSegment;
    vec4 appearance;
    StoredPreSegment next;
    vec4 nextAppearance;
    if (present) {
      cost = costs[i];
      preSegment = load(i);
      appearance = appearances[i];
      if (cost <= limit && excess > 0u) {  // a next one exists, else its cost would be unlimited
        chosen = isCheapest(i, i > 0u ? costs[i - 1u] : unlimited, cost, costs[i + 1u], limit);
        next = load(i + 1u);
        nextAppearance = appearances[i + 1u];
      }
    }
    subgroupBarrier();  // all have read the values overwritten below
    // The first `excess` of the chosen ones merge.
    uint mask = subgroupBallot(chosen).x;
    uint before = bitCount(mask & ((1u << own) - 1u));
    if (chosen && before < excess) {
      preSegment = merged(preSegment, appearance, next, nextAppearance);
      appearance = appearanceOf(preSegment, push.step);
    } else if (cost < unlimited) {
      others += cost;
    }
    uint chosenBefore = own > 0u ? mask >> (own - 1u) & 1u : 0u;
    before -= chosenBefore;
    bool gone = own > 0u ? chosenBefore > 0u && before < excess : absorbed > 0u;
    uint goneBefore = own > 0u ? absorbed + min(before, excess) : 0u;
    if (present && !gone) store(left + own - goneBefore, preSegment, appearance);
    uint mergers = bitCount(mask);
    uint chosenLast = mask >> (subgroupSize - 1u);
    left += min(count - first, subgroupSize) - absorbed - min(mergers - chosenLast, excess);
    absorbed = mergers <= excess ? chosenLast : 0u;
    excess -= min(mergers, excess);
  }
  subgroupBarrier();
  return left;
}

void mergeCheapest(uint count, uint maxCount, uint cuts) {
  float mine = findCosts(count);
  bool isStuck = false;
  while (count > maxCount) {
    uint finite = count - 1u - cuts;
    if (finite == 0u) break;  // only cuts are left, and these do not exceed the limit
    float limit = limitOf(subgroupAdd(mine), float(finite));
    uint before = count;
    count = mergeOnce(count, count - maxCount, limit, mine);
    // The limit follows the costs of the round before, so a round may merge nothing. Two such rounds mean
    // costs that aren't numbers, which must not stop the device.
    if (isStuck && count == before) break;
    isStuck = count == before;
    if (count > maxCount) findCosts(count);
  }
}

struct ListOfPreSegments {
  PreSegmentArray preSegments;
  uint count;
  uint maxCount;  // number to be left
};

ListOfPreSegments listAt(uint place) {
  uint list = push.longLists.at[place];
  return ListOfPreSegments(preSegmentsFrom(push.preSegments, push.preSegmentOffsets.at[list]),
                           push.written.at[list], push.left.at[list]);
}

void main() {
  own = gl_SubgroupInvocationID;
  uint longListCount = push.longListCount.at[0];
  uint place = gl_WorkGroupID.x;
  if (place >= longListCount) return;
  uint step = gl_NumWorkGroups.x;
  ListOfPreSegments ahead = listAt(place);
  StoredPreSegment preSegmentAhead;
  if (own < ahead.count) preSegmentAhead = ahead.preSegments.at[own];
  for (; place < longListCount; place += step) {
    ListOfPreSegments list = ahead;
    if (place + step < longListCount) ahead = listAt(place + step);
    uint cuts = loadList(list.preSegments, list.count, preSegmentAhead);
    if (own < ahead.count) preSegmentAhead = ahead.preSegments.at[own];
    mergeCheapest(list.count, list.maxCount, cuts);
    storeList(list.preSegments, list.maxCount);
  }
}
