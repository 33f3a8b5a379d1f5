#include "vdi/comm/BeyondDomain.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "vdi/comm/Indices.h"

namespace vdi::comm {

namespace {

/// The next difference of a parabola whose last two differences are `before` and `last`, limited by both: 0
/// beyond an edge or an extremum, and at most twice the smaller one.
double limitedDifference(double last, double before) {
  if (!(last * before > 0.0)) return 0.0;
  const double bound = std::min(std::abs(last), std::abs(before));
  const double next = 2.0 * std::abs(last) - std::abs(before);
  return std::clamp(next, -bound, 2.0 * bound) * (last > 0.0 ? 1.0 : -1.0);
}

class Continuation {
 public:
  Continuation(const Block& block, std::span<const OpenPatch> patches) : block_(block), patches_(patches) {
    for (const OpenPatch& patch : patches) {
      std::vector<bool>& open = open_.emplace_back(patch.box.count(), false);
      for (const IndexBox& box : patch.open)
        forEachIndex(box, [&](const glm::ivec3& at) { open[patch.box.position(at)] = true; });
    }
  }

  /// Fills the open places next to known values. Returns false if there are none.
  bool advance() {
    std::vector<Filled> filled;
    for (std::size_t i = 0; i < patches_.size(); ++i) {
      for (const IndexBox& box : patches_[i].open) {
        forEachIndex(box, [&](const glm::ivec3& at) {
          const std::size_t place = patches_[i].box.position(at);
          if (!open_[i][place]) return;
          if (const std::optional<double> value = continuedAt(at)) filled.push_back({i, place, *value});
        });
      }
    }
    for (const Filled& one : filled) {
      storeValue(block_.type, patches_[one.patch].values, one.place, one.value);
      open_[one.patch][one.place] = false;
    }
    return !filled.empty();
  }

 private:
  struct Filled {
    std::size_t patch;
    std::size_t place;
    double value;
  };

  std::optional<double> known(const glm::ivec3& at) const {
    if (!block_.extended().contains(at)) return std::nullopt;
    for (std::size_t i = 0; i < patches_.size(); ++i) {
      if (patches_[i].box.contains(at) && open_[i][patches_[i].box.position(at)]) return std::nullopt;
    }
    const auto holds = [&at](const IndexBox& box) { return box.contains(at); };
    if (block_.masked && std::any_of(block_.masked->begin(), block_.masked->end(), holds))
      return std::nullopt;
    return valueAt(block_, at.x, at.y, at.z);
  }

  /// The mean over the axes that lead to known values.
  std::optional<double> continuedAt(const glm::ivec3& at) const {
    const IndexBox stored = block_.stored();
    double sum = 0.0;
    int count = 0;
    for (int axis = 0; axis < 3; ++axis) {
      if (at[axis] >= stored.lo[axis] && at[axis] < stored.hi[axis]) continue;
      if (const auto value = continuedAlong(axis, at[axis] < stored.lo[axis] ? 1 : -1, at)) {
        sum += *value;
        ++count;
      }
    }
    return count > 0 ? std::optional(sum / count) : std::nullopt;
  }

  /// `inward` is the step along the axis towards the stored values.
  std::optional<double> continuedAlong(int axis, int inward, glm::ivec3 at) const {
    at[axis] += inward;
    const std::optional<double> nearest = known(at);
    at[axis] += inward;
    const std::optional<double> second = known(at);
    at[axis] += inward;
    const std::optional<double> third = known(at);
    if (!nearest || !second || !third) return nearest;
    const double difference = limitedDifference(*nearest - *second, *second - *third);
    return std::isfinite(difference) ? *nearest + difference : *nearest;
  }

  const Block& block_;
  std::span<const OpenPatch> patches_;
  std::vector<std::vector<bool>> open_;  // for each patch, the places still open
};

}  // namespace

void continueBeyondDomain(const Block& block, std::span<const OpenPatch> patches) {
  Continuation continuation(block, patches);
  while (continuation.advance()) {
  }
}

}  // namespace vdi::comm
