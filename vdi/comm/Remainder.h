// The rest of a box from which other boxes are subtracted.
#pragma once

#include <cstdint>
#include <vector>

#include "vdi/core/Box.h"

namespace vdi::comm {

/// A tree of the parts that each step has cut, so a step looks at the parts that it meets and at few others.
class Remainder {
 public:
  explicit Remainder(const Box& whole) { nodes_.push_back({whole, 0, 0, 0}); }

  bool empty() const { return nodes_.front().bounds.empty(); }

  /// Subtracts `hole`. Calls visit(common) for its intersection with each part, in the order in which
  /// `without` yields parts of parts.
  template <typename Visit>
  void subtract(const Box& hole, Visit visit) {
    pending_.assign(1, 0);
    while (!pending_.empty()) {
      const std::uint32_t at = pending_.back();
      pending_.pop_back();
      const Node& node = nodes_[at];
      if (node.parts > 0) {
        for (std::uint32_t i = node.first + node.parts; i > node.first; --i) {
          if (meet(nodes_[i - 1].bounds, hole)) pending_.push_back(i - 1);
        }
        continue;
      }
      const Box common = node.bounds.intersection(hole);
      if (common.empty()) continue;
      visit(common);
      cut(at, hole);
    }
  }

 private:
  struct Node {
    Box bounds;  // bounds of the parts that are left
    std::uint32_t parent;
    std::uint32_t first;  // first of its parts, which are adjacent
    std::uint32_t parts;  // 0: not cut yet, or nothing was left
  };

  static bool meet(const Box& a, const Box& b) {
    return a.lo.x < b.hi.x && b.lo.x < a.hi.x && a.lo.y < b.hi.y && b.lo.y < a.hi.y && a.lo.z < b.hi.z &&
           b.lo.z < a.hi.z;
  }

  void cut(std::uint32_t at, const Box& hole) {
    const auto first = static_cast<std::uint32_t>(nodes_.size());
    const Box whole = nodes_[at].bounds;
    forEachPartWithout(whole, hole, [&](const Box& part) { nodes_.push_back({part, at, 0, 0}); });
    nodes_[at].first = first;
    nodes_[at].parts = static_cast<std::uint32_t>(nodes_.size()) - first;
    while (true) {
      Node& node = nodes_[at];
      Box left;
      for (std::uint32_t i = node.first; i < node.first + node.parts; ++i) left.include(nodes_[i].bounds);
      if (left == node.bounds) break;
      node.bounds = left;
      if (at == 0) break;
      at = node.parent;
    }
  }

  std::vector<Node> nodes_;  // the whole box first
  std::vector<std::uint32_t> pending_;
};

}  // namespace vdi::comm
