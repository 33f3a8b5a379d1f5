// Particles and blocks of cells for tests of deposits.
#pragma once

#include <array>
#include <cstdint>
#include <random>
#include <vector>

#include "vdi/core/Block.h"
#include "vdi/core/Particles.h"

namespace vdi::test {

/// Particles with memory of their own.
struct ParticleSet {
  std::vector<glm::dvec3> positions;
  std::vector<double> weights;
  std::vector<double> lengths;  // empty: cloud in cell
  std::array<bool, 3> periodic{};

  Particles particles() const {
    Particles all;
    all.count = positions.size();
    all.periodic = periodic;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto* const first = reinterpret_cast<const std::byte*>(positions.data());
      all.positions[axis] = {first + axis * sizeof(double), sizeof(glm::dvec3), true};
    }
    if (!weights.empty())
      all.weights = {reinterpret_cast<const std::byte*>(weights.data()), sizeof(double), true};
    if (!lengths.empty())
      all.lengths = {reinterpret_cast<const std::byte*>(lengths.data()), sizeof(double), true};
    return all;
  }
  double total() const {
    double sum = 0.0;
    for (const double weight : weights) sum += weight;
    return sum;
  }
  /// Adds a particle of another set.
  void add(const ParticleSet& other, std::size_t i) {
    positions.push_back(other.positions[i]);
    if (!other.weights.empty()) weights.push_back(other.weights[i]);
    if (!other.lengths.empty()) lengths.push_back(other.lengths[i]);
  }
};

/// Particles in the box, with weights from 0.5 to 1.5. Smoothing lengths, if `longest` > 0, are from 0.1 to 1
/// times that.
inline ParticleSet randomParticles(std::size_t count, const Box& box, double longest, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  ParticleSet set;
  for (std::size_t i = 0; i < count; ++i) {
    glm::dvec3 at;
    for (int axis = 0; axis < 3; ++axis) at[axis] = unit(random);
    set.positions.push_back(box.lo + at * box.size());
    set.weights.push_back(0.5 + unit(random));
    if (longest > 0.0) set.lengths.push_back(longest * (0.1 + 0.9 * unit(random)));
  }
  return set;
}

/// A block of cells without values; `ghosts` layers at all sides lie outside `box`.
inline Block cellsIn(const Box& box, const glm::dvec3& spacing, int ghosts = 0) {
  static const char nothing = 0;
  const glm::ivec3 dims = glm::ivec3(glm::round(box.size() / spacing)) + 2 * ghosts;
  return Block::fromCells(dims, box.lo - static_cast<double>(ghosts) * spacing, spacing, ScalarType::U8,
                          &nothing, {glm::ivec3(ghosts), glm::ivec3(ghosts)});
}

/// `blocks` per axis of the box, of `cells` cells in all; the x axis has twice the others' resolution.
inline std::vector<Block> latticeIn(const Box& box, int cells, const glm::ivec3& blocks, int ghosts = 0) {
  const glm::dvec3 spacing = box.size() / glm::dvec3(2 * cells, cells, cells);
  std::vector<Block> all;
  const auto cut = [&](int i, int count, int axis) {
    return box.lo[axis] + spacing[axis] * ((axis == 0 ? 2 : 1) * cells * i / count);
  };
  for (int z = 0; z < blocks.z; ++z) {
    for (int y = 0; y < blocks.y; ++y) {
      for (int x = 0; x < blocks.x; ++x) {
        const Box part{{cut(x, blocks.x, 0), cut(y, blocks.y, 1), cut(z, blocks.z, 2)},
                       {cut(x + 1, blocks.x, 0), cut(y + 1, blocks.y, 1), cut(z + 1, blocks.z, 2)}};
        all.push_back(cellsIn(part, spacing, ghosts));
      }
    }
  }
  return all;
}

/// Three levels over the unit cube: eight coarse blocks of 6 cells; one of 12 cells at twice the
/// resolution, which hides some of their cells; and in that one a block whose faces lie within
/// cells of the others.
inline std::vector<Block> levelsInCube(int ghosts = 0) {
  std::vector<Block> all;
  const double coarse = 1.0 / 12;
  for (int i = 0; i < 8; ++i) {
    const glm::dvec3 lo = 0.5 * glm::dvec3(i & 1, (i >> 1) & 1, i >> 2);
    all.push_back(cellsIn({lo, lo + 0.5}, glm::dvec3(coarse), ghosts));
  }
  const glm::dvec3 lo(3.0 * coarse);
  all.push_back(cellsIn({lo, lo + 6.0 * coarse}, glm::dvec3(0.5 * coarse), ghosts));
  const glm::dvec3 finer(0.36);
  all.push_back(cellsIn({finer, finer + 0.2}, glm::dvec3(0.02), ghosts));
  return all;
}

}  // namespace vdi::test
