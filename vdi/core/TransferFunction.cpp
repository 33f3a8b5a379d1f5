#include "vdi/core/TransferFunction.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>

#include "vdi/core/Error.h"

namespace vdi {

namespace {

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

}  // namespace vdi
