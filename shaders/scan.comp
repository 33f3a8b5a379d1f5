// Exclusive prefix sum of counts: where each list starts in the compact array (paper, section 4).
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/scan.h"

layout(local_size_x = scanGroup) in;
layout(push_constant, scalar) uniform Push { ScanConstants push; };

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
    uint64_t left = gl_LocalInvocationIndex >= distance ? threadTotals[gl_LocalInvocationIndex - distance] : 0ul;
    barrier();
    threadTotals[gl_LocalInvocationIndex] += left;
    barrier();
  }
  uint64_t groupTotal = threadTotals[scanGroup - 1u];
  uint running = uint(threadTotals[gl_LocalInvocationIndex] - total);
  for (uint i = 0u; i < scanPerThread; ++i) {
    if (first + i < push.count) push.prefix.at[first + i] = running;
    running += values[i];
  }
  if (gl_LocalInvocationIndex == 0u) {
    push.sums.at[gl_WorkGroupID.x] = uint(groupTotal);
    if (groupTotal > 0xfffffffful) push.overflow.at[0] = 1u;
  }
}

void addSums() {
  uint first = (gl_WorkGroupID.x * scanGroup + gl_LocalInvocationIndex) * scanPerThread;
  uint before = push.sums.at[gl_WorkGroupID.x];
  for (uint i = 0u; i < scanPerThread; ++i) {
    if (first + i < push.count) push.prefix.at[first + i] += before;
  }
}

void main() {
  if (push.mode == scanModeSum) {
    sumPart();
  } else {
    addSums();
  }
}
