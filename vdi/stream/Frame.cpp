#include "vdi/stream/Frame.h"

#include <utility>

#include "vdi/core/Estimate.h"
#include "vdi/core/Thinning.h"
#include "vdi/io/VdiFile.h"

namespace vdi::stream {

namespace {

std::uint32_t levelCountOf(std::uint64_t bytesInMemory) {
  return bytesInMemory < smallBytes ? 1 : 2;
}

/// Adds a level to the frame, and returns the frame as it is then.
FramePtr addLevel(Frame& frame, std::vector<std::byte> bytes, const Vdi& size) {
  frame.levels.push_back(
      std::make_shared<EncodedLevel>(EncodedLevel{std::move(bytes), size.width, size.height}));
  return std::make_shared<Frame>(frame);
}

}  // namespace

void encodeFrame(const Vdi& vdi, std::uint32_t id, Clock::time_point made,
                 const std::function<bool(FramePtr)>& take) {
  const auto bytes = bytesInMemory<std::uint64_t>(vdi.listCount(), vdi.supersegmentCount(), vdi.precision());
  Frame frame{id, vdi.timeStep, vdi.time, made, levelCountOf(bytes), {}};
  if (frame.levelCount > 1) {
    const Vdi coarse = thinned(vdi, coarseFactor);
    if (!take(addLevel(frame, io::encode(coarse), coarse))) return;
  }
  (void)take(addLevel(frame, io::encode(vdi), vdi));
}

void passFrame(std::vector<std::byte> file, std::uint32_t id, Clock::time_point made,
               const std::function<void(FramePtr)>& take) {
  const io::VdiFileInfo info = io::decodeInfo(file);
  Frame frame{id, info.header.timeStep, info.header.time, made, levelCountOf(info.expandedBytes), {}};
  if (frame.levelCount > 1) {
    const Vdi coarse = io::decodeThinned(file, coarseFactor);  // checks all of the file
    take(addLevel(frame, io::encode(coarse), coarse));
  } else {
    static_cast<void>(io::decode(file));
  }
  take(addLevel(frame, std::move(file), info.header));
}

}  // namespace vdi::stream
