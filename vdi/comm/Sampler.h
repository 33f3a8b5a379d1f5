// Trilinear interpolation in a block's values at the places of a lattice. Not part of the library's
// interface.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "vdi/comm/LocalValues.h"
#include "vdi/core/Block.h"

namespace vdi::comm {

/// The ascending places, along an axis, of the samples that make up each of several values.
struct SamplePlaces {
  std::vector<double> places;          // world
  std::vector<std::size_t> starts{0};  // index in `places` of each value's first place, and the end

  /// Ends a value: later places belong to the next one.
  void endValue() { starts.push_back(places.size()); }
  void clear();
};

/// Sums up samples. The block's values are gathered once, and weights are found once per axis. An object that
/// prepares again reuses its memory.
class Sampler {
 public:
  /// Finds the values that the samples need. `block` must stay until the next call.
  void prepare(const Block& block, const std::array<SamplePlaces, 3>& places);
  /// Whether the samples need values outside the box.
  bool leaves(const IndexBox& box) const;
  /// Reads these values. Later sums use the values that the block has now.
  void gather() { values_.gather(*block_, indices_); }

  /// The sum over the samples of one value. Samples that are not finite count as the mean of the finite
  /// ones. Without any finite one, the sum is infinite if all samples but NaN are infinities of one sign,
  /// else NaN.
  double sum(const glm::ivec3& value) const;

 private:
  /// A place along an axis, to which up to two values contribute.
  struct Sample {
    int count = 0;
    std::array<std::size_t, 2> offsets{};  // positions among the gathered values
    std::array<double, 2> weights{};
  };
  Sample sampleAt(std::size_t axis, double place);
  std::size_t numberOf(std::size_t axis, int index);
  double at(const Sample& x, const Sample& y, const Sample& z) const;

  const Block* block_ = nullptr;
  std::array<std::vector<Sample>, 3> samples_;
  std::array<std::vector<std::size_t>, 3> starts_;  // first index in samples_ of each value, and the end
  LocalValues::Indices indices_;
  LocalValues values_;
};

}  // namespace vdi::comm
