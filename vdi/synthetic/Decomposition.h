// Cuts a lattice into blocks and assigns them to ranks, in ways that simulations use and in harder ones.
#pragma once

#include <algorithm>
#include <cstdint>
#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "vdi/core/Block.h"
#include "vdi/core/Parallel.h"

namespace vdi::synthetic {

/// The assignment of blocks to ranks.
enum class Layout { Slabs, Bricks, Interleaved, Checkerboard, Random, OnOneRank };
/// Accepts "slabs", "bricks", "interleaved", "checkerboard", "random", "one-rank"; throws
/// Error{InvalidArgument} that lists them.
Layout layoutFromString(const std::string& name);
std::vector<std::string> layoutNames();

/// How blocks share the values at the cuts.
enum class Joint {
  SharedPoints,  // point data; both neighbours hold the points of their common face
  Gap,           // point data; each point is held once, so no block covers a cell between two blocks
  Cells,         // cell data; each cell is held once
};

/// Part of a lattice of `size` values (points or cells).
struct Part {
  glm::ivec3 first;  // index of the first value held
  glm::ivec3 dims;   // values held
  int owner;         // rank
};

/// `blocks` is the number per axis, limited so that each block has at least two values. Deterministic, and
/// equal on every rank.
std::vector<Part> decompose(const glm::ivec3& size, const glm::ivec3& blocks, Layout layout, Joint joint,
                            int ranks, std::uint32_t seed);

/// The whole lattice that Parts divide.
struct Lattice {
  glm::ivec3 size{0};      // values per axis
  glm::dvec3 origin{0.0};  // lower corner of the domain
  glm::dvec3 spacing{1.0};
  ScalarType type = ScalarType::F32;
  Joint joint = Joint::SharedPoints;
};

/// Makes a block for a part, with its own copy of the values. `valueAt(index)` gives the value at a lattice
/// index, and integers are rounded. Several threads may call it at once.
template <typename ValueAt>
Block makeBlock(const Lattice& lattice, const Part& part, ValueAt valueAt);

/// Makes a block that has these values and keeps them.
Block blockOf(const Lattice& lattice, const Part& part, const std::shared_ptr<std::byte[]>& data);

/// Calls use(0) .. use(layers - 1), on several threads if the layers have many values.
template <typename Use>
void layerByLayer(int layers, std::size_t values, Use use) {
  constexpr std::size_t many = std::size_t{1} << 20;
  const auto count = static_cast<std::size_t>(layers);
  const std::size_t perLayer = std::max<std::size_t>(values / std::max<std::size_t>(count, 1), 1);
  inParallel(count, (many + perLayer - 1) / perLayer, [&](std::size_t first, std::size_t last) {
    for (std::size_t layer = first; layer < last; ++layer) use(static_cast<int>(layer));
  });
}

template <typename ValueAt>
Block makeBlock(const Lattice& lattice, const Part& part, ValueAt valueAt) {
  const auto count = static_cast<std::size_t>(part.dims.x) * static_cast<std::size_t>(part.dims.y) *
                     static_cast<std::size_t>(part.dims.z);
  const std::shared_ptr<std::byte[]> data(new std::byte[count * sizeOf(lattice.type)]);
  layerByLayer(part.dims.z, count, [&](int z) {
    std::size_t index = static_cast<std::size_t>(z) * static_cast<std::size_t>(part.dims.x) *
                        static_cast<std::size_t>(part.dims.y);
    for (int y = 0; y < part.dims.y; ++y) {
      for (int x = 0; x < part.dims.x; ++x) {
        storeValue(lattice.type, data.get(), index++, valueAt(part.first + glm::ivec3(x, y, z)));
      }
    }
  });
  return blockOf(lattice, part, data);
}

}  // namespace vdi::synthetic
