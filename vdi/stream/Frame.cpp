#include "vdi/stream/Frame.h"

#include <optional>
#include <utility>

#include "vdi/core/Estimate.h"
#include "vdi/core/Parallel.h"
#include "vdi/core/Thinning.h"
#include "vdi/io/VdiFile.h"

namespace vdi::stream {

namespace {

std::shared_ptr<const EncodedLevel> levelOf(std::vector<std::byte> bytes, const Vdi& size) {
  return std::make_shared<EncodedLevel>(EncodedLevel{std::move(bytes), size.width, size.height});
}

std::shared_ptr<const EncodedLevel> levelOf(const Vdi& vdi) {
  return levelOf(io::encode(vdi), vdi);
}

}  // namespace

std::vector<int> coarseFactorsOf(std::uint64_t bytes) {
  std::vector<int> factors;
  std::uint64_t finer = bytes;
  for (auto factor = coarseFactors.rbegin(); factor != coarseFactors.rend() && finer >= smallBytes;
       ++factor) {
    factors.insert(factors.begin(), *factor);
    finer = bytes / (static_cast<std::uint64_t>(*factor) * static_cast<std::uint64_t>(*factor));
  }
  return factors;
}

void encodeFrame(const Vdi& vdi, std::uint32_t id, Clock::time_point made,
                 const std::function<void(FramePtr)>& take, const std::function<bool()>& goesOn) {
  const auto bytes = bytesInMemory<std::uint64_t>(vdi.listCount(), vdi.supersegmentCount(), vdi.precision());
  const std::vector<int> factors = coarseFactorsOf(bytes);
  Frame frame{id, vdi.timeStep, vdi.time, made, static_cast<std::uint32_t>(factors.size()) + 1, {}};
  // A coarse level has too few chunks to keep all cores busy, so all are made side by side.
  frame.levels.resize(factors.size());
  eachInParallel(factors.size(), [&](std::size_t i) { frame.levels[i] = levelOf(thinned(vdi, factors[i])); });
  if (!factors.empty()) take(std::make_shared<Frame>(frame));
  std::optional<std::vector<std::byte>> whole =
      io::encodeWhile(vdi, [&] { return factors.empty() || goesOn(); });
  if (!whole) return;
  frame.levels.push_back(levelOf(*std::move(whole), vdi));
  take(std::make_shared<Frame>(std::move(frame)));
}

void passFrame(std::vector<std::byte> file, std::uint32_t id, Clock::time_point made,
               const std::function<void(FramePtr)>& take) {
  const io::VdiFileInfo info = io::decodeInfo(file);
  const std::vector<int> factors = coarseFactorsOf(info.expandedBytes);
  Frame frame{
      id, info.header.timeStep, info.header.time, made, static_cast<std::uint32_t>(factors.size()) + 1, {}};
  if (factors.empty()) {
    static_cast<void>(io::decode(file));
  } else {
    // This checks all of the file.
    for (const Vdi& coarse : io::decodeThinned(file, factors)) frame.levels.push_back(levelOf(coarse));
  }
  frame.levels.push_back(levelOf(std::move(file), info.header));
  take(std::make_shared<Frame>(std::move(frame)));
}

}  // namespace vdi::stream
