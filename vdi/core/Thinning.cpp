#include "vdi/core/Thinning.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <glm/trigonometric.hpp>
#include <span>
#include <utility>
#include <variant>
#include <vector>

#include "vdi/core/Parallel.h"

namespace vdi {

namespace {

template <typename Segment>
ListsOf<Segment> taken(const ListsOf<Segment>& lists, const std::vector<std::uint32_t>& sources) {
  constexpr std::size_t listsPerThread = 1 << 14;
  ListsOf<Segment> few;
  few.offsets.reserve(sources.size() + 1);
  std::uint32_t end = 0;
  for (const std::uint32_t source : sources) {
    if (source != Thinning::noList) end += lists.countOf(source);
    few.offsets.push_back(end);
  }
  few.segments.resize(end);
  inParallel(sources.size(), listsPerThread, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      if (sources[i] == Thinning::noList) continue;
      const std::span<const Segment> list = lists.list(sources[i]);
      std::copy(list.begin(), list.end(), few.segments.begin() + few.offsets[i]);
    }
  });
  return few;
}

/// Indices of the lists, among `many` along an axis, in which the centres of `few` lists lie. The few cover
/// `share` times the extent of the many; a centre outside all of these gets -1.
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

Thinning thinningOf(const Vdi& vdi, int factor) {
  assert(factor >= 1);
  Thinning thinning;
  Vdi& few = thinning.few;
  few.camera = vdi.camera;
  // The thinned picture has the same height as all lists together.
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
  thinning.sources.reserve(columns.size() * rows.size());
  for (const int row : rows) {
    for (const int column : columns) {
      const bool isInside = row >= 0 && column >= 0;
      thinning.sources.push_back(isInside ? static_cast<std::uint32_t>(row * vdi.width + column)
                                          : Thinning::noList);
    }
  }
  return thinning;
}

Vdi thinned(const Vdi& vdi, int factor) {
  Thinning thinning = thinningOf(vdi, factor);
  std::visit([&](const auto& lists) { thinning.few.lists = taken(lists, thinning.sources); }, vdi.lists);
  return std::move(thinning.few);
}

}  // namespace vdi
