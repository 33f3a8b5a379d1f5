// Spreads particles over the cells of blocks; twin of vdi/reference/Deposit.cpp. An invocation spreads one
// particle over one block.
//
// Sums are integers, so their order doesn't matter, and runs are the same bit for bit. They have 64 bits in
// two words, because not all devices have atomics of 64 bits: the result of adding to the lower word shows
// whether it overflows.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/deposit.h"

layout(local_size_x = depositGroup) in;
layout(push_constant, scalar) uniform Push { DepositConstants push; };

void add(DepositSums sums, uint cell, float amount) {
  uint64_t units = uint64_t(int64_t(amount));
  uint low = uint(units & 0xfffffffful);
  uint high = uint(units >> 32);
  uint before = atomicAdd(sums.at[2u * cell], low);
  if (before > 0xffffffffu - low) high += 1u;
  if (high != 0u) atomicAdd(sums.at[2u * cell + 1u], high);
}

// The share along an axis of a cloud of `size` cells around `middle` that lies in the cell from `first` on.
float overlap(float first, float middle, float size) {
  float lo = max(first, middle - 0.5 * size);
  float hi = min(first + 1.0, middle + 0.5 * size);
  return max(hi - lo, 0.0) / size;
}

// The cubic spline M4 without its constant factor, which the shares' sum cancels.
float spline(float q) {
  float outer = max(2.0 - q, 0.0);
  float inner = max(1.0 - q, 0.0);
  return 0.25 * outer * outer * outer - inner * inner * inner;
}

// The share of the cell at `offset` from the position's cell.
float shareAt(DepositParticle particle, ivec3 offset) {
  vec3 first = vec3(offset);
  if (particle.mode == depositModeCloud) {
    return overlap(first.x, particle.within.x, particle.size.x) *
           overlap(first.y, particle.within.y, particle.size.y) *
           overlap(first.z, particle.within.z, particle.size.z);
  }
  return spline(length((first + 0.5 - particle.within) * particle.size));
}

// Goes to the next cell of the box, x fastest.
ivec3 next(ivec3 at, ivec3 lo, ivec3 hi) {
  at.x += 1;
  bool rowEnds = at.x == hi.x;
  at.x = rowEnds ? lo.x : at.x;
  at.y += rowEnds ? 1 : 0;
  bool layerEnds = at.y == hi.y;
  at.y = layerEnds ? lo.y : at.y;
  at.z += layerEnds ? 1 : 0;
  return at;
}

float sumOfShares(DepositParticle particle) {
  vec3 reach = 2.0 / particle.size;
  ivec3 lo = ivec3(floor(particle.within - reach));
  ivec3 hi = ivec3(floor(particle.within + reach)) + 1;
  float sum = 0.0;
  for (ivec3 at = lo; at.z < hi.z; at = next(at, lo, hi)) sum += shareAt(particle, at);
  return sum;
}

// One loop replaces nested ones: on a CPU device, lanes with different boxes run as often as the largest box
// has cells, and lavapipe ends all loops of an invocation after 65535 passes.
void main() {
  uint index = gl_GlobalInvocationID.x + gl_GlobalInvocationID.y * gl_NumWorkGroups.x * depositGroup;
  if (index >= push.count) return;
  DepositParticle particle = push.particles.at[index];
  DepositBlock block = push.blocks.at[particle.block];
  float weight = particle.weight;
  if (particle.mode == depositModeKernel) weight /= sumOfShares(particle);

  ivec3 cell = ivec3(particle.cellX, particle.cellY, particle.cellZ);
  ivec3 parts = ivec3(particle.parts & 1023u, (particle.parts >> 10) & 1023u, particle.parts >> 20) + 1;
  ivec3 lo = ivec3(particle.firstX, particle.firstY, particle.firstZ);
  ivec3 hi = ivec3(particle.lastX, particle.lastY, particle.lastZ);
  uint64_t layer = uint64_t(block.cellsX) * uint64_t(block.cellsY);
  for (ivec3 at = lo; at.z < hi.z; at = next(at, lo, hi)) {
    float share = shareAt(particle, at - cell);
    if (share > 0.0) {
      uvec3 to = uvec3(at / parts);
      add(DepositSums(block.sums + 8ul * layer * to.z), to.y * block.cellsX + to.x, weight * share);
    }
  }
}
