// Puts the ranks' sub-supersegments of each list in order of depth. Each rank's are in order already, and no two overlap,
// so the next one is the one whose front is nearest among the ranks' heads.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/composite.h"

layout(local_size_x = compositeGroup) in;
layout(push_constant, scalar) uniform Push { MergeConstants push; };

#include "optical.glsl"
#include "exact.glsl"
#include "store.glsl"

uint subOffset(uint rank, uint list) { return push.subOffsets.at[rank * (push.listCount + 1u) + list]; }

void countList(uint list) {
  uint total = 0u;
  for (uint rank = 0u; rank < push.rankCount; ++rank) total += subOffset(rank, list + 1u) - subOffset(rank, list);
  push.counts.at[list] = total;
}

// Comparable within a list.
float frontOf(SegmentArray segments, uint i) {
  if (compactForm) return float(depthCodes(CompactArray(segments).at[i]).x);
  return segments.at[i].front;
}

void copySegment(SegmentArray from, uint i, uint slot) {
  if (compactForm) {
    CompactArray(push.merged).at[slot] = CompactArray(from).at[i];
  } else {
    push.merged.at[slot] = from.at[i];
  }
}

void mergeList(uint list) {
  for (uint rank = 0u; rank < push.rankCount; ++rank) {
    push.heads.at[rank * push.listCount + list] = subOffset(rank, list);
  }
  uint end = push.offsets.at[list + 1u];
  for (uint slot = push.offsets.at[list]; slot < end; ++slot) {
    uint nearest = 0u;
    float nearestFront = uintBitsToFloat(0x7f800000u);
    for (uint rank = 0u; rank < push.rankCount; ++rank) {
      uint head = push.heads.at[rank * push.listCount + list];
      if (head == subOffset(rank, list + 1u)) continue;
      SegmentArray segments = push.received.at[rank];
      float front = frontOf(segments, head);
      if (front < nearestFront) {
        nearestFront = front;
        nearest = rank;
      }
    }
    uint head = push.heads.at[nearest * push.listCount + list]++;
    SegmentArray from = push.received.at[nearest];
    copySegment(from, head, slot);
  }
}

void main() {
  uint list = gl_GlobalInvocationID.x;
  if (list >= push.listCount) return;
  if (push.mode == mergeModeCount) {
    countList(list);
  } else {
    mergeList(list);
  }
}
