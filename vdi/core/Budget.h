// How many supersegments each list may hold: equally many, or as many as it needs.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

namespace vdi {

enum class Budget : std::uint32_t {
  List = 0,  // up to N_S each, as in the paper
  /// In all as many as with N_S each: lists where much changes get more, up to maxPerList, others less.
  Total = 1,
};

const char* toString(Budget budget);  // "list", "total"
/// Throws Error{InvalidArgument} that lists the names there are.
Budget budgetFromString(const std::string& name);

constexpr std::uint32_t maxSupersegments = 1024;  // of a list

/// What a list may hold. Twice N_S is enough: four times gave no better pictures.
constexpr std::uint32_t maxPerList(std::uint32_t supersegments, Budget budget) {
  return budget == Budget::List ? supersegments : std::min(2 * supersegments, maxSupersegments);
}

/// What lists need, counted before Budget::Total hands out: how many supersegments all of them would have at
/// each of several levels of coarseness. Level 0 keeps every sample, the last one leaves one supersegment a
/// list, and those between are the tolerances of merging (vdi/reference/Segmenter.h). Histograms of parts of
/// a picture add up.
struct SupersegmentHistogram {
  static constexpr std::size_t levels = 10;
  std::array<std::uint64_t, levels> supersegments{};  // lists held to maxPerList
  std::uint64_t equally = 0;                          // with at most N_S in each list
  bool operator==(const SupersegmentHistogram&) const = default;
  SupersegmentHistogram& operator+=(const SupersegmentHistogram& other) {
    for (std::size_t level = 0; level < levels; ++level) supersegments[level] += other.supersegments[level];
    equally += other.equally;
    return *this;
  }

  /// The level, fractions included, at which there are `fill` times as many supersegments as equally: between
  /// two levels each list's number is interpolated.
  float levelFor(double fill) const;
};

/// What's added before a list's number is rounded down, in [0, 1): alike lists would otherwise all be rounded
/// the same way, and their sum would be off. `index`: of the list.
constexpr float roundingOf(std::uint32_t index) {
  return static_cast<float>((index * 0x9E3779B1U) >> 8U) * 0x1p-24F;
}

/// What a list gets at a level in [0, SupersegmentHistogram::levels - 1]; `countAt(k)` says what it would
/// hold at level k.
template <typename CountAt>
std::uint32_t supersegmentsAt(float level, float rounding, CountAt countAt) {
  const auto below = std::min(static_cast<std::size_t>(level), SupersegmentHistogram::levels - 2);
  const float share = level - static_cast<float>(below);
  const auto a = static_cast<float>(countAt(below));
  const auto b = static_cast<float>(countAt(below + 1));
  return std::max(static_cast<std::uint32_t>(a + share * (b - a) + rounding), 1U);
}

}  // namespace vdi
