// Replaces IcetCompositor.cpp in a tool built without IceT.
#include "bench/IcetCompositor.h"
#include "vdi/core/Error.h"

namespace vdi::bench {

struct IcetCompositor::State {};

bool IcetCompositor::available() {
  return false;
}

IcetCompositor::IcetCompositor(int) {
  throw Error(ErrorCode::InvalidArgument, "this tool was built without IceT");
}
IcetCompositor::~IcetCompositor() = default;

std::span<const glm::vec4> IcetCompositor::composite(const Image&, const PixelBox&, const std::vector<int>&) {
  return {};
}

std::uint64_t IcetCompositor::bytesSent() const {
  return 0;
}

}  // namespace vdi::bench
