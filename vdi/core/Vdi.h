// Supersegments, lists and the VDI itself (paper, sections 2.4 and 4).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "vdi/core/Box.h"
#include "vdi/core/Camera.h"

namespace vdi {

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

/// Compact lists: list i is segments[offsets[i] .. offsets[i + 1]), front to back, disjoint.
struct SupersegmentLists {
  std::vector<std::uint32_t> offsets{0};  // exclusive prefix sum, listCount() + 1 entries
  std::vector<Supersegment> segments;

  std::size_t listCount() const { return offsets.size() - 1; }
  std::uint32_t countOf(std::size_t list) const { return offsets[list + 1] - offsets[list]; }
  std::span<const Supersegment> list(std::size_t i) const {
    return std::span(segments).subspan(offsets[i], countOf(i));
  }
  bool operator==(const SupersegmentLists&) const = default;
};

/// A whole VDI with everything that is needed to render it. List (x, y) has the index y * width + x, row 0 at
/// the bottom.
struct Vdi {
  Camera camera;  // V_O
  int width = 0;
  int height = 0;
  std::uint32_t budget = 0;  // N_S
  Box bounds;                // of the scene, world
  double sampleStep = 0.0;   // depth interval of one sample (DepthLattice::step)
  double time = 0.0;         // simulation time, 0 when unknown
  std::uint64_t timeStep = 0;
  SupersegmentLists lists;  // width * height lists

  View view() const { return {camera, width, height}; }
  bool operator==(const Vdi&) const = default;
};

/// Throws Error{Format} unless: the offsets ascend from 0 to segments.size(), there are width * height lists,
/// each list holds at most `budget` supersegments with finite values, 0 <= front < back, ascending and
/// disjoint, opacity in (0, 1].
void validate(const Vdi& vdi);

}  // namespace vdi
