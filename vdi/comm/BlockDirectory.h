// The positions of all ranks' blocks, known on every rank.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "vdi/comm/Communicator.h"
#include "vdi/core/Block.h"

namespace vdi::comm {

/// Faces of two blocks that differ by less than this, in spacings of the finer block, count as one face;
/// values this close to each other count as one value.
inline constexpr double latticeTolerance = 1e-3;

/// A block as other ranks need to know it.
struct BlockEntry {
  glm::dvec3 origin;   // position of the first stored value
  glm::dvec3 spacing;  // world
  glm::dvec3 offset;   // offset of the values from points or the middles of cells, in spacings
  Box asked;           // the owned box that the caller set
  Box owned;           // the owned box with gaps closed and close faces made equal
  glm::ivec3 dims;     // stored values
  std::int32_t rank;
  std::int32_t block;  // index on its rank
  std::int32_t grid;   // equal for blocks of a rank that share their values
  bool cells;          // owned boxes end between values, not at values
  bool masks;          // some stored values have no meaning

  double valueVolume() const { return spacing.x * spacing.y * spacing.z; }
  /// The box shifted by the block's offset, to the places of the values in it. If two boxes meet at a face,
  /// so do the shifted ones, provided that their blocks have the same offset and spacing.
  Box ofValues(const Box& box) const { return {box.lo + offset * spacing, box.hi + offset * spacing}; }
  /// The volume that the stored values represent, ghost layers included.
  Box storedBox() const {
    const glm::dvec3 beyond = cells ? 0.5 * spacing : glm::dvec3(0.0);
    return {origin - beyond, origin + glm::dvec3(dims - 1) * spacing + beyond};
  }
};

/// The level of a block compared with that of another one, by the volumes that one value of each represents.
/// Volumes that differ by at most 1 % are of the same level.
enum class LevelOrder { Finer, Same, Coarser };
LevelOrder levelOrderOf(const BlockEntry& block, const BlockEntry& comparedWith);

/// A search tree of boxes, to find those near a box without looking at all of them.
class BoxTree {
 public:
  explicit BoxTree(std::vector<Box> boxes);
  /// Indices of the boxes that meet `box`, faces included, ascending.
  std::vector<std::size_t> meeting(const Box& box) const;
  /// Index of a half-open box that contains the point; nullopt if there is none.
  std::optional<std::size_t> containing(const glm::dvec3& point) const;

 private:
  struct Node {
    Box bounds;
    std::size_t first = 0;  // first index in order_
    std::size_t last = 0;
    std::size_t lower = 0;  // child nodes; 0: a leaf
    std::size_t upper = 0;
  };
  void build(std::size_t node);

  std::vector<Box> boxes_;
  std::vector<std::size_t> order_;
  std::vector<Node> nodes_;
};

/// All blocks that own something.
class BlockDirectory {
 public:
  /// Collective. With `closeGaps`, the space between blocks of point data that are at most one spacing apart
  /// gets an owner: the coarser block, or the lower one of two of the same level, unless something touches
  /// its face there already. Then faces that differ by less than latticeTolerance become one, by a rule that
  /// gives the same result on every rank.
  BlockDirectory(const Communicator& comm, std::span<const Block> mine, bool closeGaps);

  /// Ordered by rank, then by block; the same on every rank.
  std::span<const BlockEntry> entries() const { return entries_; }
  /// This rank's entries are [firstMine(), lastMine()).
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

/// The parts of a block that it still owns.
struct OwnParts {
  std::vector<Box> boxes;
  std::vector<Box> finer;  // boxes that finer blocks took over
};

/// Collective. Gives the finest block everything that blocks of different levels share. Element [i] has the
/// parts that are left of entry firstMine() + i. If two blocks of one level overlap by more than
/// latticeTolerance on every axis, all ranks throw the same Error{InvalidArgument}, which names both blocks.
std::vector<OwnParts> settleOverlaps(const Communicator& comm, const BlockDirectory& directory);

}  // namespace vdi::comm
