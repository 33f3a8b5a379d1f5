#include "vdi/pipeline/Compositor.h"

#include <algorithm>
#include <cstring>
#include <utility>

namespace vdi::detail {

using gpu::MemoryKind;
namespace shared = gpu::shared;

Compositor::Compositor(std::shared_ptr<gpu::Device> device)
    : device_(std::move(device)),
      commands_(device_),
      scan_(device_),
      mergePass_(device_),
      compositePass_(device_),
      builder_(device_),
      survey_(device_) {}

/// Bands of lists whose supersegments, received, merged and composited, take at most an eighth of the device
/// each.
template <typename Segment>
std::vector<Compositor::Band> Compositor::begin(const std::vector<ListsOf<Segment>>& subLists,
                                                const Request& request) {
  request_ = request;
  settings_.step = static_cast<float>(request.sampleStep);
  settings_.budget = request.budget;
  settings_.mostPerList = request.mostPerList;
  settings_.level = request.level;
  settings_.form = storedForm(request.code);
  const std::size_t listCount = subLists.front().listCount();
  const std::uint64_t most = std::max<std::uint64_t>(device_->limits().memoryBytes / 8 / sizeof(Segment), 1);
  std::vector<Band> bands;
  for (Band band; band.first < listCount; band.first = band.last) {
    for (std::uint64_t total = 0; band.last < listCount; ++band.last) {
      std::uint64_t next = 0;
      for (const ListsOf<Segment>& sub : subLists) next += sub.countOf(band.last);
      if (band.last > band.first && total + next > most) break;
      total += next;
    }
    bands.push_back(band);
  }
  return bands;
}

template <typename Segment>
Survey Compositor::survey(const std::vector<ListsOf<Segment>>& subLists, const Request& request) {
  surveyed_.reset();
  const std::vector<Band> bands = begin(subLists, request);
  Survey sum;
  for (const Band& band : bands) {
    merge(subLists, band);
    sum += survey_.take(commands_, [&](gpu::Commands& commands, std::uint64_t address) {
      settings_.survey = address;
      compositePass_.record(commands, settings_, gpu::CompositePass::Work::Survey, request_.algorithm);
    });
  }
  if (bands.size() == 1) surveyed_ = bands.front();
  return sum;
}

template <typename Segment>
ListsOf<Segment> Compositor::composite(const std::vector<ListsOf<Segment>>& subLists,
                                       const Request& request) {
  const std::vector<Band> bands = begin(subLists, request);
  ListsOf<Segment> result;
  result.offsets.reserve(subLists.front().listCount() + 1);
  const std::optional<Band> merged = std::exchange(surveyed_, std::nullopt);
  for (const Band& band : bands) {
    if (merged != band) merge(subLists, band);
    compositeBand(band, result);
  }
  return result;
}

/// Of all ranks: supersegments to received_, offsets from 0 to subOffsets_. Returns how many supersegments.
template <typename Segment>
std::uint64_t Compositor::upload(const std::vector<ListsOf<Segment>>& subLists, const Band& band) {
  const std::size_t listCount = band.listCount();
  std::uint64_t total = 0;
  for (const ListsOf<Segment>& sub : subLists) total += sub.offsets[band.last] - sub.offsets[band.first];
  staging_.reserve(device_, total * sizeof(Segment), MemoryKind::Upload);
  received_.reserve(device_, total * sizeof(Segment), MemoryKind::DeviceLocal);
  rankAddresses_.reserve(device_, subLists.size() * sizeof(std::uint64_t), MemoryKind::Upload);
  subOffsets_.reserve(device_, subLists.size() * (listCount + 1) * sizeof(std::uint32_t), MemoryKind::Upload);
  std::uint64_t at = 0;
  for (std::size_t rank = 0; rank < subLists.size(); ++rank) {
    const ListsOf<Segment>& sub = subLists[rank];
    const std::uint32_t begin = sub.offsets[band.first];
    const std::uint64_t bytes = (sub.offsets[band.last] - begin) * sizeof(Segment);
    if (bytes > 0) std::memcpy(staging_.mapped().data() + at, sub.segments.data() + begin, bytes);
    rankAddresses_.mappedAs<std::uint64_t>()[rank] = received_.address() + at;
    const auto offsets = subOffsets_.mappedAs<std::uint32_t>().subspan(rank * (listCount + 1), listCount + 1);
    for (std::size_t i = 0; i <= listCount; ++i) offsets[i] = sub.offsets[band.first + i] - begin;
    at += bytes;
  }
  return total;
}

/// All ranks' supersegments of each list, by depth, to merged_ and mergedOffsets_.
template <typename Segment>
void Compositor::merge(const std::vector<ListsOf<Segment>>& subLists, const Band& band) {
  const std::uint32_t listCount = band.listCount();
  const std::uint64_t total = upload(subLists, band);
  const std::uint64_t words = (std::uint64_t{listCount} + 1) * sizeof(std::uint32_t);
  heads_.reserve(device_, subLists.size() * words, MemoryKind::DeviceLocal);
  mergedCounts_.reserve(device_, words, MemoryKind::DeviceLocal);
  mergedOffsets_.reserve(device_, words, MemoryKind::DeviceLocal);
  merged_.reserve(device_, total * sizeof(Segment), MemoryKind::DeviceLocal);

  shared::MergeConstants merge{};
  merge.received = rankAddresses_.address();
  merge.subOffsets = subOffsets_.address();
  merge.heads = heads_.address();
  merge.counts = mergedCounts_.address();
  merge.offsets = mergedOffsets_.address();
  merge.merged = merged_.address();
  merge.listCount = listCount;
  merge.form = settings_.form;
  merge.rankCount = static_cast<std::uint32_t>(subLists.size());
  commands_.begin();
  commands_.copy(staging_, 0, received_, 0, total * sizeof(Segment));
  merge.mode = shared::mergeModeCount;
  mergePass_.record(commands_, merge);
  scan_.record(commands_, mergedCounts_, mergedOffsets_, listCount);
  merge.mode = shared::mergeModeMerge;
  mergePass_.record(commands_, merge);
  commands_.submitAndWait();
  settings_.merged = merged_.address();
  settings_.mergedOffsets = mergedOffsets_.address();
  settings_.listCount = listCount;
}

template <typename Segment>
void Compositor::compositeBand(const Band& band, ListsOf<Segment>& result) {
  const auto record = [&](gpu::Commands& commands, const BandTargets& targets, bool write) {
    settings_.sensitivities = targets.sensitivities;
    settings_.counts = targets.counts;
    settings_.offsets = targets.offsets;
    settings_.segments = targets.segments;
    settings_.grains = targets.grains;
    settings_.written = targets.written;
    settings_.left = targets.left;
    settings_.status = targets.status;
    using Work = gpu::CompositePass::Work;
    compositePass_.record(commands, settings_, write ? Work::Write : Work::Search, request_.algorithm);
  };
  ListBuilder::Request build;
  build.width = band.listCount();
  build.rows = 1;
  build.algorithm = request_.algorithm;
  build.most = {request_.mostPerList, true};
  build.sampleStep = request_.sampleStep;
  build.code = request_.code;
  builder_.build(build, record, result);
}

template Survey Compositor::survey(const std::vector<SupersegmentLists>&, const Request&);
template Survey Compositor::survey(const std::vector<CompactLists>&, const Request&);
template SupersegmentLists Compositor::composite(const std::vector<SupersegmentLists>&, const Request&);
template CompactLists Compositor::composite(const std::vector<CompactLists>&, const Request&);

void flattenMerged(std::span<const SupersegmentLists> subLists, std::span<glm::vec4> rgba,
                   std::span<float> depth) {
  std::vector<Supersegment> merged;
  for (std::size_t i = 0; i < rgba.size(); ++i) {
    merged.clear();
    for (const SupersegmentLists& sub : subLists) {
      const auto list = sub.list(i);
      merged.insert(merged.end(), list.begin(), list.end());
    }
    std::sort(merged.begin(), merged.end(),
              [](const Supersegment& a, const Supersegment& b) { return a.front < b.front; });
    glm::vec4 sum(0.0F);
    for (const Supersegment& s : merged) sum += (1.0F - sum.a) * glm::vec4(s.red, s.green, s.blue, s.opacity);
    rgba[i] = sum;
    depth[i] = merged.empty() ? Image::noDepth : merged.front().front;
  }
}

}  // namespace vdi::detail
