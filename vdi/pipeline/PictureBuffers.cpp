#include "vdi/pipeline/PictureBuffers.h"

#include <cassert>

#include "vdi/core/Parallel.h"

namespace vdi::detail {

using gpu::MemoryKind;

void PictureBuffers::reserve(const std::shared_ptr<gpu::Device>& device, std::uint64_t pixels,
                             std::uint64_t colorBytes) {
  pixels_ = pixels;
  colorBytes_ = pixels * colorBytes;
  colors_.reserve(device, colorBytes_, MemoryKind::DeviceLocal);
  depths_.reserve(device, pixels * sizeof(float), MemoryKind::DeviceLocal);
  readback_.reserve(device, colorBytes_ + pixels * sizeof(float), MemoryKind::Readback);
}

void PictureBuffers::recordDownload(gpu::Commands& commands) const {
  commands.barrier();
  commands.mark("download");
  commands.copy(colors_, 0, readback_, 0, colorBytes_);
  commands.copy(depths_, 0, readback_, colorBytes_, pixels_ * sizeof(float));
}

void PictureBuffers::copyTo(Image& image, std::size_t first) const {
  assert(colorBytes_ == pixels_ * sizeof(glm::vec4));
  replaceTail(image.rgba, first, readback_.mappedAs<const glm::vec4>().first(pixels_));
  replaceTail(image.depth, first, readback_.mappedAs<const float>().subspan(pixels_ * 4, pixels_));
}

ImageBytes PictureBuffers::bytes(int width, int height) const {
  assert(colorBytes_ == pixels_ * sizeof(glm::u8vec4));
  return {width, height, readback_.mappedAs<const glm::u8vec4>().first(pixels_),
          readback_.mappedAs<const float>().subspan(pixels_, pixels_)};
}

}  // namespace vdi::detail
