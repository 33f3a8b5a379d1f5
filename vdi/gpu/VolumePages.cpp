#include "vdi/gpu/VolumePages.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

#include "shaders/shared/cast.h"
#include "vdi/core/Error.h"
#include "vdi/gpu/Memory.h"

namespace vdi::gpu {

namespace {

/// Places boxes of one format into pages: rows of boxes along x, rows side by side along y, layers on top of
/// each other along z. Boxes come in descending order of height, so blocks of one shape, the usual case,
/// waste almost nothing.
class Packer {
 public:
  Packer(std::uint32_t side, std::uint32_t maxDepth, std::uint64_t maxTexels)
      : side_(side), maxDepth_(maxDepth), maxTexels_(maxTexels) {}

  /// Returns false if the page is full.
  bool place(const glm::uvec3& dims, glm::uvec3& at) {
    if (cursor_.x + dims.x > side_) {
      cursor_ = {0, cursor_.y + rowHeight_, cursor_.z};
      rowHeight_ = 0;
    }
    if (cursor_.y + dims.y > side_) {
      cursor_ = {0, 0, cursor_.z + layerDepth_};
      rowHeight_ = 0;
      layerDepth_ = 0;
    }
    // A page is only as large as its contents, which may be narrower than `side`.
    const glm::uvec3 used = glm::max(used_, cursor_ + dims);
    if (used.z > maxDepth_ || volumeOf(used) > maxTexels_) return false;
    at = cursor_;
    cursor_.x += dims.x;
    rowHeight_ = std::max(rowHeight_, dims.y);
    layerDepth_ = std::max(layerDepth_, dims.z);
    used_ = used;
    return true;
  }
  const glm::uvec3& used() const { return used_; }

 private:
  std::uint32_t side_;
  std::uint32_t maxDepth_;
  std::uint64_t maxTexels_;
  glm::uvec3 cursor_{0};
  std::uint32_t rowHeight_ = 0;
  std::uint32_t layerDepth_ = 0;
  glm::uvec3 used_{0};
};

VkFormat formatOf(const Device& device, ScalarType type) {
  switch (sizeOf(type)) {
    case 1:
      return device.isCpu() ? VK_FORMAT_R16_UNORM : VK_FORMAT_R8_UNORM;
    case 2:
      return VK_FORMAT_R16_UNORM;
    default:
      return VK_FORMAT_R32_SFLOAT;
  }
}

}  // namespace

ValueMap valueMapOf(const Block& block, std::span<const IndexBox> own) {
  switch (block.type) {
    case ScalarType::U8:
      return {255.0, 0.0, true, {}};
    case ScalarType::I8:
      return {255.0, -128.0, true, {}};
    case ScalarType::U16:
      return {65535.0, 0.0, true, {}};
    case ScalarType::I16:
      return {65535.0, -32768.0, true, {}};
    case ScalarType::F32:
      return {};
    case ScalarType::U32:
    case ScalarType::I32:
    case ScalarType::F64:
      break;
  }
  const FiniteRanges ranges = finiteRanges(block, own);
  const ScalarRange& range = ranges.used;
  const double maximum = limitsOf(block.type).maximum;
  if (range.min < -maximum || range.max > maximum) {
    throw Error(
        ErrorCode::InvalidArgument,
        fmt::format("a block of {} has values from {} to {}; magnitudes beyond {} can't be shown: name fill "
                    "values as missing, or mark them as NaN",
                    toString(block.type), range.min, range.max, maximum));
  }
  if (!(range.min < range.max)) return {1.0, std::isfinite(range.min) ? range.min : 0.0, false, ranges};
  // Texels are relative to 0, or to the value nearest to 0: floats resolve small values best, and a large
  // negative fill value leaves the others unchanged.
  const double offset = std::clamp(0.0, range.min, range.max);
  return {std::max(range.max - offset, offset - range.min), offset, false, ranges};
}

std::vector<VolumePiece> cutToPieces(const Device& device, const Block& block,
                                     std::span<const IndexBox> own) {
  const VkFormat format = formatOf(device, block.type);
  const std::uint64_t maxTexels = device.limits().maxAllocationBytes / texelBytes(format) / 2;
  const IndexBox all = block.extended();
  glm::uvec3 largest = glm::min(glm::uvec3(all.size()), glm::uvec3(device.limits().maxImageDimension3D));
  while (volumeOf(largest) > maxTexels) {
    const int axis = largest.z >= largest.x && largest.z >= largest.y ? 2 : largest.y >= largest.x ? 1 : 0;
    largest[axis] = (largest[axis] + 1) / 2;
  }
  const ValueMap values = valueMapOf(block, own);
  std::vector<VolumePiece> pieces;
  // Neighbours share a face's values and one layer on either side of it.
  const glm::ivec3 stride = glm::max(glm::ivec3(largest) - 1 - 2 * pieceMargin, glm::ivec3(1));
  const auto next = [&](int at, int axis) {
    return at + static_cast<int>(largest[axis]) < all.hi[axis] ? at + stride[axis] : all.hi[axis];
  };
  for (int z = all.lo.z; z < all.hi.z; z = next(z, 2)) {
    for (int y = all.lo.y; y < all.hi.y; y = next(y, 1)) {
      for (int x = all.lo.x; x < all.hi.x; x = next(x, 0)) {
        const glm::ivec3 first{x, y, z};
        const glm::uvec3 dims = glm::min(largest, glm::uvec3(all.hi - first));
        pieces.push_back({&block, first, dims, format, values, 0, {}});
      }
    }
  }
  return pieces;
}

std::vector<PageShape> placeInPages(const Device& device, std::span<VolumePiece> pieces) {
  std::vector<PageShape> pages;
  std::vector<std::size_t> order(pieces.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    const auto key = [&](std::size_t i) {
      return std::tuple(pieces[i].format, ~pieces[i].dims.z, ~pieces[i].dims.y, ~pieces[i].dims.x);
    };
    return key(a) < key(b);
  });
  for (std::size_t begin = 0; begin < order.size();) {
    const VkFormat format = pieces[order[begin]].format;
    std::size_t end = begin;
    std::uint64_t texels = 0;
    std::uint32_t widest = 1;
    for (; end < order.size() && pieces[order[end]].format == format; ++end) {
      const glm::uvec3& dims = pieces[order[end]].dims;
      texels += volumeOf(dims);
      widest = std::max({widest, dims.x, dims.y});
    }
    const auto cube = static_cast<std::uint32_t>(std::ceil(std::cbrt(static_cast<double>(texels))));
    const std::uint32_t side = std::min((std::max(cube, widest) + widest - 1) / widest * widest,
                                        device.limits().maxImageDimension3D);
    const std::uint64_t maxTexels = device.limits().maxAllocationBytes / texelBytes(format);
    while (begin < end) {
      Packer packer(side, device.limits().maxImageDimension3D, maxTexels);
      const std::size_t pageBegin = begin;
      while (begin < end && packer.place(pieces[order[begin]].dims, pieces[order[begin]].place)) {
        pieces[order[begin]].page = static_cast<std::uint32_t>(pages.size());
        ++begin;
      }
      if (begin == pageBegin || pages.size() == shared::castMaxPages) {
        throw Error(ErrorCode::OutOfMemory,
                    fmt::format("{} MiB of volume don't fit {} textures", texels * texelBytes(format) >> 20,
                                shared::castMaxPages),
                    device.name());
      }
      pages.push_back({packer.used(), format});
    }
  }
  return pages;
}

std::vector<const SampledImage*> imagesOf(std::span<const SampledImage> pages) {
  std::vector<const SampledImage*> images;
  for (std::size_t i = 0; i < shared::castMaxPages; ++i)
    images.push_back(&pages[std::min(i, pages.size() - 1)]);
  return images;
}

}  // namespace vdi::gpu
