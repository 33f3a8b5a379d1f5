// What's left of a VDI's frame when its lists are made: they come to the root's host. Not part of the
// library's interface.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "vdi/pipeline/Compositor.h"
#include "vdi/pipeline/Frames.h"
#include "vdi/pipeline/Stages.h"

namespace vdi::detail {

/// How many supersegments a VDI may have: what the last one had, and some more.
class Expectation {
 public:
  std::uint64_t next() const { return last_ + last_ / 8; }
  void note(std::uint64_t count) { last_ = count; }

 private:
  std::uint64_t last_ = 0;
};

/// With one rank: the lists, which go to the host while the device makes the next ones.
template <typename Segment>
class TailAlone final : public Tail {
 public:
  TailAlone(const std::shared_ptr<HostPool>& pool, const Flight& flight, std::uint64_t listCount,
            Expectation& expected)
      : lists_(listsIn<Segment>(pool)),
        download_(lists_, *pool, *flight.downloads, listCount, expected.next()),
        expected_(expected) {}
  ListDownload<Segment>& download() { return download_; }
  void pass(RankReport&) override {}
  void finish(Vdi& vdi, RankReport& report) override {
    Stopwatch watch;
    download_.finish();
    expected_.note(lists_.segments.size());
    report.generateSeconds += watch.lap();
    vdi.lists = std::move(lists_);
  }

 private:
  ListsOf<Segment> lists_;
  ListDownload<Segment> download_;
  Expectation& expected_;
};

/// With several ranks: the owners' lists, on their way to the root.
template <typename Segment>
class TailTogether final : public Tail {
 public:
  TailTogether(const comm::Communicator& comm, int root, const std::shared_ptr<HostPool>& pool,
               Compositor& compositor, Flight& flight, std::uint64_t listCount, Expectation& expected)
      : comm_(comm),
        compositor_(compositor),
        flight_(flight),
        gathered_(comm, root, pool, *flight.gather, *flight.downloads, listCount),
        expected_(expected) {
    gathered_.begin(expected.next());
  }

  /// Collective.
  void pass(std::size_t band) {
    const OwnedLists& own = flight_.owned[band];
    const std::vector<std::uint64_t> counts = comm_.gatherTogether([&] {
      compositor_.finish();
      return own.lists.count;
    });
    comm_.together([&] { gathered_.send(own, counts, band + 1 == flight_.owned.size()); });
    passed_ = band + 1;
  }
  void pass(RankReport& report) override {
    Stopwatch watch;
    if (passed_ < flight_.owned.size()) pass(passed_);
    report.compositeDeviceSeconds = 1e-3 * compositor_.takeMilliseconds();
    report.compositeSeconds += watch.lap();
  }
  void finish(Vdi& vdi, RankReport& report) override {
    Stopwatch watch;
    vdi.lists = gathered_.finish();
    expected_.note(gathered_.total());
    report.bytesSent += flight_.gather->bytesSent();
    report.gatherSeconds = watch.lap();
  }

 private:
  const comm::Communicator& comm_;
  Compositor& compositor_;
  Flight& flight_;
  GatheredLists<Segment> gathered_;
  Expectation& expected_;
  std::size_t passed_ = 0;  // bands
};

}  // namespace vdi::detail
