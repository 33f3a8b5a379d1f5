#include "vdi/stream/Frame.h"

#include <utility>

#include "vdi/core/Thinning.h"
#include "vdi/io/VdiFile.h"

namespace vdi::stream {

namespace {

std::size_t bytesInMemory(const Vdi& vdi) {
  const std::size_t each =
      vdi.precision() == Precision::Compact ? sizeof(CompactSupersegment) : sizeof(Supersegment);
  return vdi.supersegmentCount() * each + vdi.listCount() * sizeof(std::uint32_t);
}

}  // namespace

void encodeFrame(const Vdi& vdi, std::uint32_t id, Clock::time_point made,
                 std::optional<std::vector<std::byte>> file, const std::function<void(FramePtr)>& take) {
  Frame frame{id, vdi.timeStep, vdi.time, made, bytesInMemory(vdi) < smallBytes ? 1U : 2U, {}};
  if (frame.levelCount > 1) {
    const Vdi coarse = thinned(vdi, coarseFactor);
    frame.levels.push_back(
        std::make_shared<EncodedLevel>(EncodedLevel{io::encode(coarse), coarse.width, coarse.height}));
    take(std::make_shared<Frame>(frame));
  }
  frame.levels.push_back(std::make_shared<EncodedLevel>(
      EncodedLevel{file ? std::move(*file) : io::encode(vdi), vdi.width, vdi.height}));
  take(std::make_shared<Frame>(std::move(frame)));
}

}  // namespace vdi::stream
