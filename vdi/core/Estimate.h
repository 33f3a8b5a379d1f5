// The bytes of a VDI, and an estimate of its size and time before it is made.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "vdi/core/Encoding.h"
#include "vdi/core/GenerateSettings.h"

namespace vdi {

/// The bytes of `lists` lists with `supersegments` supersegments in all. `Number` is the type of the counts.
template <typename Number>
constexpr Number bytesInMemory(Number lists, Number supersegments, Precision precision) {
  return lists * static_cast<Number>(sizeof(std::uint32_t)) +
         supersegments * static_cast<Number>(segmentBytes(precision));
}

/// The bytes that a VDI takes in a page, as requireRoom has it in web/decoder.js.
constexpr std::uint64_t bytesInPage(std::uint64_t lists, std::uint64_t supersegments, Precision precision) {
  constexpr std::uint64_t list = 20;
  constexpr std::uint64_t full = 40;
  constexpr std::uint64_t compact = 8;
  return lists * list + supersegments * (precision == Precision::Full ? full : compact);
}
/// The bytes that a page has for a VDI, PAGE_BYTES in web/decoder.js.
inline constexpr std::uint64_t mostPageBytes = std::uint64_t{3} << 29U;
/// Throws Error{OutOfMemory} for a VDI that takes more than mostPageBytes.
void requireFitsPages(std::uint64_t lists, std::uint64_t supersegments, Precision precision);

/// Settings and figures of a finished VDI.
struct MadeVdi {
  GenerateSettings settings;  // samplesPerVoxel is the rate in use, never automaticRate
  std::uint64_t lists = 0;    // margin included
  std::uint64_t supersegments = 0;
  double castSeconds = 0.0;  // the slowest rank's time for casting rays
  double listSeconds = 0.0;  // the slowest rank's time for sending, compositing and gathering lists
};

struct VdiEstimate {
  double bytesInMemory = 0.0;
  double mostBytesInMemory = 0.0;  // if every list is full
  double bytesAsFile = 0.0;
  std::optional<double> seconds;  // time without the upload of values
  bool isFromLast = false;
};

/// The share of N_S that lists hold in an unknown volume. In nine scenes it was 0.05 to 0.26
/// (docs/benchmarks.md, "How much is stored").
constexpr double typicalFill = 0.15;

/// Estimates a VDI. If `last` is a VDI of the same volume and transfer function, its supersegments are scaled
/// with the numbers of lists and N_S; otherwise lists hold typicalFill. The time for casting scales with the
/// samples, the rest with the supersegments. `seconds` is empty without `last`, or if `last` has another
/// algorithm or budget. The estimate ignores the viewpoint.
VdiEstimate estimateOf(const GenerateSettings& settings, const std::optional<MadeVdi>& last);

}  // namespace vdi
