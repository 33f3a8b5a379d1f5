// Puts the ranks' sub-supersegments of each list in order of depth. Each rank's are in order already, and no two overlap,
// so the next one is the one whose front is nearest among the ranks' heads.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/composite.h"

layout(local_size_x = compositeGroup) in;
layout(push_constant, scalar) uniform Push { MergeConstants push; };

uint subOffset(uint rank, uint list) { return push.subOffsets.at[rank * (push.listCount + 1u) + list]; }

void countList(uint list) {
  uint total = 0u;
  for (uint rank = 0u; rank < push.rankCount; ++rank) total += subOffset(rank, list + 1u) - subOffset(rank, list);
  push.counts.at[list] = total;
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
      float front = push.received.at[rank].at[head].front;
      if (front < nearestFront) {
        nearestFront = front;
        nearest = rank;
      }
    }
    uint head = push.heads.at[nearest * push.listCount + list]++;
    push.merged.at[slot] = push.received.at[nearest].at[head];
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
