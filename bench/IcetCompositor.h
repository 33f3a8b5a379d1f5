// IceT behind an interface of ours: whole pictures of ranks whose volumes are convex become one.
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
  /// Whether the tool was built with IceT. If it wasn't, no compositor can be made.
  static bool available();

  /// `handle`: MPI_Comm_c2f of the ranks' communicator; a duplicate is taken. Collective. Throws
  /// Error{InvalidArgument} if there is no IceT.
  explicit IcetCompositor(int handle);
  ~IcetCompositor();
  IcetCompositor(const IcetCompositor&) = delete;
  IcetCompositor& operator=(const IcetCompositor&) = delete;

  /// Blends the ranks' pictures, all of one size, in the order of `frontToBack`, which has every rank once.
  /// Pixels outside `drawn` are taken for transparent. Returns the whole picture on rank 0, premultiplied,
  /// row 0 at the bottom, which is valid until the next call; on the others nothing. Collective. Throws
  /// Error{Communication} for what IceT complains of, on that rank alone.
  std::span<const glm::vec4> composite(const Image& image, const PixelBox& drawn,
                                       const std::vector<int>& frontToBack);
  /// By this rank in the last composite, as IceT counts it.
  std::uint64_t bytesSent() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace vdi::bench
