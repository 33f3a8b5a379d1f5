// Data that several tests share.
#pragma once

#include <vector>

#include "vdi/core/Camera.h"
#include "vdi/core/GenerateSettings.h"
#include "vdi/core/Reconstruction.h"
#include "vdi/core/TransferFunction.h"
#include "vdi/synthetic/Decomposition.h"
#include "vdi/synthetic/Fields.h"

namespace vdi::test {

inline constexpr Reconstruction reconstructions[] = {Reconstruction::Sheared, Reconstruction::Smooth,
                                                     Reconstruction::Constant};

/// The scalar that represents a field's 1, for a type; 0 represents 0.
inline double topOf(ScalarType type) {
  return sizeOf(type) == 1 ? 100.0 : type == ScalarType::F32 ? 1.0 : 1000.0;
}

/// A linear field, from 0 to 1 in the unit cube.
inline double slanted(const glm::dvec3& p) {
  return 0.45 * p.x + 0.35 * p.y + 0.2 * p.z;
}

/// The blocks that `rank` of `ranks` holds of a field on a lattice whose longest side is 1.
struct Decomposed {
  synthetic::Lattice lattice;
  std::vector<Block> mine;
  std::vector<Block> all;
};

inline Decomposed decompose(const char* field, const glm::ivec3& size, const glm::ivec3& blocks,
                            synthetic::Layout layout, synthetic::Joint joint, ScalarType type, int rank,
                            int ranks) {
  Decomposed decomposed;
  const bool cells = joint == synthetic::Joint::Cells;
  const double spacing = 1.0 / (glm::max(size.x, glm::max(size.y, size.z)) - (cells ? 0 : 1));
  decomposed.lattice = {size, glm::dvec3(0.0), glm::dvec3(spacing), type, joint};
  const synthetic::Field value = synthetic::makeField(field, 7);
  for (const synthetic::Part& part : synthetic::decompose(size, blocks, layout, joint, ranks, 3)) {
    Block block = synthetic::makeBlock(decomposed.lattice, part, [&](const glm::ivec3& index) {
      return value((glm::dvec3(index) + (cells ? 0.5 : 0.0)) * spacing) * topOf(type);
    });
    decomposed.all.push_back(block);
    if (part.owner == rank) decomposed.mine.push_back(block);
  }
  return decomposed;
}

/// The blocks of a field that this rank of `world` holds.
template <typename World>
Decomposed dealt(const World& world, const char* field, const glm::ivec3& size, const glm::ivec3& blocks,
                 synthetic::Layout layout, synthetic::Joint joint = synthetic::Joint::SharedPoints,
                 ScalarType type = ScalarType::F32) {
  return decompose(field, size, blocks, layout, joint, type, world.rank(), world.size());
}

/// All blocks of a field, on one rank.
inline Decomposed onOneRank(const char* field, const glm::ivec3& size,
                            const glm::ivec3& blocks = glm::ivec3(1), ScalarType type = ScalarType::F32,
                            synthetic::Joint joint = synthetic::Joint::SharedPoints) {
  return decompose(field, size, blocks, synthetic::Layout::OnOneRank, joint, type, 0, 1);
}

/// Three hues; transparent below a third; `top` is the scalar of full opacity. Unit distance: a twentieth of
/// the scene.
inline TransferFunction threeHues(double top, double unitDistance = 0.05) {
  TransferFunction function;
  function.colors = {{0.0, {0.1, 0.2, 0.9}}, {0.5 * top, {0.9, 0.9, 0.2}}, {top, {0.9, 0.1, 0.1}}};
  function.opacities = {{0.0, 0.0}, {0.33 * top, 0.0}, {0.6 * top, 0.25}, {top, 0.8}};
  function.unitDistance = unitDistance;
  return function;
}

inline GenerateSettings smallSettings(int width = 64, int height = 48, std::uint32_t supersegments = 12) {
  GenerateSettings settings;
  settings.width = width;
  settings.height = height;
  settings.supersegments = supersegments;
  return settings;
}

/// A camera that looks at the unit cube from an oblique direction.
inline Camera oblique(bool parallel = false) {
  Camera camera = Camera::framing({glm::dvec3(0.0), glm::dvec3(1.0)}, {-0.5, -0.35, -1.0}, {0.0, 1.0, 0.0});
  camera.parallelProjection = parallel;
  return camera;
}

}  // namespace vdi::test
