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
constexpr std::size_t tableOfSteps = 4096;
constexpr std::size_t largestTable = 16384;

/// Piecewise linear through nodes in ascending x; `valueOf` reads a node's value. If two nodes have the
/// same x, the later one counts.
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

double extinctionOf(double opacity) {
  if (opacity >= 1.0) return maxExtinction;
  return std::min(-std::log2(1.0 - opacity), static_cast<double>(maxExtinction));
}

/// The nodes between which the function changes: it is constant before `first` and beyond `last`.
struct Changes {
  std::size_t first;
  std::size_t last;
};

template <typename Node, typename ValueOf>
Changes changesOf(const std::vector<Node>& nodes, ValueOf valueOf) {
  Changes changes{0, nodes.size() - 1};
  while (changes.first < changes.last && valueOf(nodes[changes.first]) == valueOf(nodes[changes.first + 1]))
    ++changes.first;
  while (changes.last > changes.first && valueOf(nodes[changes.last]) == valueOf(nodes[changes.last - 1]))
    --changes.last;
  return changes;
}

/// The scalars at which the nodes make steps.
template <typename Node>
void addSteps(const std::vector<Node>& nodes, const Changes& changes, std::vector<double>& steps) {
  for (std::size_t i = changes.first; i < changes.last; ++i) {
    if (nodes[i].x == nodes[i + 1].x) steps.push_back(nodes[i].x);
  }
}

/// Smallest nonzero distance between two nodes.
template <typename Node>
double closestNodes(const std::vector<Node>& nodes, const Changes& changes, double soFar) {
  for (std::size_t i = changes.first + 1; i <= changes.last; ++i) {
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

namespace {

/// Associated colour and extinction at a scalar.
glm::dvec4 entryAt(const TransferFunction& function, double x) {
  const double extinction = extinctionOf(function.opacityAt(x));
  return {function.colorAt(x) * extinction, extinction};
}

/// The mean of the function over [lo, hi], by Simpson's rule between nodes.
glm::dvec4 meanOver(const TransferFunction& function, const std::vector<double>& nodes, double lo,
                    double hi) {
  glm::dvec4 sum(0.0);
  double from = lo;
  const auto add = [&](double to) {
    // Takes the values just inside, because a step has a different value on each side.
    const double inset = 1e-9 * (to - from);
    const glm::dvec4 middle = entryAt(function, 0.5 * (from + to));
    sum +=
        (to - from) / 6.0 * (entryAt(function, from + inset) + 4.0 * middle + entryAt(function, to - inset));
    from = to;
  };
  for (auto node = std::upper_bound(nodes.begin(), nodes.end(), lo); node != nodes.end() && *node < hi;
       ++node)
    if (*node > from) add(*node);
  add(hi);
  return sum / (hi - lo);
}

TransferTableEntry stored(const glm::vec4& entry) {
  return {entry.r, entry.g, entry.b, entry.a};
}

/// The scalar of an entry.
double scalarOf(const TransferTable& table, std::size_t entry) {
  return table.min +
         (table.max - table.min) * static_cast<double>(entry) / static_cast<double>(table.entries.size() - 1);
}

/// The distance between two entries.
double entrySpacing(const TransferTable& table) {
  return (table.max - table.min) / static_cast<double>(table.entries.size() - 1);
}

/// If two nodes have the same scalar, the later one counts. The table's ramp for a step must end at or before
/// the step, so the entry before the step gets the value behind it.
void fillFine(const TransferFunction& function, const std::vector<double>& steps, TransferTable& table) {
  for (std::size_t i = 0; i < table.entries.size(); ++i) {
    double x = scalarOf(table, i);
    const auto step = std::upper_bound(steps.begin(), steps.end(), x);
    if (step != steps.end() && *step < x + entrySpacing(table)) x = *step;
    table.entries[i] = stored(entryAt(function, x));
  }
}

/// A feature narrower than an entry contributes its mean, so no ray misses it.
void fillCoarse(const TransferFunction& function, TransferTable& table) {
  std::vector<double> nodes;
  for (const ColorNode& node : function.colors) nodes.push_back(node.x);
  for (const OpacityNode& node : function.opacities) nodes.push_back(node.x);
  std::sort(nodes.begin(), nodes.end());
  const double reach = 0.5 * entrySpacing(table);
  for (std::size_t i = 0; i < table.entries.size(); ++i) {
    const double x = scalarOf(table, i);
    const double lo = std::max(x - reach, table.min);
    table.entries[i] = stored(meanOver(function, nodes, lo, std::min(x + reach, table.max)));
  }
}

}  // namespace

TransferTable bake(const TransferFunction& transferFunction) {
  validate(transferFunction);
  const auto& [colors, opacities, unitDistance] = transferFunction;
  const Changes hues = changesOf(colors, [](const ColorNode& node) { return node.color; });
  const Changes opaque = changesOf(opacities, [](const OpacityNode& node) { return node.opacity; });
  TransferTable table;
  table.unitDistance = unitDistance;
  table.min = std::min(colors.front().x, opacities.front().x);
  table.max = std::max(colors.back().x, opacities.back().x);
  const double closest =
      closestNodes(opacities, opaque, closestNodes(colors, hues, std::numeric_limits<double>::infinity()));
  const auto resolves = [&](std::size_t size) {
    return closest * static_cast<double>(size - 1) >= 2.0 * (table.max - table.min);
  };
  if (!resolves(largestTable)) {
    // Leaves out the ends at which the function is constant or transparent.
    table.min = opacities[opaque.first].x;
    table.max = opacities[opaque.last].x;
    if (opacities.front().opacity > 0.0) table.min = std::min(table.min, colors[hues.first].x);
    if (opacities.back().opacity > 0.0) table.max = std::max(table.max, colors[hues.last].x);
  }
  std::vector<double> steps;
  addSteps(colors, hues, steps);
  addSteps(opacities, opaque, steps);
  std::sort(steps.begin(), steps.end());
  if (!(table.max > table.min)) {
    // The function has nodes at a single scalar, with a step or without. The table is made much wider than
    // the rounding errors of floats.
    const double half = std::max(std::abs(table.min), 1e-30) * 1e-3;
    table.min -= half;
    table.max += half;
  } else if (std::binary_search(steps.begin(), steps.end(), table.min)) {
    table.min -= 4.0 / smallestTable * (table.max - table.min);  // the first entry lies in front of the step
  }
  std::size_t size = steps.empty() ? smallestTable : tableOfSteps;
  while (size < largestTable && !resolves(size)) size *= 2;
  table.entries.resize(size);
  if (resolves(size)) {
    fillFine(transferFunction, steps, table);
  } else {
    fillCoarse(transferFunction, table);
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
