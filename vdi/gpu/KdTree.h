// The kd-tree that gives the order in which rays meet bricks. This code runs on the host, without Vulkan.
#pragma once

#include <vector>

#include "shaders/shared/volume.h"

namespace vdi::gpu {

struct KdTree {
  std::vector<shared::KdNode> nodes;  // empty when there are no bricks
  std::vector<shared::Brick> bricks;  // one per leaf; a brick that a plane had to cut appears once per part
};

/// Splits space by faces of bricks until every leaf holds at most one brick, cutting as few bricks as it can.
/// Disjoint boxes can always be separated this way; throws Error{InvalidArgument} if two overlap.
KdTree buildKdTree(std::vector<shared::Brick> bricks);

}  // namespace vdi::gpu
