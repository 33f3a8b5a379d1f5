// The texels of blocks: their format, and each piece's place in a 3-D texture ("page").
#pragma once

#include <vulkan/vulkan.h>

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <vector>

#include "vdi/core/Block.h"
#include "vdi/gpu/Device.h"

namespace vdi::gpu {

class SampledImage;

/// value = texel * scale + offset. Normalised formats have the type's scale and offset, f32 has 1 and 0, and
/// all other types are relative to the block's own range.
struct ValueMap {
  double scale = 1.0;
  double offset = 0.0;
  bool whole = false;                  // values are integers
  std::optional<FiniteRanges> ranges;  // ranges of values, if they had to be computed
};
/// `own` are the own values of all blocks that share this one's. Throws Error{InvalidArgument} for values
/// beyond limitsOf(type).maximum.
ValueMap valueMapOf(const Block& block, std::span<const IndexBox> own);

/// Number of elements.
inline std::uint64_t volumeOf(const glm::uvec3& extent) {
  return static_cast<std::uint64_t>(extent.x) * extent.y * extent.z;
}

/// A box of a block's values that fits one page.
struct VolumePiece {
  const Block* block = nullptr;
  glm::ivec3 first{0};  // index of its first value in the block; negative in a layer before the stored values
  glm::uvec3 dims{0};
  VkFormat format = VK_FORMAT_UNDEFINED;
  ValueMap values;
  std::uint32_t page = 0;
  glm::uvec3 place{0};         // in the page, texels
  std::uint32_t firstOwn = 0;  // the piece's boxes of own texels
  std::uint32_t ownCount = 0;
  IndexBox box() const { return {first, first + glm::ivec3(dims)}; }  // in the block's indices
  bool samePlaceAs(const VolumePiece& other) const { return dims == other.dims && format == other.format; }
};

/// Layers of values around the samples that a piece serves, where the block was cut: gradients read one voxel
/// beyond the face (valueReach).
constexpr int pieceMargin = 1;

/// Cuts the block, extra layers included, into pieces that each fit a page. They overlap, so that each can
/// interpolate without the others.
std::vector<VolumePiece> cutToPieces(const Device& device, const Block& block, std::span<const IndexBox> own);

struct PageShape {
  glm::uvec3 extent{0};
  VkFormat format = VK_FORMAT_UNDEFINED;
};
/// Sets the pieces' pages and places. Throws Error{OutOfMemory} if there would be too many pages.
std::vector<PageShape> placeInPages(const Device& device, std::span<VolumePiece> pieces);

/// The images to bind as a shader's pages, castMaxPages of them: the last page again in place of missing
/// ones. There is at least one page.
std::vector<const SampledImage*> imagesOf(std::span<const SampledImage> pages);

}  // namespace vdi::gpu
