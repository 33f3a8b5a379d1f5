#include "vdi/core/Thinning.h"

#include <cassert>
#include <cmath>
#include <glm/trigonometric.hpp>
#include <span>
#include <variant>
#include <vector>

namespace vdi {

namespace {

/// `columns` and `rows` are indices of the lists to take, in [0, size), or -1 for an empty list.
template <typename Segment>
ListsOf<Segment> taken(const ListsOf<Segment>& lists, int width, const std::vector<int>& columns,
                       const std::vector<int>& rows) {
  ListsOf<Segment> few;
  few.offsets.assign(1, 0);
  few.offsets.reserve(columns.size() * rows.size() + 1);
  for (const int row : rows) {
    for (const int column : columns) {
      if (row >= 0 && column >= 0) {
        const std::span<const Segment> list =
            lists.list(static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
                       static_cast<std::size_t>(column));
        few.segments.insert(few.segments.end(), list.begin(), list.end());
      }
      few.offsets.push_back(static_cast<std::uint32_t>(few.segments.size()));
    }
  }
  return few;
}

/// Indices, among `many` lists along an axis, of those at the centres of `few`, which cover `share` as much.
std::vector<int> placesOf(int few, int many, double share) {
  std::vector<int> places(static_cast<std::size_t>(few));
  for (int i = 0; i < few; ++i) {
    const double at = 0.5 + ((i + 0.5) / few - 0.5) * share;
    const int place = static_cast<int>(std::floor(at * many));
    places[static_cast<std::size_t>(i)] = place >= 0 && place < many ? place : -1;
  }
  return places;
}

}  // namespace

Vdi thinned(const Vdi& vdi, int factor) {
  assert(factor >= 1);
  Vdi few;
  few.camera = vdi.camera;
  // The same height as all lists together.
  const double halfHeight = vdi.view().halfHeight();
  if (vdi.camera.parallelProjection) {
    few.camera.parallelScale = halfHeight;
  } else {
    few.camera.viewAngle = glm::degrees(2.0 * std::atan(halfHeight));
  }
  few.width = (vdi.width + factor - 1) / factor;
  few.height = (vdi.height + factor - 1) / factor;
  few.budget = vdi.budget;
  few.bounds = vdi.bounds;
  few.sampleStep = vdi.sampleStep;
  few.time = vdi.time;
  few.timeStep = vdi.timeStep;
  few.coloring = vdi.coloring;
  few.depthCode = vdi.depthCode;
  // Pixels are squares, so the width differs by rounding.
  const double share =
      (static_cast<double>(few.width) * vdi.height) / (static_cast<double>(few.height) * vdi.width);
  const std::vector<int> columns = placesOf(few.width, vdi.width, share);
  const std::vector<int> rows = placesOf(few.height, vdi.height, 1.0);
  std::visit([&](const auto& lists) { few.lists = taken(lists, vdi.width, columns, rows); }, vdi.lists);
  return few;
}

}  // namespace vdi
