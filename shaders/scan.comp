// Exclusive prefix sum of counts, which gives each list's start in the compact array (paper, section 4).
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/scan.h"

layout(local_size_x = scanGroup) in;
layout(push_constant, scalar) uniform Push { ScanConstants push; };
layout(constant_id = 0) const bool guards = false;
layout(constant_id = 1) const bool guardedBefore = false;

shared uint64_t threadTotals[scanGroup];

void sumPart() {
  uint first = (gl_WorkGroupID.x * scanGroup + gl_LocalInvocationIndex) * scanPerThread;
  uint values[scanPerThread];
  uint64_t total = 0ul;
  for (uint i = 0u; i < scanPerThread; ++i) {
    values[i] = first + i < push.count ? push.values.at[first + i] : 0u;
    total += values[i];
  }
  threadTotals[gl_LocalInvocationIndex] = total;
  barrier();
  for (uint distance = 1u; distance < scanGroup; distance *= 2u) {
    uint64_t left =
        gl_LocalInvocationIndex >= distance ? threadTotals[gl_LocalInvocationIndex - distance] : 0ul;
    barrier();
    threadTotals[gl_LocalInvocationIndex] += left;
    barrier();
  }
  uint64_t groupTotal = threadTotals[scanGroup - 1u];
  uint running = uint(threadTotals[gl_LocalInvocationIndex] - total);
  for (uint i = 0u; i < scanPerThread; ++i) {
    if (first + i <= push.count) push.prefix.at[first + i] = running;
    running += values[i];
  }
  if (gl_LocalInvocationIndex == 0u) {
    push.sums.at[gl_WorkGroupID.x] = uint(groupTotal);
    if (groupTotal > 0xfffffffful) push.overflow.at[0] = 1u;
  }
}

// Each workgroup adds up the sums before its own: that is faster than another level of dispatches.
void addSums() {
  uint64_t total = 0ul;
  for (uint i = gl_LocalInvocationIndex; i < gl_WorkGroupID.x; i += scanGroup) total += push.sums.at[i];
  threadTotals[gl_LocalInvocationIndex] = total;
  barrier();
  for (uint offset = scanGroup / 2u; offset > 0u; offset /= 2u) {
    if (gl_LocalInvocationIndex < offset) {
      threadTotals[gl_LocalInvocationIndex] += threadTotals[gl_LocalInvocationIndex + offset];
    }
    barrier();
  }
  uint64_t before = threadTotals[0];
  uint64_t behind = before + push.sums.at[gl_WorkGroupID.x];
  if (gl_LocalInvocationIndex == 0u && behind > 0xfffffffful) push.overflow.at[0] = 1u;
  if (guards && gl_LocalInvocationIndex == 0u && gl_WorkGroupID.x + 1u == gl_NumWorkGroups.x) {
    bool fits = behind <= push.room;
    if (guardedBefore) fits = fits && push.guardBefore.at[0] == 1u;
    push.guard.at[0] = fits ? 1u : 0u;
  }
  uint first = gl_WorkGroupID.x * scanGroup * scanPerThread + gl_LocalInvocationIndex;
  // Requests all values before it writes any, because a GPU would otherwise wait for each of them.
  uint values[scanPerThread];
  for (uint i = 0u; i < scanPerThread; ++i) {
    uint at = first + i * scanGroup;
    values[i] = at <= push.count ? push.prefix.at[at] : 0u;
  }
  for (uint i = 0u; i < scanPerThread; ++i) {
    uint at = first + i * scanGroup;
    if (at <= push.count) push.prefix.at[at] = values[i] + uint(before);
  }
}

void rebase() {
  uint first = gl_WorkGroupID.x * scanGroup * scanPerThread + gl_LocalInvocationIndex;
  for (uint i = 0u; i < scanPerThread; ++i) {
    uint at = first + i * scanGroup;
    if (at <= push.count) push.prefix.at[at] += push.base;
  }
}

void main() {
  if (push.mode == scanModeSum) {
    sumPart();
  } else if (push.mode == scanModeRebase) {
    rebase();
  } else {
    addSums();
  }
}
