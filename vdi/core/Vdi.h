// The VDI itself (paper, sections 2.4 and 4). All headers use these terms:
//   * the paper: A. Gupta et al., Parallel Compositing of Volumetric Depth Images for Interactive
//     Visualization of Distributed Volumes at High Frame Rates, EGPGV 2023;
//   * V_O: the original viewpoint, from which a VDI is made; V_N: any other, from which it is rendered;
//   * list: the supersegments of one pixel of V_O, front to back;
//   * N_S: GenerateSettings::supersegments, by which Budget bounds the supersegments of lists.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <variant>
#include <vector>

#include "vdi/core/Box.h"
#include "vdi/core/Camera.h"
#include "vdi/core/Coloring.h"
#include "vdi/core/Encoding.h"
#include "vdi/core/Supersegment.h"

namespace vdi {

/// A whole VDI with everything that rendering needs. List (x, y) has the index y * width + x, row 0 at the
/// bottom.
struct Vdi {
  Camera camera;  // V_O
  int width = 0;  // columns of lists, the margin included
  int height = 0;
  /// Lists beyond the picture that the camera frames, on its left and right (x), below and above it (y). They
  /// have the picture's spacing.
  glm::ivec2 margin{0};
  std::uint32_t budget = 0;  // the most that a list may hold: N_S, or maxPerList
  Box bounds;                // world; the scene's box, cropped if the settings' region has a box
  double sampleStep = 0.0;   // depth interval of one sample (DepthLattice::step), world units
  double time = 0.0;         // simulation time, 0 when unknown
  std::uint64_t timeStep = 0;
  std::optional<Coloring> coloring;  // meaning of the colours, if known
  DepthCode depthCode;               // code of compact lists; none otherwise
  AnyLists lists;                    // width * height lists

  /// Size of the requested picture: all lists but the margin's.
  glm::ivec2 pictureSize() const { return glm::ivec2(width, height) - 2 * margin; }
  /// The view of all lists.
  View view() const { return View::withMargin(camera, pictureSize().x, pictureSize().y, margin); }
  Precision precision() const { return static_cast<Precision>(lists.index()); }
  ListForm form() const { return {precision(), depthCode}; }
  const HostVector<std::uint32_t>& offsets() const {  // exclusive prefix sum, [listCount() + 1]
    return std::visit([](const auto& l) -> const HostVector<std::uint32_t>& { return l.offsets; }, lists);
  }
  std::size_t listCount() const { return offsets().size() - 1; }
  std::size_t supersegmentCount() const {
    return std::visit([](const auto& l) { return l.segments.size(); }, lists);
  }
  /// A supersegment as floats, in any precision; index in [0, supersegmentCount()).
  Supersegment supersegment(std::size_t index) const;
  /// All lists as floats; a copy.
  SupersegmentLists expandedLists() const;
  bool operator==(const Vdi&) const = default;
};

/// Throws Error{Format} unless: the margin leaves a picture; the offsets ascend from 0 to the number of
/// supersegments; there are width * height lists; each list has at most `budget` supersegments with finite
/// values, 0 <= front < back, ascending and disjoint, opacity in (0, 1]; and compact lists have a depth code
/// with positive step.
void validate(const Vdi& vdi);
/// Checks everything but the lists: size, precision and depth code. This and the next two throw
/// Error{Format}, too.
void validateShape(const Vdi& vdi);
/// Checks that there are width * height lists, and that the number of supersegments matches their offsets.
void validateEnds(const Vdi& vdi);
/// Checks only lists [first, last), each of at most `budget` supersegments. Messages number them from
/// `firstList` on.
template <typename Segment>
void validateLists(const ListsOf<Segment>& lists, std::size_t first, std::size_t last,
                   std::uint64_t firstList, std::uint32_t budget);

}  // namespace vdi
