// Colours and depths of pixels on the device, and their download to the host. Not part of the library's
// interface.
#pragma once

#include <cstdint>
#include <memory>

#include "vdi/core/Image.h"
#include "vdi/gpu/Commands.h"
#include "vdi/gpu/Memory.h"

namespace vdi::detail {

class PictureBuffers {
 public:
  /// `colorBytes` is the size of a pixel's colour: a glm::vec4 or a glm::u8vec4.
  void reserve(const std::shared_ptr<gpu::Device>& device, std::uint64_t pixels,
               std::uint64_t colorBytes = sizeof(glm::vec4));

  std::uint64_t colors() const { return colors_.address(); }
  std::uint64_t depths() const { return depths_.address(); }  // float each

  /// Call after recording the commands that write the pixels; a stage named "download".
  void recordDownload(gpu::Commands& commands) const;
  /// Call after the download: copies the pixels (a glm::vec4 each) into the image, from pixel `first` on.
  void copyTo(Image& image, std::size_t first) const;
  /// Call after the download: the pixels, a glm::u8vec4 each; they stay until the next reserve or download.
  ImageBytes bytes(int width, int height) const;

 private:
  std::uint64_t pixels_ = 0;
  std::uint64_t colorBytes_ = 0;  // bytes of all pixels' colours
  gpu::Buffer colors_;
  gpu::Buffer depths_;
  gpu::Buffer readback_;  // colours, then depths
};

}  // namespace vdi::detail
