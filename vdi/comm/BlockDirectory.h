// Where the blocks of all ranks lie, known on every rank.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "vdi/comm/Communicator.h"
#include "vdi/core/Block.h"

namespace vdi::comm {

/// Faces of two blocks that differ by less than that, in spacings of the finer one, are one face;
/// values that lie so close to each other are one value.
inline constexpr double latticeTolerance = 1e-3;

/// What other ranks need to know of a block.
struct BlockEntry {
  glm::dvec3 origin;   // of the first stored value
  glm::dvec3 spacing;  // world
  Box asked;           // the owned box as it was handed over
  Box owned;           // gaps closed, faces made one
  glm::ivec3 dims;     // stored values
  std::int32_t rank;
  std::int32_t block;  // index on its rank
  std::int32_t grid;   // blocks of a rank that share their values have the same one
  bool cells;          // owned boxes end between values, not at values
  bool masks;          // some stored values mean nothing

  double valueVolume() const { return spacing.x * spacing.y * spacing.z; }
  /// What the stored values stand for, ghost layers included.
  Box storedBox() const {
    const glm::dvec3 beyond = cells ? 0.5 * spacing : glm::dvec3(0.0);
    return {origin - beyond, origin + glm::dvec3(dims - 1) * spacing + beyond};
  }
};

/// By the volume that a value stands for: within a hundredth it's the same level.
enum class Level { Finer, Same, Coarser };
Level levelOf(const BlockEntry& block, const BlockEntry& comparedWith);

/// Boxes by place, so that those near a box are found without looking at all.
class BoxTree {
 public:
  explicit BoxTree(std::vector<Box> boxes);
  /// Indices of the boxes that meet `box`, faces included, ascending.
  std::vector<std::size_t> meeting(const Box& box) const;

 private:
  struct Node {
    Box bounds;
    std::size_t first = 0;  // of order_
    std::size_t last = 0;
    std::size_t lower = 0;  // child nodes; 0: a leaf
    std::size_t upper = 0;
  };
  void build(std::size_t node);

  std::vector<Box> boxes_;
  std::vector<std::size_t> order_;
  std::vector<Node> nodes_;
};

/// Blocks that own nothing aren't in it.
class BlockDirectory {
 public:
  /// Collective. With `closeGaps`, what's between blocks of point data that are at most one spacing
  /// apart gets an owner: the coarser block, of two of one level the lower one, unless something
  /// touches its face there already. Then faces that differ by less than latticeTolerance become
  /// one, by a rule that gives the same on every rank.
  BlockDirectory(const Communicator& comm, std::span<const Block> mine, bool closeGaps);

  /// By rank, then by block: the same on every rank.
  std::span<const BlockEntry> entries() const { return entries_; }
  /// This rank's, as indices of entries.
  std::size_t firstMine() const { return firstMine_; }
  std::size_t lastMine() const { return lastMine_; }
  /// Indices of entries that own or store something in `box`, faces included, ascending.
  std::vector<std::size_t> meeting(const Box& box) const { return tree_->meeting(box); }

 private:
  void growOverGaps(const Communicator& comm);
  double gapBeside(std::size_t index, const Box& box, int axis, bool above) const;
  void plantTree();

  std::vector<BlockEntry> entries_;
  std::size_t firstMine_ = 0;
  std::size_t lastMine_ = 0;
  std::unique_ptr<BoxTree> tree_;
};

/// What is left of a block.
struct OwnParts {
  std::vector<Box> boxes;
  std::vector<Box> finer;  // boxes that were taken off
};

/// Collective. What blocks of this rank own once the finest has got what blocks of different levels
/// share: `[i]` are the parts that are left of entry firstMine() + i. Where two blocks of one level
/// overlap by more than latticeTolerance on every axis, throws Error{InvalidArgument} on all ranks
/// that names both, the same wherever they are.
std::vector<OwnParts> settleOverlaps(const Communicator& comm, const BlockDirectory& directory);

}  // namespace vdi::comm
