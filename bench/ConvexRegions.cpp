#include "bench/ConvexRegions.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <utility>

namespace vdi::bench {

namespace {

void cutBetween(const IndexBox& box, int parts, std::vector<IndexBox>& leaves) {
  if (parts == 1) {
    leaves.push_back(box.empty() ? IndexBox{} : box);
    return;
  }
  const glm::ivec3 size = box.hi - box.lo;
  int longest = 2;
  for (const int axis : {1, 0}) {
    if (size[axis] > size[longest]) longest = axis;
  }
  const int below = parts / 2;
  const int cut =
      box.lo[longest] + static_cast<int>(static_cast<std::int64_t>(size[longest]) * below / parts);
  IndexBox lower = box;
  IndexBox upper = box;
  lower.hi[longest] = cut;
  upper.lo[longest] = cut;
  cutBetween(lower, below, leaves);
  cutBetween(upper, parts - below, leaves);
}

}  // namespace

std::optional<SeparatingPlanes> SeparatingPlanes::between(std::span<const Box> boxes, double tolerance) {
  SeparatingPlanes planes;
  Node root;
  std::vector<int> none;
  for (std::size_t i = 0; i < boxes.size(); ++i)
    (boxes[i].empty() ? none : root.boxes).push_back(static_cast<int>(i));
  planes.nodes_.push_back(std::move(root));
  if (!planes.split(0, boxes, tolerance)) return std::nullopt;
  // Empty boxes fit any leaf. The first leaf takes them.
  for (Node& node : planes.nodes_) {
    if (node.lower != 0) continue;
    node.boxes.insert(node.boxes.end(), none.begin(), none.end());
    break;
  }
  return planes;
}

/// A plane separates boxes, sorted by their lower faces, before each box that begins beyond the
/// ends of all earlier ones. Chooses the plane closest to the middle.
bool SeparatingPlanes::split(std::size_t node, std::span<const Box> boxes, double tolerance) {
  std::vector<int> mine = std::move(nodes_[node].boxes);
  nodes_[node].boxes.clear();
  if (mine.size() <= 1) {
    nodes_[node].boxes = std::move(mine);
    return true;
  }
  const auto boxOf = [&](int index) -> const Box& { return boxes[static_cast<std::size_t>(index)]; };
  for (int axis = 0; axis < 3; ++axis) {
    std::sort(mine.begin(), mine.end(), [&](int a, int b) { return boxOf(a).lo[axis] < boxOf(b).lo[axis]; });
    double end = -std::numeric_limits<double>::infinity();
    std::size_t best = 0;
    const auto offMiddle = [&](std::size_t i) {
      return i > mine.size() - i ? 2 * i - mine.size() : mine.size() - 2 * i;
    };
    for (std::size_t i = 1; i < mine.size(); ++i) {
      end = std::max(end, boxOf(mine[i - 1]).hi[axis]);
      if (boxOf(mine[i]).lo[axis] < end - tolerance) continue;
      if (best == 0 || offMiddle(i) < offMiddle(best)) best = i;
    }
    if (best == 0) continue;
    const auto cut = mine.begin() + static_cast<std::ptrdiff_t>(best);
    Node lower;
    Node upper;
    lower.boxes.assign(mine.begin(), cut);
    upper.boxes.assign(cut, mine.end());
    nodes_[node].axis = axis;
    nodes_[node].at = boxOf(*cut).lo[axis];
    nodes_[node].lower = nodes_.size();
    nodes_[node].upper = nodes_.size() + 1;
    nodes_.push_back(std::move(lower));
    nodes_.push_back(std::move(upper));
    return split(nodes_[node].lower, boxes, tolerance) && split(nodes_[node].upper, boxes, tolerance);
  }
  return false;
}

std::vector<int> SeparatingPlanes::frontToBack(const Camera& camera) const {
  const glm::dvec3 along = camera.focalPoint - camera.position;
  std::vector<int> order;
  std::vector<std::size_t> waiting{0};
  while (!waiting.empty()) {
    const Node& node = nodes_[waiting.back()];
    waiting.pop_back();
    if (node.lower == 0) {
      order.insert(order.end(), node.boxes.begin(), node.boxes.end());
      continue;
    }
    const bool lowerFirst =
        camera.parallelProjection ? along[node.axis] >= 0.0 : camera.position[node.axis] < node.at;
    waiting.push_back(lowerFirst ? node.upper : node.lower);
    waiting.push_back(lowerFirst ? node.lower : node.upper);
  }
  return order;
}

std::vector<IndexBox> kdCuts(const glm::ivec3& size, int parts) {
  std::vector<IndexBox> leaves;
  cutBetween({glm::ivec3(0), size}, parts, leaves);
  return leaves;
}

}  // namespace vdi::bench
