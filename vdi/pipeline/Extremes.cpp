#include "vdi/pipeline/Extremes.h"

#include <cassert>

#include "vdi/core/BitCast.h"
#include "vdi/core/Parallel.h"

namespace vdi::detail {

namespace {

/// The inverse of orderedBits in shaders/blending.glsl.
float valueOf(std::uint32_t orderedBits) {
  constexpr std::uint32_t sign = 0x80000000U;
  return bit_cast<float>((orderedBits & sign) != 0 ? orderedBits & ~sign : ~orderedBits);
}

}  // namespace

void colorExtremes(std::span<const std::uint64_t> keys, BlendMode mode, const TransferTable& table,
                   Image& image) {
  assert(keys.size() == image.rgba.size() && keys.size() == image.depth.size());
  constexpr std::size_t pixelsPerThread = 10000;
  inParallel(keys.size(), pixelsPerThread, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      glm::vec4 color(0.0F);
      if (keys[i] != 0) {
        const float extreme = valueOf(static_cast<std::uint32_t>(keys[i] >> 32U));
        color = table.materialAt(mode == BlendMode::Minimum ? -extreme : extreme);
      }
      image.rgba[i] = color;
      image.depth[i] =
          color.a > 0.0F ? valueOf(~static_cast<std::uint32_t>(keys[i] & 0xffffffffU)) : Image::noDepth;
    }
  });
}

}  // namespace vdi::detail
