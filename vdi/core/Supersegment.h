// Supersegments and lists of them, in two precisions (paper, sections 2.4 and 4).
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "vdi/core/HostVector.h"

namespace vdi {

struct DepthLattice;

/// How a VDI's supersegments are held, sent between ranks and written to files.
enum class Precision : std::uint32_t {
  Full = 0,     // Supersegment: 24 bytes of floats
  Compact = 1,  // CompactSupersegment: 8 bytes; seen from V_O within 1/255 of the floats
};

const char* toString(Precision precision);  // "full", "compact"
/// Throws Error{InvalidArgument} that lists the names there are.
Precision precisionFromString(const std::string& name);

/// One depth interval of a list. The colour is premultiplied and accumulated over the whole interval, and so
/// is the opacity. A part of length l' of an interval of length l has opacity a' = 1 - (1 - a)^(l'/l), colour
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

/// The same in 8 bytes. Depths are codes of a DepthCode; the colour is straight, 8 bits a channel; the
/// optical depth has 12 bits, see opticalDepthOfCode. Whoever encodes a list carries what rounding a
/// supersegment changed over to the next one (reference/Compaction.h), so that errors don't add up along the
/// list.
struct CompactSupersegment {
  std::uint32_t depths = 0;    // bits 0 - 13 front, 14 - 27 back, 28 - 31 the optical depth's low bits
  std::uint32_t material = 0;  // bits 0 - 7 red, 8 - 15 green, 16 - 23 blue, 24 - 31 its high bits

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

/// Code c stands for the depth first + c * step, computed in single precision.
struct DepthCode {
  static constexpr std::uint32_t largest = 16383;
  float first = 0.0F;
  float step = 0.0F;  // > 0; 0: there is none, as in a VDI of full precision
  float depthOf(std::uint32_t code) const { return first + static_cast<float>(code) * step; }
  bool operator==(const DepthCode&) const = default;
};

/// Of the lists that a depth code belongs to.
inline Precision precisionOf(const DepthCode& code) {
  return code.step > 0.0F ? Precision::Compact : Precision::Full;
}

/// The code for what lies on the lattice: step is a part of a sample, so that the lattice's depths have codes
/// of their own. None (step 0) for a lattice of more samples than fit, 8190.
DepthCode depthCodeFor(const DepthLattice& lattice);

/// Optical depth of codes 0 .. 4095: 2^-20, and from there on (2^(code * 16 / 4095) - 1) / 16, that is, in
/// steps of 0.00017 where material is thin and of 0.3 % where it's dense, up to 4096.
float opticalDepthOfCode(std::uint32_t code);
/// Of what has that optical depth.
float opacityOfCode(std::uint32_t code);

/// 1 - 2^-opticalDepth, exact for small arguments too.
float opacityOf(float opticalDepth);
/// Its inverse, at most maxExtinction (core/TransferFunction.h).
float opticalDepthOf(float opacity);

Supersegment expanded(const CompactSupersegment& segment, const DepthCode& code);

/// Compact lists: list i is segments[offsets[i] .. offsets[i + 1]), front to back, disjoint.
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

}  // namespace vdi
