// The value that a run's condition tests: the maximum, minimum or mean of a field over all ranks.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "catalyst_adaptor/Fields.h"
#include "vdi/comm/Communicator.h"
#include "vdi/config/Run.h"

namespace vdi::catalyst {

/// Reads values of any type and order where they are. Missing ones don't count. Each place counts once: ghost
/// layers and values that finer blocks cover are left out. A mean weights each value by the volume that it
/// represents within its block's owned part. A point on a face between two blocks therefore counts
/// half in each. Values of staggered grids count like those of their cells or points.
class Measure {
 public:
  explicit Measure(config::RunCondition condition) : condition_(std::move(condition)) {}
  const config::RunCondition& condition() const { return condition_; }

  /// Collective: the maximum or minimum, or the mean for Mean and Change; nullopt if no value counts. Throws
  /// on all ranks as agreeOnCells and Fields::blocksOf do.
  std::optional<double> of(const comm::Communicator& comm, Fields& fields);

 private:
  /// The part of a block that it owns: along each axis, the length of each value's extent that lies in it, in
  /// world units.
  struct OwnedPart {
    std::size_t block = 0;  // its number among the blocks that have the array
    glm::ivec3 first{0};    // indices of values
    std::array<std::vector<double>, 3> extents;
  };
  static std::optional<OwnedPart> partOf(std::size_t index, const Block& block);
  void findParts(const comm::Communicator& comm, const Fields& fields, bool cells);

  config::RunCondition condition_;
  std::vector<OwnedPart> parts_;
  /// The blocks whose parts these are: their version, kind of values, and each one's address and place of its
  /// first value.
  std::optional<std::uint64_t> version_;
  bool cells_ = false;
  std::vector<std::pair<const void*, glm::dvec3>> sources_;

  friend class Sweep;
};

}  // namespace vdi::catalyst
