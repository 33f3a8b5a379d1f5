#include "vdi/core/TransferFunction.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>

#include "vdi/core/Error.h"

namespace vdi {

namespace {

constexpr std::size_t smallestTable = 1024;
constexpr std::size_t largestTable = 16384;

/// Piecewise linear through nodes in ascending x; `valueOf` reads a node's value. Of two nodes at x, the
/// later one counts.
template <typename Node, typename ValueOf>
auto piecewiseLinear(const std::vector<Node>& nodes, double x, ValueOf valueOf) {
  assert(!nodes.empty());
  const auto above = std::upper_bound(nodes.begin(), nodes.end(), x,
                                      [](double value, const Node& node) { return value < node.x; });
  if (above == nodes.begin()) return valueOf(nodes.front());
  const auto below = std::prev(above);
  if (above == nodes.end()) return valueOf(*below);
  const double share = (x - below->x) / (above->x - below->x);
  return valueOf(*below) * (1.0 - share) + valueOf(*above) * share;
}

template <typename Node>
void validateNodes(const std::vector<Node>& nodes, const char* what) {
  if (nodes.empty()) throw Error(ErrorCode::InvalidArgument, fmt::format("the {} has no nodes", what));
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (!std::isfinite(nodes[i].x) || (i > 0 && nodes[i].x < nodes[i - 1].x)) {
      throw Error(ErrorCode::InvalidArgument,
                  fmt::format("the nodes of the {} must be finite and ascend; node {} is at {}", what, i,
                              nodes[i].x));
    }
  }
}

bool isShare(double value) {
  return value >= 0.0 && value <= 1.0;
}

float extinctionOf(double opacity) {
  if (opacity >= 1.0) return maxExtinction;
  return std::min(static_cast<float>(-std::log2(1.0 - opacity)), maxExtinction);
}

/// Smallest nonzero distance between two nodes.
template <typename Node>
double closestNodes(const std::vector<Node>& nodes, double soFar) {
  for (std::size_t i = 1; i < nodes.size(); ++i) {
    const double distance = nodes[i].x - nodes[i - 1].x;
    if (distance > 0.0) soFar = std::min(soFar, distance);
  }
  return soFar;
}

}  // namespace

glm::dvec3 TransferFunction::colorAt(double x) const {
  return piecewiseLinear(colors, x, [](const ColorNode& node) { return node.color; });
}

double TransferFunction::opacityAt(double x) const {
  return piecewiseLinear(opacities, x, [](const OpacityNode& node) { return node.opacity; });
}

void validate(const TransferFunction& transferFunction) {
  validateNodes(transferFunction.colors, "colour function");
  validateNodes(transferFunction.opacities, "opacity function");
  for (const ColorNode& node : transferFunction.colors) {
    if (!isShare(node.color.r) || !isShare(node.color.g) || !isShare(node.color.b)) {
      throw Error(ErrorCode::InvalidArgument, fmt::format("the colour at {} isn't in [0, 1]", node.x));
    }
  }
  for (const OpacityNode& node : transferFunction.opacities) {
    if (!isShare(node.opacity)) {
      throw Error(ErrorCode::InvalidArgument,
                  fmt::format("the opacity at {} is {}, not in [0, 1]", node.x, node.opacity));
    }
  }
  if (!(transferFunction.unitDistance > 0.0) || !std::isfinite(transferFunction.unitDistance)) {
    throw Error(ErrorCode::InvalidArgument, fmt::format("the opacity unit distance must be > 0, but is {}",
                                                        transferFunction.unitDistance));
  }
}

TransferTable bake(const TransferFunction& transferFunction) {
  validate(transferFunction);
  TransferTable table;
  table.unitDistance = transferFunction.unitDistance;
  table.min = std::min(transferFunction.colors.front().x, transferFunction.opacities.front().x);
  table.max = std::max(transferFunction.colors.back().x, transferFunction.opacities.back().x);
  if (!(table.max > table.min)) {
    // A single scalar. Two nodes there are a step, which lies between two neighbouring entries.
    const double half = std::max(std::abs(table.min), 1e-30) * 1e-6;
    table.min -= half;
    table.max += half;
  }
  const double range = table.max - table.min;
  const double closest =
      closestNodes(transferFunction.opacities, closestNodes(transferFunction.colors, range));
  std::size_t size = smallestTable;
  while (size < largestTable && closest * static_cast<double>(size - 1) < 2.0 * range) size *= 2;
  table.entries.resize(size);
  for (std::size_t i = 0; i < size; ++i) {
    const double x = table.min + range * static_cast<double>(i) / static_cast<double>(size - 1);
    const float extinction = extinctionOf(transferFunction.opacityAt(x));
    const glm::vec3 color = glm::vec3(transferFunction.colorAt(x)) * extinction;
    table.entries[i] = {color.r, color.g, color.b, extinction};
  }
  return table;
}

double TransferTable::positionOf(double scalar) const {
  assert(entries.size() >= 2 && max > min);
  constexpr double far = 1e30;  // the limit of tablePosition in shaders/raycast.glsl
  return std::clamp((scalar - min) / (max - min) * static_cast<double>(entries.size() - 1), -far, far);
}

TransferTableEntry TransferTable::at(double position) const {
  if (std::isnan(position)) return {};
  const double inside = std::clamp(position, 0.0, static_cast<double>(entries.size() - 1));
  const auto below = std::min(static_cast<std::size_t>(inside), entries.size() - 2);
  const glm::vec4 entry = glm::mix(entries[below].vector(), entries[below + 1].vector(),
                                   static_cast<float>(inside - static_cast<double>(below)));
  return {entry.r, entry.g, entry.b, entry.a};
}

glm::vec4 TransferTable::materialAt(double position) const {
  if (std::isnan(position)) return glm::vec4(0.0F);
  const double inside = std::clamp(position, 0.0, static_cast<double>(entries.size() - 1));
  const auto below = std::min(static_cast<std::size_t>(inside), entries.size() - 2);
  const auto materialOf = [](const TransferTableEntry& entry) {
    if (!(entry.extinction > 0.0F)) return glm::vec4(0.0F);
    const auto opacity = static_cast<float>(-std::expm1(-std::numbers::ln2 * entry.extinction));
    return glm::vec4(glm::vec3(entry.vector()) / entry.extinction * opacity, opacity);
  };
  return glm::mix(materialOf(entries[below]), materialOf(entries[below + 1]),
                  static_cast<float>(inside - static_cast<double>(below)));
}

bool TransferTable::visible(double lo, double hi) const {
  const double last = static_cast<double>(entries.size() - 1);
  const auto position = [&](double x) { return std::clamp((x - min) / (max - min) * last, 0.0, last); };
  const auto first = static_cast<std::size_t>(std::floor(position(lo)));
  const auto end = static_cast<std::size_t>(std::ceil(position(hi)));
  return std::any_of(entries.begin() + static_cast<std::ptrdiff_t>(first),
                     entries.begin() + static_cast<std::ptrdiff_t>(end) + 1,
                     [](const TransferTableEntry& entry) { return entry.extinction > 0.0F; });
}

}  // namespace vdi
