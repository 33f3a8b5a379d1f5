// The simulation's blocks and arrays in the form that vdi/pipeline takes.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "catalyst_adaptor/StridedArray.h"
#include "catalyst_adaptor/vdi_catalyst.h"
#include "vdi/comm/Communicator.h"
#include "vdi/core/Block.h"
#include "vdi/core/Coloring.h"

namespace vdi::catalyst {

/// This rank's blocks and arrays. The callers have checked arguments: types and associations are those of
/// vdi_catalyst.h.
class Fields {
 public:
  /// Replaces the blocks, and forgets all arrays.
  void setBlocks(std::vector<vdi_catalyst_block> blocks);
  const std::vector<vdi_catalyst_block>& blocks() const { return blocks_; }
  /// A number that each setBlocks changes; equal on all ranks.
  std::uint64_t version() const { return version_; }

  /// The layout of a block's values in order: x fastest, components side by side, no gaps.
  StridedValues inOrder(const vdi_catalyst_block& block, int type, bool cells, int components,
                        const void* data) const;
  /// Sets an array's values, one entry for each block.
  void setArray(const std::string& name, bool cells, int type, std::vector<StridedValues> values);

  /// Whether the array of that name is one of cells; nullopt if this rank has neither blocks nor such an
  /// array. Throws std::runtime_error if arrays of both kinds have the name, or none has it.
  std::optional<bool> associationOf(const std::string& name) const;
  /// The names of all arrays, for messages: "cells 'V', points 'p'".
  std::string names() const;

  int componentsOf(const std::string& name, bool cells) const;  // 1 without blocks
  /// An array's values where the simulation has them, one for each block.
  struct Values {
    int type = VDI_CATALYST_F64;
    std::span<const StridedValues> blocks;
  };
  /// The values of an array, which must exist unless there are no blocks. `component` is one of the array's,
  /// or -1 for all. Throws std::runtime_error if there is no such array or component.
  Values valuesOf(const std::string& name, bool cells, int component) const;
  /// The blocks without values: each has its place, the box that it owns, and the layout of its values. Their
  /// `data` are distinct addresses that must not be read.
  std::vector<Block> placesOf(bool cells) const;
  /// The blocks with the values of an existing array. Blocks read the values where they are, unless these are
  /// out of order, 64-bit integers, or a magnitude. Throws std::runtime_error if there is no such component,
  /// or no memory.
  std::vector<Block> blocksOf(const std::string& name, bool cells, int component) const;

 private:
  struct Array {
    int type = VDI_CATALYST_F64;
    std::vector<StridedValues> values;
  };
  const Array* find(const std::string& name, bool cells) const;

  std::vector<vdi_catalyst_block> blocks_;
  std::uint64_t version_ = 0;
  std::map<std::pair<bool, std::string>, Array> arrays_;  // by whether it is one of cells, and name
};

/// The bytes of a scalar. Throws std::invalid_argument for a type that vdi_catalyst.h doesn't have.
std::size_t bytesOf(int type);

/// Collective: whether the array of that name is one of cells, unless `given` tells. Throws on all ranks as
/// Fields::associationOf does, and Error{InvalidArgument} if ranks differ.
bool agreeOnCells(const comm::Communicator& comm, const Fields& fields, const std::string& name,
                  std::optional<bool> given);

}  // namespace vdi::catalyst
