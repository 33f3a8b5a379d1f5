// The blocks and arrays that a simulation has handed over, in the form that vdi/pipeline takes.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "catalyst_adaptor/HostCopy.h"
#include "catalyst_adaptor/ParticleArray.h"
#include "catalyst_adaptor/StridedArray.h"
#include "catalyst_adaptor/memory/GpuMemory.h"
#include "catalyst_adaptor/vdi_catalyst.h"
#include "vdi/comm/Communicator.h"
#include "vdi/core/Block.h"
#include "vdi/core/Coloring.h"
#include "vdi/core/ComponentValues.h"

namespace vdi::catalyst {

/// This rank's blocks and arrays. The callers have checked arguments: types and associations are those of
/// vdi_catalyst.h.
class Fields {
 public:
  /// Replaces the blocks, and forgets all arrays and offsets.
  void setBlocks(std::vector<vdi_catalyst_block> blocks);
  const std::vector<vdi_catalyst_block>& blocks() const { return blocks_; }
  /// A number that each setBlocks changes; equal on all ranks.
  std::uint64_t version() const { return version_; }
  /// A number that each change of blocks, arrays or offsets changes.
  std::uint64_t changes() const { return changes_; }

  /// The layout of a block's values in order: x fastest, components side by side, no gaps.
  StridedValues inOrder(const vdi_catalyst_block& block, int type, bool cells, int components,
                        const void* data) const;
  /// A change to be made. Preparing it allocates all memory, so `set` can't fail: ranks first agree that all
  /// have prepared it.
  class Change;
  /// An array's values, one entry for each block, with the same number of components. Blocks that lack the
  /// array have a null `first`. An array of cells replaces particles of that name.
  /// Values in a GPU's memory become those of a copy, which `fetch` makes. Throws std::invalid_argument for
  /// memory that values can't be taken from.
  Change arrayChange(const std::string& name, bool cells, int type, std::vector<StridedValues> values);
  /// Makes the numbers stand for missing values of that array, instead of those before.
  static Change missingChange(const std::string& name, bool cells, std::vector<double> missing);
  /// Shifts the values of that array by `offset` cells from the points or the centres of cells.
  static Change offsetChange(const std::string& name, bool cells, const std::array<double, 3>& offset);
  /// Particles to deposit into a cell array, which replaces a cell array of that name.
  /// Numbers in a GPU's memory are treated as in arrayChange.
  Change particlesChange(const std::string& name, ParticleArray particles);
  void set(Change change) noexcept;
  /// The particles of that name; null if there are none. All ranks have particles of the same names.
  const ParticleArray* particlesOf(const std::string& name) const;
  /// Sets the values that were made from the particles, one entry for each block; `dropDeposits` drops them
  /// all.
  void setDeposit(const std::string& name, DepositedValues values);
  bool hasDeposit(const std::string& name) const { return deposits_.contains(name); }
  void dropDeposits();

  /// A step begins, in which values may have changed.
  void beginStep() { ++step_; }
  /// Makes values of this step readable: copies those that lie in a GPU's memory, at the step's first call,
  /// and checks that the host can read the others. Must come before anything reads values of an array or of
  /// particles. The name need not exist. Throws std::runtime_error.
  void fetch(const std::string& name, bool cells);
  void fetchParticles(const std::string& name);
  void fetchArrays();
  GpuMemory& gpuMemory() { return gpuMemory_; }

  /// Whether this rank has the array, which some of its blocks may lack.
  bool has(const std::string& name, bool cells) const;
  /// Whether the array of that name holds cell data; nullopt if this rank has no such array. Throws
  /// std::runtime_error if arrays of both kinds have the name.
  std::optional<bool> associationOf(const std::string& name) const;
  /// The names of all arrays, for messages: "cells 'V', points 'p'".
  std::string names() const;

  struct NamedArray {
    std::string name;
    bool cells = false;
    int type = VDI_CATALYST_F64;
    glm::dvec3 offset{0.0};                 // in cells
    std::vector<double> missing{};          // as missingOf gives them
    std::span<const StridedValues> blocks;  // one entry for each block; null `first` where a block lacks it
  };
  /// All arrays, where the simulation has their values, in the order in which they were first set.
  std::vector<NamedArray> arrays() const;
  /// All particles, by name.
  const std::map<std::string, ParticleArray>& particles() const { return particles_; }
  /// The offset of an array's values, in cells. It may be given before the array.
  glm::dvec3 offsetOf(const std::string& name, bool cells) const;
  /// The numbers that stand for an array's missing values. They may be given before the array.
  const std::vector<double>& missingOf(const std::string& name, bool cells) const;

  int componentsOf(const std::string& name, bool cells) const;  // 1 if none of this rank's blocks has it
  /// The blocks that have the array, without its values: each has its place, the box that it owns, and the
  /// number of its values. Their `data` are the addresses of this object's blocks.
  std::vector<Block> placesOf(const std::string& name, bool cells) const;
  /// The blocks that have the array, with its values. They read these where they are; nothing is copied.
  /// `component` is one of the array's, `magnitude`, `phase` or `together`; `missing` are numbers that stand
  /// for missing values, beside those of missingOf. Throws std::runtime_error if the array has no such
  /// component.
  std::vector<Block> blocksOf(const std::string& name, bool cells, int component,
                              std::span<const double> missing = {}) const;

 private:
  struct Array {
    int type = VDI_CATALYST_F64;
    std::vector<StridedValues> values;
    std::uint64_t set = 0;             // the number of the change that first set an array of that name
    std::shared_ptr<HostCopy> copy{};  // null: all values lie on the host
    std::uint64_t fetched = 0;         // the step in which the values were made readable
  };
  using Key = std::pair<bool, std::string>;  // whether it is one of cells, and the name
  const Array* find(const std::string& name, bool cells) const;
  void put(std::map<Key, Array>& fresh) noexcept;
  using Entry = std::pair<const Key, Array>;
  void fetch(std::span<Entry* const> arrays);

  GpuMemory gpuMemory_;
  std::uint64_t step_ = 1;
  std::vector<vdi_catalyst_block> blocks_;
  std::uint64_t version_ = 0;
  std::uint64_t changes_ = 0;
  std::map<Key, Array> arrays_;
  std::map<Key, glm::dvec3> offsets_;  // in cells; none: 0
  std::map<Key, std::vector<double>> missing_;
  std::map<std::string, ParticleArray> particles_;
  std::map<std::string, DepositedValues> deposits_;  // the memory of arrays made from particles
  /// The arrays of the blocks before, whose copies' memory serves arrays of the same names again.
  std::map<Key, Array> before_;
};

class Fields::Change {
  friend class Fields;
  Key key_;
  // One of these has an entry, whose memory becomes that of the fields.
  std::map<Key, Array> array_;
  std::map<Key, glm::dvec3> offset_;
  std::map<Key, std::vector<double>> missing_;
  std::map<std::string, ParticleArray> particles_;
};

/// The bytes of a scalar. Throws std::invalid_argument for a type that vdi_catalyst.h doesn't have.
std::size_t bytesOf(int type);

/// Collective: whether the array of that name holds cell data, unless `given` says so. A rank that lacks the
/// array counts as one whose blocks lack it. Throws on all ranks as Fields::associationOf does, and if no
/// rank has the array, all blocks lack it, or ranks have arrays of different kinds.
bool agreeOnCells(const comm::Communicator& comm, const Fields& fields, const std::string& name,
                  std::optional<bool> given);

}  // namespace vdi::catalyst
