// The range of a set of scalars.
#pragma once

#include <limits>

namespace vdi {

/// Smallest and largest finite value; {+inf, -inf} without any.
struct ScalarRange {
  double min = std::numeric_limits<double>::infinity();
  double max = -std::numeric_limits<double>::infinity();
  bool operator==(const ScalarRange&) const = default;
  void include(const ScalarRange& other);
};

}  // namespace vdi
