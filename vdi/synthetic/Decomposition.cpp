#include "vdi/synthetic/Decomposition.h"

#include <algorithm>
#include <array>
#include <random>
#include <utility>

#include "vdi/core/Error.h"

namespace vdi::synthetic {

namespace {

const std::array<std::pair<const char*, Layout>, 6> layouts{{{"slabs", Layout::Slabs},
                                                             {"bricks", Layout::Bricks},
                                                             {"interleaved", Layout::Interleaved},
                                                             {"checkerboard", Layout::Checkerboard},
                                                             {"random", Layout::Random},
                                                             {"one-rank", Layout::OnOneRank}}};

/// First step of piece i of n, when `size` steps are divided evenly.
int cut(int size, int n, int i) {
  return static_cast<int>(static_cast<std::int64_t>(size) * i / n);
}

int ownerOf(Layout layout, const glm::ivec3& at, const glm::ivec3& blocks, int index, int total, int ranks,
            std::mt19937& generator) {
  switch (layout) {
    case Layout::Slabs:
      return cut(ranks, blocks.z, at.z);
    case Layout::Bricks:
      return cut(ranks, total, index);
    case Layout::Interleaved:
      return index % ranks;
    case Layout::Checkerboard:
      return (at.x + at.y + at.z) % ranks;
    case Layout::Random:
      return static_cast<int>(generator() % static_cast<unsigned>(ranks));
    case Layout::OnOneRank:
      break;
  }
  return ranks - 1;
}

}  // namespace

Layout layoutFromString(const std::string& name) {
  std::string names;
  for (const auto& [text, layout] : layouts) {
    if (name == text) return layout;
    names += (names.empty() ? "" : ", ") + std::string(text);
  }
  throw Error(ErrorCode::InvalidArgument, "no layout '" + name + "'; use one of " + names);
}

std::vector<std::string> layoutNames() {
  std::vector<std::string> names;
  names.reserve(layouts.size());
  for (const auto& entry : layouts) names.emplace_back(entry.first);
  return names;
}

std::vector<Part> decompose(const glm::ivec3& size, const glm::ivec3& blocks, Layout layout, Joint joint,
                            int ranks, std::uint32_t seed) {
  // With shared points, cells are divided, and a piece holds the points of its cells. Otherwise values are
  // divided.
  const bool shared = joint == Joint::SharedPoints;
  const glm::ivec3 steps = shared ? size - 1 : size;
  const glm::ivec3 count =
      glm::clamp(blocks, glm::ivec3(1), glm::max(steps / (shared ? 1 : 2), glm::ivec3(1)));
  std::mt19937 generator(seed);
  std::vector<Part> parts;
  const int total = count.x * count.y * count.z;
  for (int z = 0; z < count.z; ++z) {
    for (int y = 0; y < count.y; ++y) {
      for (int x = 0; x < count.x; ++x) {
        const glm::ivec3 at{x, y, z};
        Part part{};
        for (int axis = 0; axis < 3; ++axis) {
          part.first[axis] = cut(steps[axis], count[axis], at[axis]);
          part.dims[axis] = cut(steps[axis], count[axis], at[axis] + 1) - part.first[axis] + (shared ? 1 : 0);
        }
        part.owner = ownerOf(layout, at, count, static_cast<int>(parts.size()), total, ranks, generator);
        parts.push_back(part);
      }
    }
  }
  return parts;
}

Block blockOf(const Lattice& lattice, const Part& part, const std::shared_ptr<std::byte[]>& data) {
  const glm::dvec3 origin = lattice.origin + glm::dvec3(part.first) * lattice.spacing;
  Block block = lattice.joint == Joint::Cells
                    ? Block::fromCells(part.dims, origin, lattice.spacing, lattice.type, data.get())
                    : Block::fromPoints(part.dims, origin, lattice.spacing, lattice.type, data.get());
  block.keepAlive = std::shared_ptr<const void>(data, data.get());
  return block;
}

}  // namespace vdi::synthetic
