#include "vdi/comm/Sampler.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "vdi/comm/BlockDirectory.h"

namespace vdi::comm {

void SamplePlaces::clear() {
  places.clear();
  starts.assign(1, 0);
}

void Sampler::prepare(const Block& block, const std::array<SamplePlaces, 3>& places) {
  block_ = &block;
  std::size_t stride = 1;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    indices_[axis].clear();
    samples_[axis].clear();
    starts_[axis] = places[axis].starts;
    for (const double place : places[axis].places) samples_[axis].push_back(sampleAt(axis, place));
    for (Sample& sample : samples_[axis]) {
      for (std::size_t& offset : sample.offsets) offset *= stride;
    }
    stride *= indices_[axis].size();
  }
}

bool Sampler::leaves(const IndexBox& box) const {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::vector<int>& own = indices_[axis];
    const auto a = static_cast<int>(axis);
    if (own.front() < box.lo[a] || own.back() >= box.hi[a]) return true;
  }
  return false;
}

Sampler::Sample Sampler::sampleAt(std::size_t axis, double place) {
  const auto a = static_cast<int>(axis);
  double position = (place - block_->origin[a]) / block_->spacing[a];
  const double whole = std::round(position);
  if (std::abs(position - whole) < latticeTolerance) position = whole;
  if (block_->nearest) position = std::floor(position + 0.5);
  const double base = std::floor(position);
  const double share = position - base;
  Sample sample;
  const auto add = [&](int index, double weight) {
    if (!(weight > 0.0)) return;
    const auto next = static_cast<std::size_t>(sample.count++);
    sample.offsets[next] = numberOf(axis, index);
    sample.weights[next] = weight;
  };
  add(static_cast<int>(base), 1.0 - share);
  add(static_cast<int>(base) + 1, share);
  return sample;
}

/// The position of an index among the gathered ones. Adds it if it is new. Samples come in ascending order.
std::size_t Sampler::numberOf(std::size_t axis, int index) {
  const auto a = static_cast<int>(axis);
  const IndexBox all = block_->extended();
  const int at = std::clamp(index, all.lo[a], all.hi[a] - 1);
  std::vector<int>& own = indices_[axis];
  if (own.empty() || own.back() < at) own.push_back(at);
  return static_cast<std::size_t>(std::lower_bound(own.begin(), own.end(), at) - own.begin());
}

double Sampler::at(const Sample& x, const Sample& y, const Sample& z) const {
  if (x.count == 1 && y.count == 1 && z.count == 1)  // weights of 1: the samples of a finer block's means
    return values_[z.offsets[0] + y.offsets[0] + x.offsets[0]];
  double sum = 0.0;
  for (std::size_t k = 0; k < static_cast<std::size_t>(z.count); ++k) {
    for (std::size_t j = 0; j < static_cast<std::size_t>(y.count); ++j) {
      for (std::size_t i = 0; i < static_cast<std::size_t>(x.count); ++i) {
        const double weight = x.weights[i] * y.weights[j] * z.weights[k];
        sum += weight * values_[z.offsets[k] + y.offsets[j] + x.offsets[i]];
      }
    }
  }
  return sum;
}

double Sampler::sum(const glm::ivec3& value) const {
  std::array<std::size_t, 3> first{};
  std::array<std::size_t, 3> last{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto number = static_cast<std::size_t>(value[static_cast<int>(axis)]);
    first[axis] = starts_[axis][number];
    last[axis] = starts_[axis][number + 1];
  }
  double sum = 0.0;
  double infinite = 0.0;
  int finite = 0;
  for (std::size_t z = first[2]; z < last[2]; ++z) {
    for (std::size_t y = first[1]; y < last[1]; ++y) {
      for (std::size_t x = first[0]; x < last[0]; ++x) {
        const double sample = at(samples_[0][x], samples_[1][y], samples_[2][z]);
        if (std::isinf(sample)) infinite += sample;
        if (!std::isfinite(sample)) continue;
        sum += sample;
        ++finite;
      }
    }
  }
  const std::size_t count = (last[0] - first[0]) * (last[1] - first[1]) * (last[2] - first[2]);
  if (finite > 0) return sum * static_cast<double>(count) / finite;
  return infinite != 0.0 ? infinite : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace vdi::comm
