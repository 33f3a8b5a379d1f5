// Puts the ranks' sub-supersegments of each list in order of depth, or composites them to one colour. Each
// rank's supersegments are in order already, and no two overlap, so the next one is the nearest of the
// remaining heads. Twin of composite in vdi/reference/Reference.cpp, together with composite.comp.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/composite.h"

layout(local_size_x = compositeGroup) in;
layout(push_constant, scalar) uniform Push { InterleaveConstants push; };

#include "store.glsl"

uint subOffset(uint rank, uint list) { return push.subOffsets.at[rank * push.rowLength + list]; }

void countList(uint list) {
  uint total = 0u;
  for (uint rank = 0u; rank < push.rankCount; ++rank)
    total += subOffset(rank, list + 1u) - subOffset(rank, list);
  push.counts.at[list] = total;
}

// Depths, comparable within a list; codes, if the list has them.
vec2 depthsOf(uint i) {
  if (compactForm) return vec2(depthCodes(CompactArray(push.received).at[i]));
  Segment segment = segmentsFrom(push.received, i).at[0];
  return vec2(segment.front, segment.back);
}

// If two fronts were rounded to one code, the supersegment that ends first comes first.
bool isNearer(vec2 a, vec2 b) { return a.x < b.x || (a.x == b.x && a.y < b.y); }

void copySegment(uint i, uint slot) {
  if (compactForm) {
    CompactArray(push.interleaved).at[slot] = CompactArray(push.received).at[i];
  } else {
    segmentsFrom(push.interleaved, slot).at[0] = segmentsFrom(push.received, i).at[0];
  }
}

InterleaveHead headOf(uint begin, uint end) { return InterleaveHead(begin, end, depthsOf(begin)); }

// Merges up to two ranks, whose heads and codes stay in registers.
void mergeTwo(InterleaveHead a, InterleaveHead b, uint first, uint end) {
  CompactArray received = CompactArray(push.received);
  uvec2 codeOfA = uvec2(0u);
  uvec2 codeOfB = uvec2(0u);
  if (compactForm) {
    if (a.next < a.end) codeOfA = received.at[a.next];
    if (b.next < b.end) codeOfB = received.at[b.next];
  }
  for (uint slot = first; slot < end; ++slot) {
    bool fromA = b.next == b.end || (a.next < a.end && isNearer(a.depths, b.depths));
    InterleaveHead from = fromA ? a : b;
    uvec2 code = fromA ? codeOfA : codeOfB;
    if (compactForm) {
      storeCode(CompactArray(push.interleaved), code, slot, slot - first, end - first);
    } else {
      copySegment(from.next, slot);
    }
    ++from.next;
    if (from.next < from.end) {
      if (compactForm) {
        code = received.at[from.next];
        from.depths = vec2(depthCodes(code));
      } else {
        from.depths = depthsOf(from.next);
      }
    }
    if (fromA) {
      a = from;
      codeOfA = code;
    } else {
      b = from;
      codeOfB = code;
    }
  }
}

void mergeMany(uint heads, uint first, uint end) {
  for (uint slot = first; slot < end; ++slot) {
    uint place = first;
    InterleaveHead nearest = push.heads.at[first];
    for (uint i = first + 1u; i < first + heads; ++i) {
      InterleaveHead head = push.heads.at[i];
      if (isNearer(head.depths, nearest.depths)) {
        nearest = head;
        place = i;
      }
    }
    copySegment(nearest.next, slot);
    ++nearest.next;
    if (nearest.next < nearest.end) {
      nearest.depths = depthsOf(nearest.next);
      push.heads.at[place] = nearest;
    } else {
      --heads;
      push.heads.at[place] = push.heads.at[first + heads];
    }
  }
}

void interleaveList(uint list) {
  uint first = push.offsets.at[list];
  uint end = push.offsets.at[list + 1u];
  if (first == end) return;
  InterleaveHead one = InterleaveHead(0u, 0u, vec2(0.0));
  InterleaveHead two = one;
  uint heads = 0u;
  for (uint rank = 0u; rank < push.rankCount; ++rank) {
    uint begin = subOffset(rank, list);
    uint stop = subOffset(rank, list + 1u);
    if (begin == stop) continue;
    InterleaveHead head = headOf(begin, stop);
    if (heads == 0u) one = head;
    if (heads == 1u) two = head;
    // The heads fit, because each of these ranks has at least one supersegment.
    if (heads >= 2u) push.heads.at[first + heads] = head;
    ++heads;
  }
  if (heads <= 2u) {
    mergeTwo(one, two, first, end);
    return;
  }
  push.heads.at[first] = one;
  push.heads.at[first + 1u] = two;
  mergeMany(heads, first, end);
}

// Twin of flatten in vdi/core/Flatten.h.
void flattenList(uint list) {
  uint first = push.offsets.at[list];
  uint end = push.offsets.at[list + 1u];
  vec4 sum = vec4(0.0);
  float depth = uintBitsToFloat(0x7f800000u);
  for (uint i = first; i < end; ++i) {
    OpticalSegment m = loadSegment(push.interleaved, i, push.form);
    if (i == first) depth = m.front;
    sum += (1.0 - sum.a) * vec4(m.color, opacityOf(m.opticalDepth));
  }
  push.colors.at[list] = sum;
  push.depths.at[list] = depth;
}

void main() {
  uint list = gl_GlobalInvocationID.x;
  if (list >= push.listCount) return;
  if (push.mode == interleaveModeCount) countList(list);
  if (push.mode == interleaveModeWrite) interleaveList(list);
  if (push.mode == interleaveModeFlatten) flattenList(list);
}
