// As reduce.comp, with a team for each list: a workgroup of one subgroup, whose invocations go through the grains side by side, in
// shared memory. A GPU is busy with few lists then, and reads and writes them once. Teams take one list after the other from the
// queue.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_basic : require
#include "shared/reduce.h"

layout(local_size_x_id = 0) in;  // gl_SubgroupSize, at most 32
layout(constant_id = 1) const uint capacity = 16u;  // grains of a list
layout(push_constant, scalar) uniform Push { ReduceConstants push; };

#include "optical.glsl"
#include "appearance.glsl"
#include "grain.glsl"
#include "merging.glsl"

// The list's grains. Arrays of what's read together, so that neighbouring invocations read neighbouring banks.
shared vec4 lights[capacity];
shared vec4 appearances[capacity];
shared vec2 spans[capacity];
shared float befores[capacity];
shared float costs[capacity];  // of merging each with the next one; unlimited for the last

const uint team = gl_WorkGroupSize.x;
uint own;  // which of the team

StoredGrain load(uint i) { return StoredGrain(spans[i], befores[i], 0.0, lights[i]); }

void store(uint i, StoredGrain grain, vec4 appearance) {
  spans[i] = grain.span;
  befores[i] = grain.before;
  lights[i] = grain.light;
  appearances[i] = appearance;
}

// From the device's memory; returns how many of them must not be merged with the one before. `ahead`: the invocation's first one.
uint loadList(uint base, uint count, StoredGrain ahead) {
  uint cuts = 0u;
  for (uint i = own; i < count; i += team) {
    StoredGrain grain = ahead;
    if (i >= team) grain = push.grains.at[base + i];
    store(i, grain, appearanceOf(grain, push.step));
    if (i > 0u && isCut(grain)) ++cuts;
  }
  subgroupBarrier();
  return subgroupAdd(cuts);
}

void storeList(uint base, uint count) {
  for (uint i = own; i < count; i += team) push.grains.at[base + i] = load(i);
  subgroupBarrier();
}

// Returns the sum of the invocation's own ones that aren't unlimited.
float findCosts(uint count) {
  float mine = 0.0;
  for (uint i = own; i < count; i += team) {
    float cost = unlimited;
    if (i + 1u < count) cost = costOf(load(i), appearances[i], load(i + 1u), appearances[i + 1u]);
    costs[i] = cost;
    mine += cost < unlimited ? cost : 0.0;
  }
  subgroupBarrier();
  return mine;
}

// One round; `excess` grains at most go, front to back. Returns how many are left; `others`: sum of what the mergers that weren't
// made would cost, of the invocation's own ones.
uint mergeOnce(uint count, uint excess, float limit, out float others) {
  uint left = 0u;
  uint absorbed = 0u;  // 1: the first grain of this turn, by the last one of the turn before
  others = 0.0;
  for (uint first = 0u; first < count; first += team) {
    uint i = first + own;
    bool present = i < count;
    float cost = unlimited;
    bool chosen = false;
    StoredGrain grain;
    vec4 appearance;
    StoredGrain next;
    vec4 nextAppearance;
    if (present) {
      cost = costs[i];
      grain = load(i);
      appearance = appearances[i];
      if (cost <= limit && excess > 0u) {  // there's a next one, or its cost were unlimited
        chosen = isCheapest(i, i > 0u ? costs[i - 1u] : unlimited, cost, costs[i + 1u], limit);
        next = load(i + 1u);
        nextAppearance = appearances[i + 1u];
      }
    }
    subgroupBarrier();  // all have read what's written below
    // Of the chosen ones, the first `excess` merge.
    uint mask = subgroupBallot(chosen).x;
    uint before = bitCount(mask & ((1u << own) - 1u));
    if (chosen && before < excess) {
      grain = merged(grain, appearance, next, nextAppearance);
      appearance = appearanceOf(grain, push.step);
    } else if (cost < unlimited) {
      others += cost;
    }
    uint chosenBefore = own > 0u ? mask >> (own - 1u) & 1u : 0u;
    before -= chosenBefore;
    bool gone = own > 0u ? chosenBefore > 0u && before < excess : absorbed > 0u;
    uint goneBefore = own > 0u ? absorbed + min(before, excess) : 0u;
    if (present && !gone) store(left + own - goneBefore, grain, appearance);
    uint mergers = bitCount(mask);
    uint chosenLast = mask >> (team - 1u);
    left += min(count - first, team) - absorbed - min(mergers - chosenLast, excess);
    absorbed = mergers <= excess ? chosenLast : 0u;
    excess -= min(mergers, excess);
  }
  subgroupBarrier();
  return left;
}

void mergeCheapest(uint count, uint most, uint cuts) {
  float mine = findCosts(count);
  while (count > most) {
    uint finite = count - 1u - cuts;
    if (finite == 0u) break;  // just cuts are left; there are no more of them than may be
    float limit = limitOf(subgroupAdd(mine), float(finite));
    count = mergeOnce(count, count - most, limit, mine);
    if (count > most) findCosts(count);
  }
}

struct ListOfGrains {
  uint first;
  uint count;
  uint most;  // that may be left
};

ListOfGrains listAt(uint place) {
  uint list = push.queue.at[place];
  return ListOfGrains(push.grainOffsets.at[list], push.written.at[list], push.left.at[list]);
}

void main() {
  own = gl_SubgroupInvocationID;
  uint queued = push.queued.at[0];
  uint place = gl_WorkGroupID.x;
  if (place >= queued) return;
  uint step = gl_NumWorkGroups.x;
  ListOfGrains ahead = listAt(place);
  StoredGrain grainAhead;
  if (own < ahead.count) grainAhead = push.grains.at[ahead.first + own];
  for (; place < queued; place += step) {
    ListOfGrains list = ahead;
    if (place + step < queued) ahead = listAt(place + step);
    uint cuts = loadList(list.first, list.count, grainAhead);
    if (own < ahead.count) grainAhead = push.grains.at[ahead.first + own];
    mergeCheapest(list.count, list.most, cuts);
    storeList(list.first, list.most);
  }
}
