// What a run's condition is about: the maximum, minimum or mean of a field, of all ranks.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "catalyst_adaptor/json/Fields.h"
#include "vdi/comm/Communicator.h"
#include "vdi/config/Run.h"

namespace vdi::catalyst {

/// Reads values where they are, whatever their type and order, and copies none. Each place counts once: ghost
/// layers don't, nor do values that finer blocks cover. In a mean each value counts as much as the volume
/// that it stands for within what its block owns. A point on a face between two blocks thus counts half in
/// each.
class Measure {
 public:
  explicit Measure(config::RunCondition condition) : condition_(std::move(condition)) {}
  const config::RunCondition& condition() const { return condition_; }

  /// Collective. The maximum or minimum, or the mean for Mean and Change; nothing if no value counts. Throws
  /// on all ranks as agreeOnCells and Fields::valuesOf do.
  std::optional<double> of(const comm::Communicator& comm, const Fields& fields);

 private:
  /// A part of a block that it owns: along each axis, how much of each value's extent lies in it.
  struct Part {
    std::size_t block = 0;
    std::array<std::int64_t, 3> first{};  // indices of values
    std::array<std::vector<double>, 3> extents;
  };
  static std::optional<Part> partOf(std::size_t index, const Block& block);
  void findParts(const comm::Communicator& comm, const Fields& fields, bool cells);

  config::RunCondition condition_;
  std::vector<Part> parts_;
  std::optional<std::uint64_t> version_;  // of the blocks whose parts these are
  bool cells_ = false;

  friend class Sweep;
};

}  // namespace vdi::catalyst
