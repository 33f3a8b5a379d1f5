// How blocks become texels: which format, what of a block in which 3-D texture ("page"), and where there.
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

/// value = texel * scale + offset: for the normalised formats those of the type, for f32 1 and 0, for all
/// other types relative to the block's own range.
struct ValueMap {
  double scale = 1.0;
  double offset = 0.0;
  bool whole = false;                // values are whole numbers
  std::optional<ScalarRange> range;  // of finite values, where it had to be found
};
/// Throws Error{InvalidArgument} for values beyond limitsOf(type).most.
ValueMap valueMapOf(const Block& block);

/// A box of a block's values that fits one page.
struct VolumePiece {
  const Block* block = nullptr;
  glm::ivec3 first{0};  // index of its first value in the block; negative in a layer below the stored values
  glm::uvec3 dims{0};
  VkFormat format = VK_FORMAT_UNDEFINED;
  ValueMap values;
  std::uint32_t page = 0;
  glm::uvec3 place{0};                                                // in the page, texels
  IndexBox box() const { return {first, first + glm::ivec3(dims)}; }  // of the block's indices
  bool samePlaceAs(const VolumePiece& other) const { return dims == other.dims && format == other.format; }
};

/// Values of a piece beyond the samples that it serves, where the block was cut: gradients look a voxel
/// beyond the face (valueReach).
constexpr int pieceMargin = 1;

/// Pieces of the block, extra layers included, that fit a page each. They overlap, so that each interpolates
/// by itself.
std::vector<VolumePiece> cutToPieces(const Device& device, const Block& block);

struct PageShape {
  glm::uvec3 extent{0};
  VkFormat format = VK_FORMAT_UNDEFINED;
};
/// Fills in the pieces' pages and places. Throws Error{OutOfMemory} if that takes too many pages.
std::vector<PageShape> placeInPages(const Device& device, std::span<VolumePiece> pieces);

}  // namespace vdi::gpu
