// Sinks that bring a VDI's lists to the root's host. Not part of the library's interface.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "vdi/pipeline/Frames.h"
#include "vdi/pipeline/Stages.h"
#include "vdi/pipeline/VdiSink.h"

namespace vdi::detail {

/// Predicts the number of supersegments of the next VDI: the last one's, and some more.
class Expectation {
 public:
  std::uint64_t next() const { return last_ + last_ / 8; }
  void note(std::uint64_t count) { last_ = count; }

 private:
  std::uint64_t last_ = 0;
};

inline std::uint64_t listCountOf(const Vdi& header) {
  return static_cast<std::uint64_t>(header.width) * static_cast<std::uint64_t>(header.height);
}

/// With one rank: downloads lists to the host while the device makes the next ones.
template <typename Segment>
class DownloadSink final : public VdiSink {
 public:
  /// `vdi` receives the lists; it, `flight` and `expected` must outlive the sink.
  DownloadSink(std::shared_ptr<HostPool> pool, Flight& flight, Vdi& vdi, Expectation& expected)
      : pool_(std::move(pool)),
        flight_(flight),
        vdi_(vdi),
        expected_(expected),
        lists_(listsIn<Segment>(pool_)) {}

  void begin(const Vdi& header) override {
    download_.emplace(lists_, *pool_, *flight_.downloads, listCountOf(header), expected_.next());
  }
  void record(gpu::Commands& commands, const DeviceLists& lists, std::uint64_t firstList) override {
    download_->recordOffsets(commands, lists, firstList);
  }
  gpu::Submission add(const Band& band, const Wait& wait, RankReport& report) override {
    Stopwatch watch;
    wait();
    const gpu::Submission sent = download_->send(band.lists);
    report.generateSeconds += watch.lap();
    return sent;
  }
  void finish(RankReport& report) override {
    Stopwatch watch;
    download_->finish();
    expected_.note(lists_.segments.size());
    report.generateSeconds += watch.lap();
    vdi_.lists = std::move(lists_);
  }

 private:
  std::shared_ptr<HostPool> pool_;
  Flight& flight_;
  Vdi& vdi_;
  Expectation& expected_;
  ListsOf<Segment> lists_;
  std::optional<ListDownload<Segment>> download_;
};

/// With several ranks: sends the owners' lists to the root.
template <typename Segment>
class GatherSink final : public VdiSink {
 public:
  /// On the root, `vdi` receives the lists; it, `flight` and `expected` must outlive the sink.
  GatherSink(const comm::Communicator& comm, int root, std::shared_ptr<HostPool> pool, Flight& flight,
             Vdi& vdi, Expectation& expected)
      : comm_(comm), root_(root), pool_(std::move(pool)), flight_(flight), vdi_(vdi), expected_(expected) {}

  void begin(const Vdi& header) override {
    comm_.together([&] {
      gathered_.emplace(comm_, root_, pool_, *flight_.gather, *flight_.downloads, listCountOf(header));
    });
    gathered_->begin(expected_.next());
  }
  gpu::Submission add(const Band& band, const Wait& wait, RankReport& report) override {
    Stopwatch watch;
    const std::vector<std::uint64_t> counts = comm_.gatherTogether([&] {
      wait();
      return band.lists.count;
    });
    comm_.together([&] { gathered_->send(band.lists, band.firstList, counts, band.last); });
    report.compositeSeconds += watch.lap();
    return {};
  }
  void finish(RankReport& report) override {
    Stopwatch watch;
    vdi_.lists = gathered_->finish();
    expected_.note(gathered_->total());
    report.bytesSent += flight_.gather->bytesSent();
    report.gatherSeconds = watch.lap();
  }

 private:
  const comm::Communicator& comm_;
  int root_;
  std::shared_ptr<HostPool> pool_;
  Flight& flight_;
  Vdi& vdi_;
  Expectation& expected_;
  std::optional<GatheredLists<Segment>> gathered_;
};

}  // namespace vdi::detail
