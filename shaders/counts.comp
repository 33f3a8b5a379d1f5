// Packs lists' counts, as bytes if they fit, for exchange between ranks.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/counts.h"

layout(local_size_x = countsGroup) in;
layout(push_constant, scalar) uniform Push { CountsConstants push; };

uint countOf(uint list) {
  return list < push.listCount ? push.offsets.at[list + 1u] - push.offsets.at[list] : 0u;
}

void pack(uint word) {
  uint packed = 0u;
  for (uint i = 0u; i < countsPerWord; ++i) {
    uint count = countOf(word * countsPerWord + i);
    if (count > 255u) push.tooLarge.at[0] = 1u;
    packed |= (count & 255u) << (8u * i);
  }
  push.packed.at[word] = packed;
}

void unpack(uint word) {
  uint packed = push.packed.at[word];
  for (uint i = 0u; i < countsPerWord; ++i) {
    push.counts.at[word * countsPerWord + i] = (packed >> (8u * i)) & 255u;
  }
}

void main() {
  uint word = gl_GlobalInvocationID.x + gl_GlobalInvocationID.y * gl_NumWorkGroups.x * countsGroup;
  if (word >= push.words) return;
  if (push.mode == countsModePack) pack(word);
  if (push.mode == countsModePackWide) push.packed.at[word] = countOf(word);
  if (push.mode == countsModeUnpack) unpack(word);
}
