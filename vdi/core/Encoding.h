// The encodings of supersegments: the types that hold them in memory, between ranks and in files, and the
// facts that other code needs about each. docs/architecture.md lists the other places of an encoding.
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <variant>

#include "vdi/core/Supersegment.h"

namespace vdi {

/// The facts about one encoding.
template <typename Segment>
struct EncodingOf;

template <>
struct EncodingOf<Supersegment> {
  /// The encoding's number: in a file's header, and in the shaders' constant `encoding`.
  static constexpr Precision precision = Precision::Full;
  static constexpr bool hasDepthCode = false;
  static constexpr std::size_t chunkBytes = 24;     // size of a supersegment in a file's chunk, before LZ4
  static constexpr double typicalFileBytes = 14.5;  // mean size of a supersegment in a file
};

template <>
struct EncodingOf<CompactSupersegment> {
  static constexpr Precision precision = Precision::Compact;
  static constexpr bool hasDepthCode = true;
  static constexpr std::size_t chunkBytes = 9;  // two each for depths and optical depth, one per channel
  static constexpr double typicalFileBytes = 5.5;
};

/// Lists in any encoding. The index of the active alternative is the encoding's number.
using AnyLists = std::variant<SupersegmentLists, CompactLists>;

/// Instantiates a template for the types of all encodings: `instantiate` is a macro that takes the type.
#define VDI_EACH_ENCODING(instantiate) instantiate(Supersegment) instantiate(CompactSupersegment)

namespace detail {

template <typename Lists>
using SegmentOf = typename decltype(Lists::segments)::value_type;

template <std::size_t index>
constexpr bool isNumberedFrom() {
  if constexpr (index < std::variant_size_v<AnyLists>) {
    using Segment = SegmentOf<std::variant_alternative_t<index, AnyLists>>;
    return static_cast<std::size_t>(EncodingOf<Segment>::precision) == index && isNumberedFrom<index + 1>();
  } else {
    return true;
  }
}
static_assert(isNumberedFrom<0>());

template <std::size_t index, typename Use>
constexpr decltype(auto) withSegmentFrom(Precision precision, Use&& use) {
  using Segment = SegmentOf<std::variant_alternative_t<index, AnyLists>>;
  if constexpr (index + 1 < std::variant_size_v<AnyLists>) {
    if (precision != EncodingOf<Segment>::precision)
      return withSegmentFrom<index + 1>(precision, std::forward<Use>(use));
  }
  assert(precision == EncodingOf<Segment>::precision);
  return std::forward<Use>(use).template operator()<Segment>();
}

}  // namespace detail

/// Whether an encoding has that number.
constexpr bool isEncoding(std::uint32_t number) {
  return number < std::variant_size_v<AnyLists>;
}

/// Returns use.operator()<Segment>() for the type of that precision, as in `[]<typename Segment>() { ... }`.
template <typename Use>
constexpr decltype(auto) withSegment(Precision precision, Use&& use) {
  return detail::withSegmentFrom<0>(precision, std::forward<Use>(use));
}

/// Bytes of a supersegment in memory, on the device and between ranks.
constexpr std::size_t segmentBytes(Precision precision) {
  return withSegment(precision, []<typename Segment>() { return sizeof(Segment); });
}

constexpr bool hasDepthCode(Precision precision) {
  return withSegment(precision, []<typename Segment>() { return EncodingOf<Segment>::hasDepthCode; });
}

constexpr double typicalFileBytes(Precision precision) {
  return withSegment(precision, []<typename Segment>() { return EncodingOf<Segment>::typicalFileBytes; });
}

/// Bytes of a file's chunk with these numbers of lists and supersegments, before LZ4: the depth code if there
/// is one, lengths, columns.
constexpr std::uint64_t chunkBytes(std::uint64_t lists, std::uint64_t supersegments, Precision precision) {
  return withSegment(precision, [&]<typename Segment>() -> std::uint64_t {
    using Encoding = EncodingOf<Segment>;
    return (Encoding::hasDepthCode ? sizeof(DepthCode) : 0) + lists * sizeof(std::uint32_t) +
           supersegments * Encoding::chunkBytes;
  });
}

/// An empty ListsOf in that encoding.
inline AnyLists noLists(Precision precision) {
  return withSegment(precision, []<typename Segment>() { return AnyLists(ListsOf<Segment>()); });
}

}  // namespace vdi
