#include "vdi/gpu/KdTree.h"

#include <algorithm>
#include <utility>

#include "vdi/core/Error.h"

namespace vdi::gpu {

namespace {

using shared::Brick;

struct Plane {
  int axis = -1;
  float position = 0.0F;
};

/// Chooses the face whose fuller side has the fewest bricks; cut bricks cost extra.
Plane choosePlane(const std::vector<Brick>& bricks) {
  Plane best;
  std::size_t bestCost = static_cast<std::size_t>(-1);
  const std::size_t count = bricks.size();
  std::vector<float> lo(count);
  std::vector<float> hi(count);
  for (int axis = 0; axis < 3; ++axis) {
    for (std::size_t i = 0; i < count; ++i) {
      lo[i] = bricks[i].lo[axis];
      hi[i] = bricks[i].hi[axis];
    }
    std::sort(lo.begin(), lo.end());
    std::sort(hi.begin(), hi.end());
    for (const auto* faces : {&lo, &hi}) {
      for (const float position : *faces) {
        const auto below =
            static_cast<std::size_t>(std::lower_bound(lo.begin(), lo.end(), position) - lo.begin());
        const auto above =
            static_cast<std::size_t>(hi.end() - std::upper_bound(hi.begin(), hi.end(), position));
        if (below == count || above == count) continue;  // does not separate anything
        const std::size_t cut = below + above > count ? below + above - count : 0;
        const std::size_t cost = std::max(below, above) + cut;
        if (cost < bestCost) {
          bestCost = cost;
          best = {axis, position};
        }
      }
    }
  }
  return best;
}

class Builder {
 public:
  explicit Builder(KdTree& tree) : tree_(tree) {}

  void build(std::size_t node, std::vector<Brick> bricks, int depth) {
    if (bricks.size() <= 1) {
      tree_.nodes[node] = {0.0F, 3, static_cast<std::uint32_t>(tree_.bricks.size()),
                           static_cast<std::uint32_t>(bricks.size())};
      tree_.bricks.insert(tree_.bricks.end(), bricks.begin(), bricks.end());
      return;
    }
    const Plane plane = choosePlane(bricks);
    if (plane.axis < 0 || depth >= shared::kdMaxDepth) {
      throw Error(ErrorCode::InvalidArgument, "the owned boxes of two blocks overlap");
    }
    std::vector<Brick> below;
    std::vector<Brick> above;
    for (const Brick& brick : bricks) {
      if (brick.lo[plane.axis] < plane.position) {
        below.push_back(brick);
        below.back().hi[plane.axis] = std::min(brick.hi[plane.axis], plane.position);
      }
      if (brick.hi[plane.axis] > plane.position) {
        above.push_back(brick);
        above.back().lo[plane.axis] = std::max(brick.lo[plane.axis], plane.position);
      }
    }
    bricks = {};
    const std::size_t children = tree_.nodes.size();
    tree_.nodes.resize(children + 2);
    tree_.nodes[node] = {plane.position, static_cast<std::uint32_t>(plane.axis),
                         static_cast<std::uint32_t>(children), 0};
    build(children, std::move(below), depth + 1);
    build(children + 1, std::move(above), depth + 1);
  }

 private:
  KdTree& tree_;
};

}  // namespace

KdTree buildKdTree(std::vector<Brick> bricks) {
  KdTree tree;
  if (bricks.empty()) return tree;
  tree.nodes.resize(1);
  Builder(tree).build(0, std::move(bricks), 0);
  return tree;
}

}  // namespace vdi::gpu
