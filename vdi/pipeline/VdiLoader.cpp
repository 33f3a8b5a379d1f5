#include "vdi/pipeline/VdiLoader.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <utility>
#include <variant>

#include "vdi/core/Error.h"
#include "vdi/gpu/RenderPass.h"
#include "vdi/pipeline/ListBuilder.h"

namespace vdi::detail {

using gpu::MemoryKind;
namespace shared = gpu::shared;

namespace {

/// The most bytes staged at a time with Kind::Alone. Uploads up to this size continue after `load` returns.
constexpr std::uint64_t aloneBytes = std::uint64_t{128} << 20;
/// The most bytes staged at a time with Kind::DuringRenders. A render waits for the part under way.
constexpr std::uint64_t duringRendersBytes = std::uint64_t{2} << 20;

}  // namespace

VdiLoader::VdiLoader(std::shared_ptr<gpu::Device> device)
    : device_(std::move(device)), expand_(device_), scan_(device_), commands_(device_) {}

/// Calls use(at, first, count) for parts of `values` in the staging buffer, `at` bytes into it.
template <typename T, typename Use>
void VdiLoader::inParts(const HostVector<T>& values, Use use) {
  for (std::size_t first = 0; first < values.size();) {
    if (stagingUsed_ + sizeof(T) > stagingBytes_) {
      commands_.submitAndWait();
      commands_.begin();
      stagingUsed_ = 0;
    }
    const std::size_t count =
        std::min<std::size_t>((stagingBytes_ - stagingUsed_) / sizeof(T), values.size() - first);
    std::memcpy(staging_.mapped().data() + stagingUsed_, values.data() + first, count * sizeof(T));
    use(stagingUsed_, first, count);
    constexpr std::uint64_t alignment = 16;
    stagingUsed_ += (count * sizeof(T) + alignment - 1) / alignment * alignment;
    first += count;
  }
}

/// Prepares everything that does not depend on the number of supersegments.
void VdiLoader::start(const Vdi& header, LoadedVdi& target) {
  commands_.wait();  // the last load may still use the buffers
  outgrown_ = {};
  target.original.reset();
  target.leans = false;
  target.faces = facesOf(header.bounds, header.view());
  target.depthStep = header.depthCode.step;
  target_ = &target;
  const glm::ivec2 size{header.width, header.height};
  listCount_ = static_cast<std::uint64_t>(size.x) * static_cast<std::uint64_t>(size.y);
  added_ = 0;
  offsets_.reserve(device_, (listCount_ + 1) * wordBytes, MemoryKind::DeviceLocal);
  target.heads.reserve(device_, listCount_ * sizeof(shared::ListHead), MemoryKind::DeviceLocal);
  target.tileDepthMasks.reserve(device_, gpu::tileCount(size) * sizeof(std::uint64_t),
                                MemoryKind::DeviceLocal);
  target.depthRange.reserve(device_, sizeof(shared::DepthRange), MemoryKind::DeviceLocal);
  target.depthRangeReadback.reserve(device_, sizeof(shared::DepthRange), MemoryKind::Readback);
  constants_ = {};
  constants_.offsets = offsets_.address();
  constants_.heads = target.heads.address();
  constants_.tileDepthMasks = target.tileDepthMasks.address();
  constants_.depthRange = target.depthRange.address();
  constants_.lists = size;
  constants_.form = storedForm(header.form());
  segmentBytes_ = segmentBytes(header.precision());
  constants_.perspective = header.camera.parallelProjection ? 0U : 1U;
}

/// Makes room for commands that add `count` supersegments to the present ones.
void VdiLoader::reserveSegments(std::uint64_t count) {
  const std::uint64_t bytes = (added_ + count) * sizeof(shared::RenderSegment);
  gpu::Buffer& segments = target_->segments;
  if (segments && bytes > segments.size() && added_ > 0) {
    outgrown_ = std::exchange(segments, {});  // its last use has been waited for
    segments.reserve(device_, bytes + bytes / 2, MemoryKind::DeviceLocal);
    commands_.copy(outgrown_, 0, segments, 0, added_ * sizeof(shared::RenderSegment));
    commands_.barrier();
  } else {
    segments.reserve(device_, bytes, MemoryKind::DeviceLocal);
  }
  constants_.segments = segments.address();
}

/// Expands supersegments [first, first + count) of all.
void VdiLoader::recordSegments(VkDeviceAddress from, std::uint64_t first, std::uint64_t count) {
  shared::ExpandConstants constants = constants_;
  constants.mode = shared::expandModeSegments;
  constants.from = from;
  constants.segments += first * sizeof(shared::RenderSegment);
  constants.count = static_cast<std::uint32_t>(count);
  expand_.record(commands_, constants);
}

/// Call when all supersegments are on the device.
void VdiLoader::recordMasks() {
  const shared::DepthRange nothing{std::numeric_limits<float>::infinity(), 0.0F, 0.0F};
  commands_.update(target_->depthRange, std::as_bytes(std::span(&nothing, 1)));
  for (const std::uint32_t mode : {shared::expandModeDepths, shared::expandModeBins, shared::expandModeMasks,
                                   shared::expandModeTiles, shared::expandModeLargeTiles}) {
    commands_.barrier();
    constants_.mode = mode;
    expand_.record(commands_, constants_);
  }
  commands_.copy(target_->depthRange, 0, target_->depthRangeReadback, 0, sizeof(shared::DepthRange));
}

std::array<glm::vec4, shared::renderFaces> facesForDevice(const LoadedVdi& vdi) {
  std::array<glm::vec4, shared::renderFaces> faces;
  std::transform(vdi.faces.begin(), vdi.faces.end(), faces.begin(),
                 [](const glm::dvec4& face) { return glm::vec4(face); });
  return faces;
}

void recordLeaning(gpu::Commands& commands, gpu::ExpandPass& expand,
                   const std::shared_ptr<gpu::Device>& device, LoadedVdi& vdi) {
  const View& original = *vdi.original;
  const std::uint64_t room = vdi.segments.size() / sizeof(shared::RenderSegment);
  vdi.slopes.reserve(device, room * wordBytes, MemoryKind::DeviceLocal);
  const std::array<glm::vec4, shared::renderFaces> faces = facesForDevice(vdi);
  vdi.boxFaces.reserve(device, sizeof(faces), MemoryKind::DeviceLocal);
  commands.update(vdi.boxFaces, std::as_bytes(std::span(faces)));
  const FaceTolerance tolerance = faceToleranceOf(vdi.depthStep, vdi.depths().farthest);
  shared::ExpandConstants constants{};
  constants.segments = vdi.segments.address();
  constants.slopes = vdi.slopes.address();
  constants.heads = vdi.heads.address();
  constants.tileDepthMasks = vdi.tileDepthMasks.address();
  constants.depthRange = vdi.depthRange.address();
  constants.boxFaces = vdi.boxFaces.address();
  constants.rounding = {static_cast<float>(tolerance.depth), static_cast<float>(tolerance.distance)};
  constants.perspective = original.parallel() ? 0U : 1U;
  constants.pixelSize = gpu::pixelSizeOf(original);
  constants.lists = {original.width(), original.height()};
  for (const std::uint32_t mode : {shared::expandModeSlopes, shared::expandModeLeaningMasks,
                                   shared::expandModeTiles, shared::expandModeLargeTiles}) {
    commands.barrier();
    constants.mode = mode;
    expand.record(commands, constants);
  }
  commands.barrier();
  vdi.leans = true;
}

template <typename Segment>
void VdiLoader::loadLists(const ListsOf<Segment>& lists, Kind kind) {
  const std::uint64_t bytes =
      (lists.offsets.size() + 4) * sizeof(std::uint32_t) + lists.segments.size() * sizeof(Segment);
  stagingBytes_ = std::min(bytes, kind == Kind::Alone ? aloneBytes : duringRendersBytes);
  staging_.reserve(device_, stagingBytes_, MemoryKind::Upload);
  stagingUsed_ = 0;
  commands_.begin();
  reserveSegments(lists.segments.size());
  inParts(lists.offsets, [&](std::uint64_t at, std::size_t first, std::size_t count) {
    commands_.copy(staging_, at, offsets_, first * wordBytes, count * wordBytes);
  });
  inParts(lists.segments, [&](std::uint64_t at, std::size_t first, std::size_t count) {
    recordSegments(staging_.address() + at, first, count);
  });
  commands_.barrier();
  recordMasks();
  commands_.submit();
  if (kind == Kind::DuringRenders) commands_.wait();
}

void VdiLoader::load(const Vdi& vdi, LoadedVdi& target, Kind kind) {
  start(vdi, target);
  std::visit([&](const auto& lists) { loadLists(lists, kind); }, vdi.lists);
  target.original = std::make_unique<View>(vdi.view());
}

void VdiLoader::begin(const Vdi& header, LoadedVdi& target) {
  start(header, target);
  target.original = std::make_unique<View>(header.view());
}

gpu::Submission VdiLoader::add(const DeviceLists& band, std::uint64_t firstList) {
  if (added_ + band.count > std::numeric_limits<std::uint32_t>::max())
    throw Error(ErrorCode::OutOfMemory, "more than 2^32 supersegments in one VDI");
  commands_.begin();
  commands_.waitFor(band.written);
  outgrown_ = {};  // begin has waited for its last use
  reserveSegments(band.count);
  const std::uint64_t words = std::uint64_t{band.listCount} + 1;
  commands_.copy(band.offsets, 0, offsets_, firstList * wordBytes, words * wordBytes);
  if (added_ > 0) {
    scan_.recordRebase(commands_, offsets_, firstList, static_cast<std::uint32_t>(words),
                       static_cast<std::uint32_t>(added_));
  }
  // Each pass handles as many supersegments as fit into 4 GiB (shared/lists.h).
  constexpr std::uint64_t atOnce = std::uint64_t{1} << 26;
  for (std::uint64_t first = 0; first < band.count; first += atOnce) {
    recordSegments(band.segments.address() + first * segmentBytes_, added_ + first,
                   std::min(atOnce, band.count - first));
  }
  commands_.submit();
  added_ += band.count;
  return commands_.last();
}

void VdiLoader::finish() {
  commands_.begin();
  outgrown_ = {};
  recordMasks();
  commands_.submit();
}

}  // namespace vdi::detail
