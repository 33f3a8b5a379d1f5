#include "vdi/pipeline/TimeSteps.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <type_traits>
#include <utility>

#include "vdi/comm/GhostExchange.h"
#include "vdi/comm/GlobalScene.h"
#include "vdi/core/Error.h"
#include "vdi/pipeline/Stages.h"

namespace vdi::detail {

namespace {

/// Collective. Throws if all ranks have only zeros and values too small for the device, so that nothing would
/// be visible.
void requireUsableValues(const comm::Communicator& comm, std::span<const Block> blocks) {
  ValueSizes own;
  comm.together([&] { own = valueSizesOf(blocks); });
  std::array<std::uint64_t, 2> any{own.usable ? 1U : 0U, own.tooSmall ? 1U : 0U};
  comm.allReduceMax(any);
  if (any[0] != 0 || any[1] == 0) return;
  throw Error(
      ErrorCode::InvalidArgument,
      fmt::format("all values are 0 or smaller than {} (f32) or {} (f64) in size, too small to be told "
                  "apart; use other units",
                  limitsOf(ScalarType::F32).minimum, limitsOf(ScalarType::F64).minimum));
}

/// Collective: makes a sheet of values, which has no volume, one spacing thick. A block with several layers
/// that owns no volume is no sheet: it gives all of its places to others.
void thickenSheet(const comm::Communicator& comm, std::span<Block> blocks) {
  // Box::empty() is true of a sheet too.
  const auto ownsNothing = [](const Block& block) {
    return glm::any(glm::greaterThan(block.owned.lo, block.owned.hi));
  };
  Box bounds;
  glm::dvec3 finest(std::numeric_limits<double>::infinity());
  glm::ivec3 most(0);  // layers across each axis
  for (const Block& block : blocks) {
    if (ownsNothing(block)) continue;
    bounds = {glm::min(bounds.lo, block.owned.lo), glm::max(bounds.hi, block.owned.hi)};
    finest = glm::min(finest, block.spacing);
    most = glm::max(most, block.dims);
  }
  const glm::dvec3 layers = -glm::dvec3(most);
  std::array<double, 12> least{bounds.lo.x,  bounds.lo.y,  bounds.lo.z, -bounds.hi.x,
                               -bounds.hi.y, -bounds.hi.z, finest.x,    finest.y,
                               finest.z,     layers.x,     layers.y,    layers.z};
  comm.allReduceMin(least);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double thickness = -least[axis + 3] - least[axis];
    constexpr double rounding = 1e-3;  // share of a spacing by which ranks may differ in a sheet's place
    if (!(thickness >= 0.0 && thickness < rounding * least[axis + 6]) || least[axis + 9] < -1.0) continue;
    const auto a = static_cast<int>(axis);
    for (Block& block : blocks) {
      if (ownsNothing(block)) continue;
      block.owned.lo[a] = least[axis] - 0.5 * least[axis + 6];
      block.owned.hi[a] = least[axis] + 0.5 * least[axis + 6];
    }
  }
}

/// Collective: all ranks' probes, by index.
std::vector<Probe> globalProbes(const comm::Communicator& comm, const Scene& scene,
                                std::span<const Block> blocks) {
  static_assert(std::is_trivially_copyable_v<Probe>);
  std::vector<Probe> own;
  comm.together([&] { own = probesOf(scene, blocks); });
  if (comm.size() == 1) return own;
  const comm::Gathered all = comm.allGather(std::as_bytes(std::span(own)), sizeof(Probe));
  std::vector<Probe> probes;
  comm.together([&] {
    probes.resize(all.bytes.size() / sizeof(Probe));
    if (!probes.empty()) std::memcpy(probes.data(), all.bytes.data(), all.bytes.size());
    std::ranges::sort(probes, {}, &Probe::index);
  });
  return probes;
}

/// Collective: the number of colours of all ranks' blocks (Block::colors). Throws unless they are equal.
std::size_t globalColors(const comm::Communicator& comm, std::span<const Block> blocks) {
  constexpr std::uint64_t none = 4;
  std::array<std::uint64_t, 2> ends{0, 0};  // the most, and `none` less the fewest
  for (const Block& block : blocks) {
    const bool areAlike = std::ranges::all_of(
        block.colors, [&](const Block& color) { return color.type == block.type; });  // textures' formats are
    const std::uint64_t count = areAlike ? std::min<std::uint64_t>(block.colors.size(), none) : none;
    ends = {std::max(ends[0], count), std::max(ends[1], none - count)};
  }
  comm.allReduceMax(ends);
  const bool known = ends[0] == 0 || ends[0] == 1 || ends[0] == 3;
  if (known && (ends[1] == 0 || ends[0] + ends[1] == none)) return ends[0];
  throw Error(ErrorCode::InvalidArgument, "all blocks must have the same components, of one type");
}

/// Collective: gives the values that colour the blocks the layers that `complete` gives the blocks.
template <typename Complete>
std::vector<Block> completed(std::vector<Block> blocks, std::size_t colors, Complete complete) {
  std::vector<std::vector<Block>> completedColors;
  for (std::size_t c = 0; c < colors; ++c) {
    std::vector<Block> values;
    values.reserve(blocks.size());
    for (const Block& block : blocks) values.push_back(block.withColors(c));
    completedColors.push_back(complete(std::move(values)));
  }
  blocks = complete(std::move(blocks));
  // The blocks' places alone decide how they are divided.
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    blocks[i].colors.clear();
    for (std::vector<Block>& values : completedColors) blocks[i].colors.push_back(std::move(values[i]));
  }
  return blocks;
}

/// Collective: the range of the values that colour all ranks' blocks.
ScalarRange globalColoredRange(const comm::Communicator& comm, std::span<const Block> blocks) {
  ScalarRange own;
  comm.together([&] {
    for (const Block& block : blocks) own.include(ownRange(block.colors.front()));
  });
  std::array<double, 2> least{own.min, -own.max};
  comm.allReduceMin(least);
  return {least[0], -least[1]};
}

}  // namespace

TimeSteps::Step TimeSteps::send(std::vector<Block> blocks, bool fillGhosts,
                                void (gpu::VolumeStore::*way)(std::span<const Block>, const Scene&)) {
  Stopwatch watch;
  Step step;
  comm_.together([&] { validate(blocks); });
  requireUsableValues(comm_, blocks);
  thickenSheet(comm_, blocks);
  for (const Block& block : blocks) {
    step.bytes += block.byteCount() * (1 + block.colors.size());
    step.doubles = step.doubles || block.type == ScalarType::F64;
  }
  step.blocks = blocks.size();
  step.colors = globalColors(comm_, blocks);
  blocks = completed(std::move(blocks), step.colors, [&](std::vector<Block> some) {
    return fillGhosts ? comm::exchangeGhosts(comm_, std::move(some))
                      : comm::settleOwnership(comm_, std::move(some));
  });
  if (step.colors == 1) step.colored = globalColoredRange(comm_, blocks);
  step.scene = comm::globalScene(comm_, localScene(blocks));  // allocates no memory
  step.probes = globalProbes(comm_, step.scene, blocks);
  comm_.together([&] { (volume_.*way)(blocks, step.scene); });
  step.uploadSeconds = watch.lap();
  return step;
}

void TimeSteps::show(Step step) {
  shown_ = std::move(step);
  rate_.reset();
  const auto& [own, used] = volume_.valueRanges();
  std::array<double, 4> minimum{own.min, -own.max, used.min, -used.max};
  comm_.allReduceMin(minimum);
  ranges_ = {{minimum[0], -minimum[1]}, {minimum[2], -minimum[3]}};
}

void TimeSteps::dropNext() {
  next_.reset();
  volume_.dropNext();
}

void TimeSteps::setBlocks(std::vector<Block> blocks, bool fillGhosts) {
  dropNext();
  shown_ = {};  // if one rank fails, no rank shows anything
  ranges_ = {};
  show(send(std::move(blocks), fillGhosts, &gpu::VolumeStore::setBlocks));
}

void TimeSteps::setNextBlocks(std::vector<Block> blocks, bool fillGhosts) {
  dropNext();
  try {
    next_ = send(std::move(blocks), fillGhosts, &gpu::VolumeStore::setNextBlocks);
  } catch (...) {
    dropNext();  // other ranks may have sent their blocks
    throw;
  }
}

void TimeSteps::advance() {
  Stopwatch watch;
  std::optional<Step> next = std::exchange(next_, std::nullopt);
  if (!next) throw Error(ErrorCode::InvalidArgument, "no next blocks were set");
  comm_.together([&] { volume_.awaitNext(); });
  volume_.showNext();
  show(std::move(*next));
  shown_.uploadSeconds += watch.lap();
}

double TimeSteps::samplingRate(const TransferTable& table, const Region& region) {
  if (!rate_ || rate_->table != table || rate_->region != region)
    rate_ = Rate{table, region, samplingRateFor(table, shown_.scene, region, shown_.probes)};
  return rate_->samplesPerVoxel;
}

void TimeSteps::requireSpans(const TransferTable& table) const {
  // The device stores f64 as floats that give a value's position in the block's range.
  constexpr double maxCount = 1e33;
  const ScalarRange& range = ranges_.used;
  const double span = range.max - range.min;
  if (!shown_.doubles || !(span > maxCount * (table.max - table.min))) return;
  throw Error(ErrorCode::InvalidArgument,
              fmt::format("the values are from {} to {}, the transfer function's from {} to {}: more than a "
                          "factor of {}; name fill values as missing, or mark them as NaN",
                          range.min, range.max, table.min, table.max, maxCount));
}

void TimeSteps::report(RankReport& report) {
  report.uploadSeconds = std::exchange(shown_.uploadSeconds, 0.0);
  report.blocks = shown_.blocks;
  report.volumeBytes = shown_.bytes;
}

}  // namespace vdi::detail
