#include "vdi/pipeline/PictureBuffers.h"

#include "vdi/core/Parallel.h"

namespace vdi::detail {

using gpu::MemoryKind;

void PictureBuffers::reserve(const std::shared_ptr<gpu::Device>& device, std::uint64_t pixels) {
  pixels_ = pixels;
  colors_.reserve(device, pixels * sizeof(glm::vec4), MemoryKind::DeviceLocal);
  depths_.reserve(device, pixels * sizeof(float), MemoryKind::DeviceLocal);
  readback_.reserve(device, pixels * (sizeof(glm::vec4) + sizeof(float)), MemoryKind::Readback);
}

void PictureBuffers::recordDownload(gpu::Commands& commands) const {
  const std::uint64_t colorBytes = pixels_ * sizeof(glm::vec4);
  commands.barrier();
  commands.mark("download");
  commands.copy(colors_, 0, readback_, 0, colorBytes);
  commands.copy(depths_, 0, readback_, colorBytes, pixels_ * sizeof(float));
}

void PictureBuffers::copyTo(Image& image, std::size_t first) const {
  replaceTail<glm::vec4>(image.rgba, first, readback_.mappedAs<glm::vec4>().first(pixels_));
  replaceTail<float>(image.depth, first, readback_.mappedAs<float>().subspan(pixels_ * 4, pixels_));
}

}  // namespace vdi::detail
