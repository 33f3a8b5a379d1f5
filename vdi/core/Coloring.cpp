#include "vdi/core/Coloring.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "vdi/core/ComponentValues.h"
#include "vdi/core/Error.h"

namespace vdi {

namespace {

constexpr std::size_t mostNodes = 4096;

double difference(const ColorNode& a, const ColorNode& b) {
  const glm::dvec3 apart = glm::abs(a.color - b.color);
  return std::max({apart.r, apart.g, apart.b});
}
double difference(const OpacityNode& a, const OpacityNode& b) {
  return std::abs(a.opacity - b.opacity);
}

ColorNode between(const ColorNode& a, const ColorNode& b, double share) {
  return {0.0, glm::mix(a.color, b.color, share)};
}
OpacityNode between(const OpacityNode& a, const OpacityNode& b, double share) {
  return {0.0, glm::mix(a.opacity, b.opacity, share)};
}

/// A small set of nodes from which linear interpolation gives all others to within `tolerance`, by the
/// algorithm of Ramer, Douglas and Peucker with errors measured in values.
template <typename Node>
std::vector<Node> withFewer(const std::vector<Node>& nodes, double tolerance) {
  if (nodes.size() < 3) return nodes;
  std::vector<bool> kept(nodes.size(), false);
  kept.front() = kept.back() = true;
  std::vector<std::pair<std::size_t, std::size_t>> open{{0, nodes.size() - 1}};
  while (!open.empty()) {
    const auto [first, last] = open.back();
    open.pop_back();
    const double length = nodes[last].x - nodes[first].x;
    std::size_t worst = first;
    double largest = tolerance;
    for (std::size_t i = first + 1; i < last; ++i) {
      const double share = length > 0.0 ? (nodes[i].x - nodes[first].x) / length : 0.0;
      const double error = difference(nodes[i], between(nodes[first], nodes[last], share));
      if (error <= largest) continue;
      largest = error;
      worst = i;
    }
    if (worst == first) continue;
    kept[worst] = true;
    open.emplace_back(first, worst);
    open.emplace_back(worst, last);
  }
  std::vector<Node> few;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (kept[i]) few.push_back(nodes[i]);
  }
  return few;
}

template <typename Node>
std::vector<Node> withAtMost(const std::vector<Node>& nodes, double tolerance) {
  std::vector<Node> few = withFewer(nodes, tolerance);
  for (; few.size() > mostNodes && tolerance < 1.0; tolerance *= 2.0) few = withFewer(nodes, 2.0 * tolerance);
  if (few.size() > mostNodes) few.resize(mostNodes);  // these are nodes at one place, of which only two count
  return few;
}

[[noreturn]] void failColoring(const std::string& what) {
  throw Error(ErrorCode::Format, "invalid coloring: " + what);
}

}  // namespace

void validate(const Coloring& coloring) {
  const ScalarArray& array = coloring.array;
  if (array.components < 1 || array.component < phase || array.component >= array.components ||
      (array.component == phase && array.components != 2))
    failColoring(fmt::format("component {} of {}", array.component, array.components));
  const auto [low, high] = coloring.range;
  if (low <= high ? !std::isfinite(low) || !std::isfinite(high) : coloring.range != ScalarRange())
    failColoring(fmt::format("a range from {} to {}", low, high));
  try {
    validate(coloring.function);
  } catch (const Error& error) {
    failColoring(error.what());
  }
}

TransferFunction simplified(const TransferFunction& function) {
  constexpr double colorTolerance = 1.0 / 512.0 - 1e-5;
  constexpr double opacityTolerance = 1e-6;
  TransferFunction simple{.colors = withAtMost(function.colors, colorTolerance),
                          .opacities = withAtMost(function.opacities, opacityTolerance),
                          .unitDistance = function.unitDistance};
  constexpr double decimals = 1e5;
  for (ColorNode& node : simple.colors) node.color = glm::round(node.color * decimals) / decimals;
  return simple;
}

}  // namespace vdi
