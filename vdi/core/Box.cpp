#include "vdi/core/Box.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <utility>

namespace vdi {

void subtract(std::vector<IndexBox>& boxes, const IndexBox& hole) {
  const auto meets = [&hole](const IndexBox& box) { return !box.intersection(hole).empty(); };
  if (std::none_of(boxes.begin(), boxes.end(), meets)) return;
  std::vector<IndexBox> rest;
  for (const IndexBox& box : boxes)
    forEachPartWithout(box, hole, [&rest](const IndexBox& part) { rest.push_back(part); });
  boxes = std::move(rest);
}

std::vector<IndexBox> coverWithBoxes(const glm::ivec3& size, std::vector<bool> open) {
  const IndexBox all{glm::ivec3(0), size};
  assert(open.size() == all.count());
  const auto forEach = [&](const IndexBox& box, auto visit) {
    for (int z = box.lo.z; z < box.hi.z; ++z) {
      for (int y = box.lo.y; y < box.hi.y; ++y) {
        const std::size_t row = all.position({0, y, z});
        for (int x = box.lo.x; x < box.hi.x; ++x) {
          if (!visit(row + static_cast<std::size_t>(x))) return false;
        }
      }
    }
    return true;
  };
  const auto allOpen = [&](const IndexBox& box) {
    return forEach(box, [&](std::size_t i) -> bool { return open[i]; });
  };
  std::vector<IndexBox> boxes;
  for (int z = 0; z < size.z; ++z) {
    for (int y = 0; y < size.y; ++y) {
      for (int x = 0; x < size.x; ++x) {
        if (!open[all.position({x, y, z})]) continue;
        IndexBox box{{x, y, z}, {x + 1, y + 1, z + 1}};
        for (int axis = 0; axis < 3; ++axis) {
          while (box.hi[axis] < size[axis]) {
            IndexBox next = box;
            next.lo[axis] = box.hi[axis];
            next.hi[axis] = box.hi[axis] + 1;
            if (!allOpen(next)) break;
            box.hi[axis] = next.hi[axis];
          }
        }
        forEach(box, [&](std::size_t i) {
          open[i] = false;
          return true;
        });
        boxes.push_back(box);
      }
    }
  }
  return boxes;
}

namespace {

/// Limit on the cells of one lattice. Faces of holes cut the box into cells, each wholly in or out of the
/// holes.
constexpr std::size_t maxCells = std::size_t{1} << 22;

std::vector<Box> cut(const Box& box, const std::vector<Box>& holes) {
  std::array<std::vector<double>, 3> faces;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double>& own = faces[static_cast<std::size_t>(axis)];
    own = {box.lo[axis], box.hi[axis]};
    for (const Box& hole : holes) {
      for (const double face : {hole.lo[axis], hole.hi[axis]}) {
        if (face > box.lo[axis] && face < box.hi[axis]) own.push_back(face);
      }
    }
    std::sort(own.begin(), own.end());
    own.erase(std::unique(own.begin(), own.end()), own.end());
  }
  const IndexBox all{glm::ivec3(0),
                     glm::ivec3(faces[0].size() - 1, faces[1].size() - 1, faces[2].size() - 1)};
  const auto largest = std::max_element(faces.begin(), faces.end(),
                                        [](const auto& a, const auto& b) { return a.size() < b.size(); });
  if (all.count() > maxCells) {  // too many for one lattice: two halves
    const auto axis = static_cast<int>(largest - faces.begin());
    std::vector<Box> parts;
    for (const bool upper : {false, true}) {
      Box half = box;
      (upper ? half.lo : half.hi)[axis] = (*largest)[largest->size() / 2];
      const std::vector<Box> more = withoutAll(half, holes);
      parts.insert(parts.end(), more.begin(), more.end());
    }
    return parts;
  }
  std::vector<bool> open(all.count(), true);
  for (const Box& hole : holes) {
    IndexBox covered;
    for (int axis = 0; axis < 3; ++axis) {
      const std::vector<double>& own = faces[static_cast<std::size_t>(axis)];
      const auto indexOf = [&](double face) {
        return static_cast<int>(std::lower_bound(own.begin(), own.end(), face) - own.begin());
      };
      covered.lo[axis] = indexOf(hole.lo[axis]);
      covered.hi[axis] = std::min(indexOf(hole.hi[axis]), all.hi[axis]);
    }
    for (int z = covered.lo.z; z < covered.hi.z; ++z) {
      for (int y = covered.lo.y; y < covered.hi.y; ++y) {
        for (int x = covered.lo.x; x < covered.hi.x; ++x) open[all.position({x, y, z})] = false;
      }
    }
  }
  std::vector<Box> parts;
  for (const IndexBox& cells : coverWithBoxes(all.hi, std::move(open))) {
    Box part;
    for (int axis = 0; axis < 3; ++axis) {
      const std::vector<double>& own = faces[static_cast<std::size_t>(axis)];
      part.lo[axis] = own[static_cast<std::size_t>(cells.lo[axis])];
      part.hi[axis] = own[static_cast<std::size_t>(cells.hi[axis])];
    }
    parts.push_back(part);
  }
  return parts;
}

}  // namespace

std::vector<Box> withoutAll(const Box& box, const std::vector<Box>& holes) {
  if (box.empty()) return {};
  std::vector<Box> near;
  for (const Box& hole : holes) {
    const Box common = box.intersection(hole);
    if (!common.empty()) near.push_back(common);
  }
  if (near.empty()) return {box};
  return cut(box, near);
}

}  // namespace vdi
