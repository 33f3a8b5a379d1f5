// Spreads particles over the cells of blocks; twin of vdi/reference/Deposit.cpp. An invocation spreads one
// particle over one block.
//
// Sums are integers, so their order doesn't matter, and runs are the same bit by bit. They have 64 bits in
// two words, because not all devices have atomics of 64 bits: adding to the lower word tells whether it
// overflows.
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

// `offset`: from the position's cell to another one.
float shareAt(DepositParticle particle, ivec3 offset) {
  vec3 first = vec3(offset);
  if (particle.mode == depositModeCloud) {
    return overlap(first.x, particle.within.x, particle.size.x) *
           overlap(first.y, particle.within.y, particle.size.y) *
           overlap(first.z, particle.within.z, particle.size.z);
  }
  return spline(length((first + 0.5 - particle.within) * particle.size));
}

void main() {
  uint index = gl_GlobalInvocationID.x + gl_GlobalInvocationID.y * gl_NumWorkGroups.x * depositGroup;
  if (index >= push.count) return;
  DepositParticle particle = push.particles.at[index];
  DepositBlock block = push.blocks.at[particle.block];
  bool isCloud = particle.mode == depositModeCloud;
  vec3 reach = isCloud ? 0.5 * particle.size : 2.0 / particle.size;
  const vec3 farthest = vec3(1073741824.0);
  ivec3 lo = ivec3(max(floor(particle.within - reach), -farthest));
  ivec3 hi = ivec3(min(floor(particle.within + reach), farthest)) + 1;

  float weight = particle.weight;
  if (particle.mode == depositModeKernel) {
    float sum = 0.0;
    for (int z = lo.z; z < hi.z; ++z) {
      for (int y = lo.y; y < hi.y; ++y) {
        for (int x = lo.x; x < hi.x; ++x) sum += shareAt(particle, ivec3(x, y, z));
      }
    }
    weight /= sum;
  }

  ivec3 cell = ivec3(particle.cellX, particle.cellY, particle.cellZ);
  ivec3 parts = ivec3(particle.parts & 1023u, (particle.parts >> 10) & 1023u, particle.parts >> 20) + 1;
  ivec3 cells = ivec3(block.cellsX, block.cellsY, block.cellsZ);
  lo = max(lo, -cell);
  hi = min(hi, cells * parts - cell);
  lo.z = max(lo.z, particle.firstZ - cell.z);
  hi.z = min(hi.z, particle.lastZ - cell.z);
  for (int z = lo.z; z < hi.z; ++z) {
    uint64_t layer = uint64_t((cell.z + z) / parts.z) * uint64_t(block.cellsX) * uint64_t(block.cellsY);
    DepositSums sums = DepositSums(block.sums + 8ul * layer);
    for (int y = lo.y; y < hi.y; ++y) {
      uint row = uint((cell.y + y) / parts.y) * block.cellsX;
      for (int x = lo.x; x < hi.x; ++x) {
        float share = shareAt(particle, ivec3(x, y, z));
        if (share > 0.0) add(sums, row + uint((cell.x + x) / parts.x), weight * share);
      }
    }
  }
}
