#include "bench/Rival.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <utility>

#include "bench/Redistribution.h"
#include "vdi/comm/GhostExchange.h"
#include "vdi/core/Error.h"

namespace vdi::bench {

namespace {

Box boxOf(const std::vector<Block>& blocks) {
  Box box;
  for (const Block& block : blocks) box.include(block.owned);
  return box;
}

/// Returns all ranks' boxes on each rank.
std::vector<Box> boxesOf(const comm::Communicator& comm, const Box& mine) {
  const comm::Gathered all = comm.allGather(std::as_bytes(std::span(&mine, 1)), sizeof(Box));
  std::vector<Box> boxes(static_cast<std::size_t>(comm.size()));
  std::memcpy(boxes.data(), all.bytes.data(), all.bytes.size());
  return boxes;
}

/// Whether the blocks of each rank fill a box. Collective.
bool allFillBoxes(const comm::Communicator& comm, const std::vector<Block>& blocks) {
  const auto volumeOf = [](const Box& box) {
    const glm::dvec3 size = box.size();
    return size.x * size.y * size.z;
  };
  double filled = 0.0;
  for (const Block& block : blocks) filled += volumeOf(block.owned);
  std::array<std::uint64_t, 1> gaps{filled < (1.0 - 1e-6) * volumeOf(boxOf(blocks)) ? 1U : 0U};
  comm.allReduceMax(gaps);
  return gaps[0] == 0;
}

std::uint64_t sumOf(const comm::Communicator& comm, std::uint64_t value) {
  std::array<std::uint64_t, 1> sum{value};
  comm.allReduceSum(std::span<std::uint64_t>(sum));
  return sum[0];
}

/// A generator of one rank takes the extent of that rank's blocks as the scene and places samples in it.
/// Therefore a block of one value marks each corner of the whole scene that the rank's box doesn't reach. Its
/// volume is too small for any sample, but its faces are farther apart than a thousandth of a spacing,
/// because closer ones would become one.
std::vector<Block> cornerBlocks(const Scene& scene, const Box& mine, ScalarType type) {
  const double thin = 0.004 * scene.minSpacing;
  const std::shared_ptr<std::byte[]> zero(new std::byte[sizeOf(type)]());
  std::vector<Block> corners;
  for (const bool upper : {false, true}) {
    const glm::dvec3 at = upper ? scene.bounds.hi : scene.bounds.lo;
    // Boxes of redistributed blocks differ by rounding.
    const double near = 0.5 * thin;
    if (!mine.empty() && glm::length((upper ? mine.hi : mine.lo) - at) < near) continue;
    Block block = Block::fromPoints(glm::ivec3(1), at, glm::dvec3(scene.minSpacing), type, zero.get());
    block.keepAlive = std::shared_ptr<const void>(zero, zero.get());
    block.owned = upper ? Box{at - thin, at} : Box{at, at + thin};
    corners.push_back(std::move(block));
  }
  return corners;
}

/// The pixels that may show a box; all pixels if it reaches behind the camera.
PixelBox pixelsOf(const Box& box, const FrameInput& input) {
  const glm::ivec2 whole(input.settings.width, input.settings.height);
  if (box.empty()) return {glm::ivec2(0), glm::ivec2(1)};  // IceT requires at least one pixel
  const View view(input.camera, whole.x, whole.y);
  glm::dvec2 minimum(whole);
  glm::dvec2 maximum(0.0);
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 world{(corner & 1) != 0 ? box.hi.x : box.lo.x, (corner & 2) != 0 ? box.hi.y : box.lo.y,
                           (corner & 4) != 0 ? box.hi.z : box.lo.z};
    const glm::dvec3 seen = view.toView(world);
    if (!view.parallel() && !(seen.z > 0.0)) return {glm::ivec2(0), whole};
    const glm::dvec2 half =
        glm::dvec2(view.halfWidth(), view.halfHeight()) * (view.parallel() ? 1.0 : seen.z);
    const glm::dvec2 at = 0.5 * (glm::dvec2(seen) / half + 1.0) * glm::dvec2(whole);
    minimum = glm::min(minimum, at);
    maximum = glm::max(maximum, at);
  }
  const glm::ivec2 first = glm::clamp(glm::ivec2(glm::floor(minimum)) - 1, glm::ivec2(0), whole - 1);
  const glm::ivec2 last = glm::clamp(glm::ivec2(glm::ceil(maximum)) + 1, first + 1, whole);
  return {first, last - first};
}

}  // namespace

IcetRival::IcetRival(std::shared_ptr<gpu::Device> device, comm::Communicator comm, int handle)
    : comm_(std::move(comm)), compositor_(handle), own_(std::move(device), comm::Communicator::serial()) {}

void IcetRival::setBlocks(const std::vector<Block>& blocks, const Scene& scene, int repeats) {
  std::vector<Block> convex = makeConvex(blocks, repeats, 1e-3 * scene.minSpacing);
  box_ = boxOf(convex);
  std::array<std::uint64_t, 1> type{0};  // on ranks with blocks
  for (const Block& block : convex) type[0] = static_cast<std::uint64_t>(block.type);
  comm_.allReduceMax(type);
  comm_.together([&] {
    for (Block& block : cornerBlocks(scene, box_, static_cast<ScalarType>(type[0])))
      convex.push_back(std::move(block));
    own_.setBlocks(std::move(convex), false);
    const Box spanned = own_.scene().bounds;
    const double off =
        std::max(glm::length(spanned.lo - scene.bounds.lo), glm::length(spanned.hi - scene.bounds.hi));
    if (!(off <= 1e-3 * scene.minSpacing) && !scene.bounds.empty())
      throw Error(ErrorCode::InvalidArgument, "the rival's scene differs from the generator's");
  });
}

void IcetRival::dropBlocks() {
  comm_.together([&] { own_.setBlocks({}, false); });
}

std::vector<Block> IcetRival::makeConvex(const std::vector<Block>& blocks, int repeats, double tolerance) {
  redistribution_ = {};
  std::vector<Block> complete = comm::exchangeGhosts(comm_, blocks);
  planes_.reset();
  if (allFillBoxes(comm_, complete))
    planes_ = SeparatingPlanes::between(boxesOf(comm_, boxOf(complete)), tolerance);
  if (planes_) return complete;
  complete.clear();
  std::uint64_t sent = 0;
  redistribution_.redistributeMs = repeated(repeats, [&] {
                                     complete.clear();
                                     return readyMs(comm_, [&] {
                                       Redistributed moved = redistribute(comm_, blocks);
                                       sent = moved.bytesSent;
                                       complete = comm::exchangeGhosts(comm_, std::move(moved.blocks));
                                       comm_.barrier();
                                     });
                                   }).median;
  redistribution_.redistributedBytes = sumOf(comm_, sent);
  planes_ = SeparatingPlanes::between(boxesOf(comm_, boxOf(complete)), tolerance);
  if (!planes_) throw Error(ErrorCode::InvalidArgument, "redistributed blocks aren't convex");
  return complete;
}

IcetRival::Timed IcetRival::draw(const FrameInput& input, const PixelBox& drawn,
                                 const std::vector<int>& order) {
  Timed timed;
  image_.reset();  // the next picture reuses its memory
  comm_.together([&] {
    timed.renderMs =
        wallMs([&] { image_ = own_.renderVolume(input.camera, input.function, input.settings); });
  });
  timed.compositeMs = wallMs([&] { timed.picture = compositor_.composite(*image_, drawn, order); });
  return timed;
}

RivalFigures IcetRival::measure(ClockRaiser& clock, const FrameInput& input, int repeats,
                                const std::optional<Image>& ours) {
  RivalFigures figures = redistribution_;
  const PixelBox drawn = pixelsOf(box_, input);
  const std::vector<int> order = planes_->frontToBack(input.camera);
  std::vector<double> renders;
  std::vector<double> composites;
  Timed timed;
  figures.frame = repeated(repeats, [&] {
    clock.run();
    const double milliseconds = readyMs(comm_, [&] { timed = draw(input, drawn, order); });
    std::array<double, 2> slowest{timed.renderMs, timed.compositeMs};
    comm_.allReduceMax(slowest);
    renders.push_back(slowest[0]);
    composites.push_back(slowest[1]);
    return milliseconds;
  });
  figures.renderMs = spreadOf({renders.end() - repeats, renders.end()}).median;
  figures.compositeMs = spreadOf({composites.end() - repeats, composites.end()}).median;
  figures.bytesSent = sumOf(comm_, compositor_.bytesSent());
  comm_.together([&] {
    if (comm_.rank() != 0) return;
    if (!ours || ours->rgba.size() != timed.picture.size())
      throw Error(ErrorCode::InvalidArgument, "the rival's picture has another size");
    for (std::size_t i = 0; i < timed.picture.size(); ++i) {
      const glm::vec4 off = glm::abs(timed.picture[i] - ours->rgba[i]);
      const double maximum = std::max({off.x, off.y, off.z, off.w});
      figures.maxDifference = std::max(figures.maxDifference, 255.0 * maximum);
    }
  });
  return figures;
}

std::string rivalLine(const RivalFigures& figures) {
  constexpr double mebi = 1 << 20;
  std::string text = fmt::format(
      "  rival icet: picture {:.3f} ms (ranks' own {:.3f}, IceT {:.3f}), sent {:.2f} MiB, "
      "differs by {:.3f}/255 at most",
      figures.frame.median, figures.renderMs, figures.compositeMs,
      static_cast<double>(figures.bytesSent) / mebi, figures.maxDifference);
  if (figures.redistributeMs) {
    text += fmt::format("; redistribution {:.1f} ms, {:.2f} MiB", *figures.redistributeMs,
                        static_cast<double>(figures.redistributedBytes) / mebi);
  }
  return text + "\n";
}

void addRival(nlohmann::json& row, const RivalFigures& figures) {
  using nlohmann::json;
  row["rival"] = "icet";
  row["rival_icet_ms"] = figures.frame.median;
  row["rival_icet_spread_ms"] = figures.frame.width();
  row["rival_render_ms"] = figures.renderMs;
  row["rival_composite_ms"] = figures.compositeMs;
  row["rival_bytes_sent"] = figures.bytesSent;
  row["rival_redistribute_ms"] = figures.redistributeMs ? json(*figures.redistributeMs) : json(nullptr);
  row["rival_redistributed_bytes"] = figures.redistributedBytes;
  row["rival_max_difference"] = figures.maxDifference;
}

}  // namespace vdi::bench
