// Brings lists from the host to passes on the device, and back.
#pragma once

#include <cstring>
#include <vector>

#include "vdi/pipeline/Compositor.h"

namespace vdi::test {

/// The parts that a Distributor would return for these lists, one rank after the other. Every other rank's
/// counts are words, as if one did not fit a byte.
class HostSubLists {
 public:
  template <typename Segment>
  HostSubLists(const std::shared_ptr<gpu::Device>& device, const std::vector<ListsOf<Segment>>& subLists) {
    std::vector<std::byte> bytes;
    const auto append = [&](const auto& values) {
      bytes.resize((bytes.size() + 63) / 64 * 64);
      const std::uint64_t at = bytes.size();
      const auto from = std::as_bytes(std::span(values));
      bytes.insert(bytes.end(), from.begin(), from.end());
      return at;
    };
    parts_.listCount = static_cast<std::uint32_t>(subLists.front().listCount());
    parts_.segmentBytes = sizeof(Segment);
    for (const ListsOf<Segment>& lists : subLists) {
      detail::SubLists sub;
      sub.wideCounts = parts_.subLists.size() % 2 == 1;
      std::vector<std::uint32_t> counts(lists.listCount());
      for (std::size_t i = 0; i < counts.size(); ++i) counts[i] = lists.countOf(i);
      std::vector<std::uint8_t> narrow(counts.begin(), counts.end());
      narrow.resize((narrow.size() + 3) / 4 * 4);
      sub.countsAt = sub.wideCounts ? append(counts) : append(narrow);
      sub.segmentsAt = append(lists.segments);
      sub.count = lists.segments.size();
      parts_.total += sub.count;
      parts_.subLists.push_back(sub);
    }
    const auto memory = HostMemory::anonymous(bytes.size());
    std::memcpy(memory->bytes().data(), bytes.data(), bytes.size());
    access_ = std::make_unique<detail::HostAccess>(device, memory);
    for (detail::SubLists& sub : parts_.subLists) sub.access = access_.get();
  }
  const detail::Distributed& parts() const { return parts_; }

 private:
  std::unique_ptr<detail::HostAccess> access_;
  detail::Distributed parts_;
};

template <typename Segment>
ListsOf<Segment> download(const std::shared_ptr<gpu::Device>& device, const detail::DeviceLists& onDevice) {
  const auto pool = std::make_shared<detail::HostPool>(device, detail::HostPool::Visible::ToProcess);
  auto lists = detail::listsIn<Segment>(pool);
  detail::DownloadMemory memory(device);
  {
    detail::ListDownload<Segment> download(lists, *pool, memory, onDevice.listCount, onDevice.count);
    gpu::Commands commands(device);
    commands.begin();
    download.recordOffsets(commands, onDevice, 0);
    commands.submitAndWait();
    download.send(onDevice);
    download.finish();
  }
  ListsOf<Segment> copy = lists;  // on the heap
  lists = {};
  pool->detach();
  return copy;
}

/// Composites all ranks' lists.
template <typename Segment>
ListsOf<Segment> composite(const std::shared_ptr<gpu::Device>& device, detail::Compositor& compositor,
                           const std::vector<ListsOf<Segment>>& subLists,
                           const detail::Compositor::Options& request) {
  const HostSubLists parts(device, subLists);
  detail::DeviceLists merged;
  compositor.interleave(parts.parts(), request.form, merged);
  detail::DeviceLists lists;
  compositor.composite(merged, request, lists);
  compositor.finish();
  return download<Segment>(device, lists);
}

}  // namespace vdi::test
