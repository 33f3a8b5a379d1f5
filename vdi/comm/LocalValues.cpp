#include "vdi/comm/LocalValues.h"

#include <algorithm>
#include <numeric>
#include <span>

namespace vdi::comm {

namespace {

/// Converts values of a row whose element [0] has index `first`. Branches on the type once a row.
void convert(ScalarType type, const void* row, int first, std::span<const int> indices, double* to) {
  withTyped(type, row, [&](const auto* from) {
    for (const int index : indices) *to++ = static_cast<double>(from[index - first]);
  });
}

}  // namespace

/// Takes the values that lie in `box`. rowAt(at, end) returns a row's values from `at` to before x = `end`.
template <typename RowAt>
void LocalValues::take(ScalarType type, const IndexBox& box, const Indices& indices, RowAt rowAt) {
  std::array<std::size_t, 3> first{};
  std::array<std::size_t, 3> last{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::vector<int>& own = indices[axis];
    const auto numberOf = [&own](int index) {
      return static_cast<std::size_t>(std::lower_bound(own.begin(), own.end(), index) - own.begin());
    };
    first[axis] = numberOf(box.lo[static_cast<int>(axis)]);
    last[axis] = numberOf(box.hi[static_cast<int>(axis)]);
    if (first[axis] >= last[axis]) return;
  }
  const std::span<const int> x = std::span(indices[0]).subspan(first[0], last[0] - first[0]);
  for (std::size_t z = first[2]; z < last[2]; ++z) {
    for (std::size_t y = first[1]; y < last[1]; ++y) {
      const void* row = rowAt(glm::ivec3(x.front(), indices[1][y], indices[2][z]), x.back() + 1);
      const std::size_t to = (z * indices[1].size() + y) * indices[0].size() + first[0];
      convert(type, row, x.front(), x, values_.data() + to);
    }
  }
}

void LocalValues::gather(const Block& block, const Indices& indices) {
  values_.resize(indices[0].size() * indices[1].size() * indices[2].size());
  const auto takeArray = [&](const IndexBox& box, const void* array) {
    const auto* const bytes = static_cast<const std::byte*>(array);
    take(block.type, box, indices,
         [&](const glm::ivec3& at, int) { return bytes + box.position(at) * sizeOf(block.type); });
  };
  if (block.isPacked()) {
    takeArray(block.stored(), block.data);
  } else {
    takeCopies(block.type, block, block.stored(), glm::ivec3(0), indices);
  }
  for (const Patch& patch : block.patchList()) {
    if (patch.values) {
      takeArray(patch.box, patch.values.get());
    } else {
      takeCopies(block.type, *patch.donor, patch.box, patch.shift, indices);
    }
  }
}

/// Takes values of `from` for `box`, whose indices plus `shift` are those of `from`.
void LocalValues::takeCopies(ScalarType type, const Block& from, const IndexBox& box, const glm::ivec3& shift,
                             const Indices& indices) {
  row_.resize(static_cast<std::size_t>(box.size().x));
  take(type, box, indices, [&](const glm::ivec3& at, int end) -> const void* {
    from.copyTo({at + shift, glm::ivec3(end, at.y + 1, at.z + 1) + shift}, row_.data());
    return row_.data();
  });
}

void LocalValues::gather(const Block& block, const IndexBox& box) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    range_[axis].resize(static_cast<std::size_t>(box.size()[static_cast<int>(axis)]));
    std::iota(range_[axis].begin(), range_[axis].end(), box.lo[static_cast<int>(axis)]);
  }
  gather(block, range_);
}

}  // namespace vdi::comm
