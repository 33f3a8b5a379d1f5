// Loops over the indices of a box, x fastest. Not part of the library's interface.
#pragma once

#include <glm/glm.hpp>

#include "vdi/core/Box.h"

namespace vdi::comm {

/// Calls `visit(at)` for the first index of each row.
template <typename Visit>
void forEachRow(const IndexBox& box, Visit visit) {
  for (int z = box.lo.z; z < box.hi.z; ++z) {
    for (int y = box.lo.y; y < box.hi.y; ++y) visit(glm::ivec3(box.lo.x, y, z));
  }
}

/// Calls `visit(at)` for each index.
template <typename Visit>
void forEachIndex(const IndexBox& box, Visit visit) {
  forEachRow(box, [&](glm::ivec3 at) {
    for (; at.x < box.hi.x; ++at.x) visit(at);
  });
}

}  // namespace vdi::comm
