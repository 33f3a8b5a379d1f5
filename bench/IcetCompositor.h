// Wraps IceT, which composites whole pictures of ranks with convex volumes.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <vector>

#include "vdi/core/Image.h"

namespace vdi::bench {

/// Pixels [first, first + size) of a picture.
struct PixelBox {
  glm::ivec2 first{0};
  glm::ivec2 size{0};
};

class IcetCompositor {
 public:
  /// Whether the tool was built with IceT. Without IceT the constructor throws.
  static bool available();

  /// `handle` is MPI_Comm_c2f of the ranks' communicator. Duplicates the communicator. Collective.
  /// Throws Error{InvalidArgument} without IceT.
  explicit IcetCompositor(int handle);
  ~IcetCompositor();
  IcetCompositor(const IcetCompositor&) = delete;
  IcetCompositor& operator=(const IcetCompositor&) = delete;

  /// Blends the ranks' pictures, all of one size, in the order of `frontToBack`, which contains
  /// each rank once. Pixels outside `drawn` count as transparent. Rank 0 gets the whole picture,
  /// premultiplied, row 0 at the bottom, valid until the next call. Other ranks get nothing.
  /// Collective. Throws Error{Communication} for IceT's errors, only on the failing rank.
  std::span<const glm::vec4> composite(const Image& image, const PixelBox& drawn,
                                       const std::vector<int>& frontToBack);
  /// Bytes that this rank sent in the last composite, as IceT counts them.
  std::uint64_t bytesSent() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace vdi::bench
