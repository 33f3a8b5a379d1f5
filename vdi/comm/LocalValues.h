// Values of a block, gathered for code that reads each of them several times. Not part of the library's
// interface.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "vdi/core/Block.h"

namespace vdi::comm {

/// The values of a block at all combinations of some indices per axis. An object that gathers again reuses
/// its memory.
class LocalValues {
 public:
  using Indices = std::array<std::vector<int>, 3>;  // per axis, each ascending, none of them empty

  /// The indices lie in block.extended().
  void gather(const Block& block, const Indices& indices);
  /// The values of a box within block.extended().
  void gather(const Block& block, const IndexBox& box);

  /// The values are [z][y][x], by positions in the indices, not by the indices themselves.
  std::size_t size() const { return values_.size(); }
  double operator[](std::size_t position) const { return values_[position]; }
  double& operator[](std::size_t position) { return values_[position]; }

 private:
  template <typename RowAt>
  void take(ScalarType type, const IndexBox& box, const Indices& indices, RowAt rowAt);
  void takeCopies(ScalarType type, const Block& from, const IndexBox& box, const glm::ivec3& shift,
                  const Indices& indices);

  std::vector<double> values_;
  std::vector<double> row_;  // memory for values that aren't an array
  Indices range_;
};

}  // namespace vdi::comm
