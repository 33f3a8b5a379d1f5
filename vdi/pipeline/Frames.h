// Frames that are under way, and the memory that they take in turns. Not part of the library's interface.
#pragma once

#include <array>
#include <cstddef>
#include <exception>
#include <memory>
#include <vector>

#include "vdi/comm/Communicator.h"
#include "vdi/comm/Exchange.h"
#include "vdi/pipeline/DeviceLists.h"
#include "vdi/pipeline/Gather.h"
#include "vdi/pipeline/GatheredLists.h"
#include "vdi/pipeline/Pipeline.h"

namespace vdi::detail {

/// What's left of a frame when its lists are made.
class Tail {
 public:
  Tail() = default;
  virtual ~Tail() = default;
  Tail(const Tail&) = delete;
  Tail& operator=(const Tail&) = delete;
  Tail(Tail&&) = delete;
  Tail& operator=(Tail&&) = delete;
  /// Collective: sends on what was composited last. The next frame may be made then.
  virtual void pass(RankReport& report) = 0;
  /// Collective: waits until the VDI has its lists.
  virtual void finish(Vdi& vdi, RankReport& report) = 0;
};

/// What VdiFrame is. Its generator has it too, as long as something is to be done.
struct Frame {
  Vdi vdi;
  RankReport report;
  std::vector<RankReport> reports;
  std::unique_ptr<Tail> tail;  // none: done, or failed
  bool passed = false;
  std::exception_ptr error;
};

/// What a frame needs until it's on the root's host; frames take them in turns.
struct Flight {
  std::vector<OwnedLists> owned;  // by band
  std::unique_ptr<Gather> gather;
  std::unique_ptr<DownloadMemory> downloads;
  std::shared_ptr<Frame> frame;  // that uses it, or did
  bool underWay() const { return frame && frame->tail; }
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
  /// Collective: those that are under way send on what was composited.
  void passOn();
  /// Waits for what was submitted, and drops it. Frames that are under way fail with the exception that's
  /// being handled.
  void drop() noexcept;

 private:
  std::size_t older_ = 0;  // of the flights, the one that wasn't taken last
};

}  // namespace vdi::detail
