// The number of supersegments that a list may hold: the same for all lists, or as many as each needs.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

namespace vdi {

enum class Budget : std::uint32_t {
  List = 0,  // up to N_S each, as in the paper
  /// All lists together hold as many as with N_S each. Complex lists get up to maxPerList, others fewer.
  Total = 1,
};

const char* toString(Budget budget);  // "list", "total"
/// Throws Error{InvalidArgument} that lists the valid names.
Budget budgetFromString(const std::string& name);

constexpr std::uint32_t maxSupersegments = 1024;  // limit for one list

/// The most that a list may hold. Twice N_S is enough: four times gave no better pictures.
constexpr std::uint32_t maxPerList(std::uint32_t supersegments, Budget budget) {
  return budget == Budget::List ? supersegments : std::min(2 * supersegments, maxSupersegments);
}

/// The demand of all lists, counted before Budget::Total allocates: the number of supersegments that they
/// would have at each of several levels of coarseness. Level 0 keeps every sample, the last level leaves one
/// supersegment per list, and the levels between are the tolerances that Algorithm::Merge tries. The
/// histogram of a picture is the sum of those of its parts.
struct SupersegmentHistogram {
  static constexpr std::size_t levels = 10;
  std::array<std::uint64_t, levels> supersegments{};  // each list limited to maxPerList
  std::uint64_t equally = 0;                          // number with at most N_S in each list
  bool operator==(const SupersegmentHistogram&) const = default;
  SupersegmentHistogram& operator+=(const SupersegmentHistogram& other) {
    for (std::size_t level = 0; level < levels; ++level) supersegments[level] += other.supersegments[level];
    equally += other.equally;
    return *this;
  }

  /// The fractional level at which there are `fill` times as many supersegments as `equally`. Counts are
  /// interpolated between two levels.
  float levelFor(double fill) const;
};

/// Offset in [0, 1) that is added to the number of supersegments of list `index` before rounding down.
/// Without it, similar lists would all round the same way, and their sum would be off.
constexpr float roundingOf(std::uint32_t index) {
  return static_cast<float>((index * 0x9E3779B1U) >> 8U) * 0x1p-24F;
}

/// The number of supersegments that a list gets at a level in [0, SupersegmentHistogram::levels - 1];
/// `countAt(k)` returns the number at level k.
template <typename CountAt>
std::uint32_t supersegmentsAt(float level, float rounding, CountAt countAt) {
  const auto below = std::min(static_cast<std::size_t>(level), SupersegmentHistogram::levels - 2);
  const float share = level - static_cast<float>(below);
  const auto a = static_cast<float>(countAt(below));
  const auto b = static_cast<float>(countAt(below + 1));
  return std::max(static_cast<std::uint32_t>(a + share * (b - a) + rounding), 1U);
}

}  // namespace vdi
