// Supersegments and lists of them, in two precisions (paper, sections 2.4 and 4).
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "vdi/core/HostVector.h"

namespace vdi {

struct DepthLattice;

/// The precision in which a VDI's supersegments are stored, sent between ranks and written to files.
enum class Precision : std::uint32_t {
  Full = 0,     // Supersegment: 24 bytes of floats
  Compact = 1,  // CompactSupersegment: 8 bytes; from V_O within 1/255 of the floats for colours up to 1
};

const char* toString(Precision precision);  // "full", "compact"
/// Throws Error{InvalidArgument} that lists the valid names.
Precision precisionFromString(const std::string& name);

/// One depth interval of a list. Colour (premultiplied) and opacity are accumulated over the whole interval.
/// A part of length l' of an interval of length l has opacity a' = 1 - (1 - a)^(l'/l), and its colour is
/// scaled by a'/a.
struct Supersegment {
  float front = 0.0F;  // view-space depth of V_O, world units
  float back = 0.0F;   // > front
  float red = 0.0F;
  float green = 0.0F;
  float blue = 0.0F;
  float opacity = 0.0F;  // in (0, 1]
  bool operator==(const Supersegment&) const = default;
};
static_assert(sizeof(Supersegment) == 24);

/// A supersegment in 8 bytes. Depths are codes of a DepthCode; the colour is straight, 8 bits a channel; the
/// optical depth has 12 bits, see opticalDepthOfCode. The encoder of a list carries each supersegment's
/// rounding error over to the next one, so errors do not add up along the list.
struct CompactSupersegment {
  std::uint32_t depths = 0;    // bits 0 - 13 front, 14 - 27 back, 28 - 31 low bits of the optical depth
  std::uint32_t material = 0;  // bits 0 - 7 red, 8 - 15 green, 16 - 23 blue, 24 - 31 its remaining bits

  static CompactSupersegment pack(std::uint32_t front, std::uint32_t back, std::uint32_t red,
                                  std::uint32_t green, std::uint32_t blue, std::uint32_t opticalDepth) {
    return {front | back << 14 | (opticalDepth & 0xfU) << 28,
            red | green << 8 | blue << 16 | (opticalDepth >> 4) << 24};
  }
  std::uint32_t front() const { return depths & 0x3fffU; }
  std::uint32_t back() const { return (depths >> 14) & 0x3fffU; }
  std::uint32_t color(int channel) const { return (material >> (8 * channel)) & 0xffU; }  // red, green, blue
  std::uint32_t opticalDepth() const { return depths >> 28 | (material >> 24) << 4; }
  bool operator==(const CompactSupersegment&) const = default;
};
static_assert(sizeof(CompactSupersegment) == 8);

/// Code c means the depth first + c * step, computed in single precision. Compact lists have a depth code.
/// For lists of full precision, there is none: all members are 0.
struct DepthCode {
  static constexpr std::uint32_t largest = 16383;
  float first = 0.0F;
  float step = 0.0F;  // > 0 where there is a code
  bool exists() const { return step > 0.0F; }
  float depthOf(std::uint32_t code) const { return first + static_cast<float>(code) * step; }
  bool operator==(const DepthCode&) const = default;
};

/// The form of a VDI's lists in memory.
struct ListForm {
  Precision precision = Precision::Full;
  DepthCode code;  // none if the precision has none
};

/// The code for depths on the lattice. Its step divides a sample, so the lattice's depths have codes of their
/// own. A lattice without samples, or of more than 8190, has no code.
DepthCode depthCodeFor(const DepthLattice& lattice);

/// Optical depth of codes 0 .. 4095: 2^-20 for code 0, then (2^(code * 16 / 4095) - 1) / 16. Steps are
/// 0.00017 where material is thin and 0.3 % where it is dense, up to 4096.
float opticalDepthOfCode(std::uint32_t code);
/// Opacity of the optical depth of a code.
float opacityOfCode(std::uint32_t code);

/// 1 - 2^-opticalDepth, exact for small arguments too.
float opacityOf(float opticalDepth);
/// The inverse of opacityOf, at most maxExtinction (core/TransferFunction.h).
float opticalDepthOf(float opacity);

Supersegment expanded(const CompactSupersegment& segment, const DepthCode& code);
/// The supersegment itself, so that callers need not tell the precisions apart.
inline const Supersegment& expanded(const Supersegment& segment, const DepthCode& /*code*/) {
  return segment;
}

/// Lists without gaps: list i is segments[offsets[i] .. offsets[i + 1]), front to back, disjoint.
template <typename Segment>
struct ListsOf {
  HostVector<std::uint32_t> offsets{0};  // exclusive prefix sum, listCount() + 1 entries
  HostVector<Segment> segments;

  std::size_t listCount() const { return offsets.size() - 1; }
  std::uint32_t countOf(std::size_t list) const { return offsets[list + 1] - offsets[list]; }
  std::span<const Segment> list(std::size_t i) const {
    return std::span(segments).subspan(offsets[i], countOf(i));
  }
  bool operator==(const ListsOf&) const = default;
};
using SupersegmentLists = ListsOf<Supersegment>;
using CompactLists = ListsOf<CompactSupersegment>;

SupersegmentLists expanded(const CompactLists& lists, const DepthCode& code);
inline const SupersegmentLists& expanded(const SupersegmentLists& lists, const DepthCode& /*code*/) {
  return lists;
}

}  // namespace vdi
