#include "bench/IcetCompositor.h"

#include <IceT.h>
#include <IceTMPI.h>
#include <fmt/format.h>
#include <mpi.h>

#include <array>
#include <cassert>

#include "vdi/core/Error.h"

namespace vdi::bench {

struct IcetCompositor::State {
  explicit State(int handle) : communicator(icetCreateMPICommunicator(MPI_Comm_f2c(handle))) {
    context = icetCreateContext(communicator);
    icetDestroyMPICommunicator(communicator);  // the context keeps a duplicate
  }
  ~State() { icetDestroyContext(context); }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  IceTCommunicator communicator;
  IceTContext context = nullptr;
  IceTInt bytesSent = 0;
};

bool IcetCompositor::available() {
  return true;
}

IcetCompositor::IcetCompositor(int handle) : state_(std::make_unique<State>(handle)) {}
IcetCompositor::~IcetCompositor() = default;

std::span<const glm::vec4> IcetCompositor::composite(const Image& image, const PixelBox& drawn,
                                                     const std::vector<int>& frontToBack) {
  static_assert(sizeof(glm::vec4) == 4 * sizeof(IceTFloat));
  icetSetContext(state_->context);
  icetDiagnostics(ICET_DIAG_OFF);  // stops IceT from printing; the code below queries errors
  icetResetTiles();
  icetAddTile(0, 0, image.width, image.height, 0);
  icetSetColorFormat(ICET_IMAGE_COLOR_RGBA_FLOAT);
  icetSetDepthFormat(ICET_IMAGE_DEPTH_NONE);
  icetCompositeMode(ICET_COMPOSITE_MODE_BLEND);
  icetStrategy(ICET_STRATEGY_SEQUENTIAL);
  icetSingleImageStrategy(ICET_SINGLE_IMAGE_STRATEGY_AUTOMATIC);
  icetEnable(ICET_ORDERED_COMPOSITE);
  icetEnable(ICET_COLLECT_IMAGES);
  const std::vector<IceTInt> order(frontToBack.begin(), frontToBack.end());
  icetCompositeOrder(order.data());
  const std::array<IceTInt, 4> viewport{drawn.first.x, drawn.first.y, drawn.size.x, drawn.size.y};
  const std::array<IceTFloat, 4> background{0.0F, 0.0F, 0.0F, 0.0F};
  const IceTImage result =
      icetCompositeImage(image.rgba.data(), nullptr, viewport.data(), nullptr, nullptr, background.data());
  icetGetIntegerv(ICET_BYTES_SENT, &state_->bytesSent);
  if (const IceTEnum error = icetGetError(); error != ICET_NO_ERROR)
    throw Error(ErrorCode::Communication, fmt::format("IceT failed with code {:#x}", error));
  IceTInt rank = 0;
  icetGetIntegerv(ICET_RANK, &rank);
  if (rank != 0) return {};
  const auto* colors = reinterpret_cast<const glm::vec4*>(icetImageGetColorcf(result));
  return {colors, image.pixelCount()};
}

std::uint64_t IcetCompositor::bytesSent() const {
  assert(state_->bytesSent >= 0);
  return static_cast<std::uint64_t>(state_->bytesSent);
}

}  // namespace vdi::bench
