// Frames under way, and the memory that they take in turns. Not part of the library's interface.
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

class Frames;

/// State of a VdiFrame, shared with its generator until the frame completes.
struct FrameState {
  std::weak_ptr<Frames> owner;  // its generator's frames
  Vdi vdi;
  RankReport report;
  std::vector<RankReport> reports;
  /// The destination of the lists. Null once the frame is done or has failed.
  std::unique_ptr<VdiSink> sink;
  /// With several ranks, the last band reaches the sink when the next frame is under way, or at the end.
  std::function<void()> addLastBand;
  std::exception_ptr error;  // why the frame failed
};

/// Resources of a frame until its lists are on the root's host; frames take them in turns.
struct Flight {
  std::vector<OwnedLists> owned;  // one entry per band
  std::unique_ptr<Gather> gather;
  std::unique_ptr<DownloadMemory> downloads;
  std::shared_ptr<FrameState> frame;  // the last frame to use these resources
  bool underWay() const { return frame && frame->sink; }
};

class Frames {
 public:
  Frames(const std::shared_ptr<gpu::Device>& device, const comm::Communicator& comm,
         comm::Transport transport, int root);

  /// At most two frames are under way.
  std::array<Flight, 2> flights;

  bool underWay() const;
  /// The first flight without a frame under way, so that frames that do not overlap always use the same
  /// memory. If both have one, the older frame's flight: the caller must complete that frame first.
  Flight& next();
  /// Collective: hands the last bands of all frames under way to their sinks.
  void addLastBands();
  /// Waits for the submitted work and drops it. Frames under way fail with `error`.
  void drop(const std::exception_ptr& error) noexcept;

 private:
  std::size_t older_ = 0;  // index of the flight that was not taken last
};

}  // namespace vdi::detail
