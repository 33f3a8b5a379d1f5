// Colours and depths of pixels on the device, and their way to the host. Not part of the library's interface.
#pragma once

#include <cstdint>
#include <memory>

#include "vdi/core/Image.h"
#include "vdi/gpu/Commands.h"
#include "vdi/gpu/Memory.h"

namespace vdi::detail {

class PictureBuffers {
 public:
  /// `colorBytes`: of a pixel, those of a glm::vec4 or of a glm::u8vec4.
  void reserve(const std::shared_ptr<gpu::Device>& device, std::uint64_t pixels,
               std::uint64_t colorBytes = sizeof(glm::vec4));

  std::uint64_t colors() const { return colors_.address(); }
  std::uint64_t depths() const { return depths_.address(); }  // float each

  /// Behind what writes them; a stage named "download".
  void recordDownload(gpu::Commands& commands) const;
  /// After that has run: makes them (a glm::vec4 each) the image's pixels from the first-th on.
  void copyTo(Image& image, std::size_t first) const;
  /// After that has run: the pixels, a glm::u8vec4 each; they stay until the next reserve or download.
  ImageBytes bytes(int width, int height) const;

 private:
  std::uint64_t pixels_ = 0;
  std::uint64_t colorBytes_ = 0;  // of all of them
  gpu::Buffer colors_;
  gpu::Buffer depths_;
  gpu::Buffer readback_;  // colours, then depths
};

}  // namespace vdi::detail
