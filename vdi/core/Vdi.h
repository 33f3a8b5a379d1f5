// The VDI itself (paper, sections 2.4 and 4).
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <variant>
#include <vector>

#include "vdi/core/Box.h"
#include "vdi/core/Camera.h"
#include "vdi/core/Coloring.h"
#include "vdi/core/Supersegment.h"

namespace vdi {

/// A whole VDI with everything that is needed to render it. List (x, y) has the index y * width + x, row 0 at
/// the bottom.
struct Vdi {
  Camera camera;  // V_O
  int width = 0;  // of all lists
  int height = 0;
  /// Lists beyond the picture that the camera frames: on its left and on its right, below and above it. They
  /// are as far apart as the picture's.
  glm::ivec2 margin{0};
  std::uint32_t budget = 0;  // the most that a list may hold: N_S, or maxPerList
  Box bounds;                // of the scene, world
  double sampleStep = 0.0;   // depth interval of one sample (DepthLattice::step)
  double time = 0.0;         // simulation time, 0 when unknown
  std::uint64_t timeStep = 0;
  std::optional<Coloring> coloring;                     // what its colours mean, when that is known
  DepthCode depthCode;                                  // of compact lists; all 0 otherwise
  std::variant<SupersegmentLists, CompactLists> lists;  // width * height lists

  /// Of the picture that was asked for: the lists but for the margin's.
  glm::ivec2 pictureSize() const { return glm::ivec2(width, height) - 2 * margin; }
  /// Of all lists.
  View view() const { return View::withMargin(camera, pictureSize().x, pictureSize().y, margin); }
  Precision precision() const {
    return std::holds_alternative<CompactLists>(lists) ? Precision::Compact : Precision::Full;
  }
  const HostVector<std::uint32_t>& offsets() const {  // exclusive prefix sum, a list more than there are
    return std::visit([](const auto& l) -> const HostVector<std::uint32_t>& { return l.offsets; }, lists);
  }
  std::size_t listCount() const { return offsets().size() - 1; }
  std::size_t supersegmentCount() const {
    return std::visit([](const auto& l) { return l.segments.size(); }, lists);
  }
  /// Of all lists, as floats whatever the precision is: index in [0, supersegmentCount()).
  Supersegment supersegment(std::size_t index) const;
  /// All lists as floats; a copy.
  SupersegmentLists expandedLists() const;
  bool operator==(const Vdi&) const = default;
};

/// Throws Error{Format} unless: the margin leaves a picture, the offsets ascend from 0 to the number of
/// supersegments, there are width * height lists, each list holds at most `budget` supersegments with finite
/// values, 0 <= front < back, ascending and disjoint, opacity in (0, 1]; and compact lists have a depth code
/// with positive step.
void validate(const Vdi& vdi);
/// Of this, what the VDI is without its lists: size, precision and depth code.
void validateShape(const Vdi& vdi);
/// That there are width * height lists, and just the supersegments that they say in all.
void validateEnds(const Vdi& vdi);
/// And what is said of lists [first, last) alone, each of at most `budget` supersegments. Messages name
/// the first of them `firstList`.
template <typename Segment>
void validateLists(const ListsOf<Segment>& lists, std::size_t first, std::size_t last,
                   std::uint64_t firstList, std::uint32_t budget);

}  // namespace vdi
