// Frames that are under way, and the memory that they take in turns. Not part of the library's interface.
#pragma once

#include <array>
#include <cstddef>
#include <exception>
#include <functional>
#include <memory>
#include <vector>

#include "vdi/comm/Communicator.h"
#include "vdi/comm/Exchange.h"
#include "vdi/pipeline/DeviceLists.h"
#include "vdi/pipeline/Gather.h"
#include "vdi/pipeline/GatheredLists.h"
#include "vdi/pipeline/Reports.h"
#include "vdi/pipeline/VdiSink.h"

namespace vdi::detail {

/// State of a VdiFrame, shared with its generator until the frame completes.
struct Frame {
  Vdi vdi;
  RankReport report;
  std::vector<RankReport> reports;
  /// Where the lists go. None: the frame is done, or it has failed.
  std::unique_ptr<VdiSink> sink;
  /// With several ranks, the last band reaches the sink when the next frame is under way, or at the end.
  std::function<void()> addLastBand;
  std::exception_ptr error;  // why it failed
};

/// What a frame needs until it's on the root's host; frames take them in turns.
struct Flight {
  std::vector<OwnedLists> owned;  // by band
  std::unique_ptr<Gather> gather;
  std::unique_ptr<DownloadMemory> downloads;
  std::shared_ptr<Frame> frame;  // that uses it, or did
  bool underWay() const { return frame && frame->sink; }
};

class Frames {
 public:
  Frames(const std::shared_ptr<gpu::Device>& device, const comm::Communicator& comm,
         comm::Transport transport, int root);

  /// Two frames are under way at most.
  std::array<Flight, 2> flights;

  bool underWay() const;
  /// The first one that no frame needs any more, so that frames that don't overlap always take the same
  /// memory. If there's none, the older frame's, which is to be completed first.
  Flight& next();
  /// Collective: those that are under way hand their last band to their sinks.
  void addLastBands();
  /// Waits for what was submitted, and drops it. Frames that are under way fail with `error`.
  void drop(const std::exception_ptr& error) noexcept;

 private:
  std::size_t older_ = 0;  // of the flights, the one that wasn't taken last
};

}  // namespace vdi::detail
