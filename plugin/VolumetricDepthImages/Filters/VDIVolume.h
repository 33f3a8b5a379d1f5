// A volume on the device. The filters of one input share it: its blocks are uploaded once, and all their VDIs
// are made with the same pipelines, in the same memory. A filter keeps what belongs to one viewpoint:
// properties, transfer function, the VDI itself.
#ifndef VDIVolume_h
#define VDIVolume_h

#include <vtkType.h>

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "VDILoad.h"
#include "vdi/comm/Communicator.h"
#include "vdi/comm/Funnel.h"
#include "vdi/core/Box.h"
#include "vdi/core/Coloring.h"
#include "vdi/core/ScalarRange.h"
#include "vdi/pipeline/VdiGenerator.h"

class vtkMultiProcessController;

namespace pv {

/// Properties of the blocks, on all ranks, that a volume shows.
struct Shown {
  Origin of;
  vdi::Box bounds;
  vdi::ScalarRange range;
  std::string crowded;  // says that nearly all values fill a small part of the range; else empty
  double voxelVolume = 0.0;
  OpacityStretch stretch{};
  vdi::ScalarArray array;
  std::vector<double> values;  // a sample of the blocks' values, on the root
};

/// Collective on the controller's ranks: a number that no other object of the first rank has had.
std::uint64_t newIdentity(vtkMultiProcessController* controller);

/// Users take turns (Turn): the user that makes a VDI has the generator alone. Each group of functions names
/// its allowed callers: the main thread, the holder of the turn, or any thread. Functions marked collective
/// are collective over the controller's ranks.
class Volume {
 public:
  /// The controller must live as long as there are users; null means this rank alone. `identity` comes
  /// from newIdentity.
  Volume(vtkMultiProcessController* controller, std::uint64_t identity);
  ~Volume();  // call it on the main thread if there are several ranks: it frees a communicator
  Volume(const Volume&) = delete;
  Volume& operator=(const Volume&) = delete;
  Volume(Volume&&) = delete;
  Volume& operator=(Volume&&) = delete;

  vtkMultiProcessController* controller() const { return controller_; }
  /// Whether the volume has several ranks.
  bool hasRanks() const { return hasRanks_; }
  std::uint64_t identity() const { return identity_; }

  // Any thread may call the following.
  /// Whether there is a generator.
  bool isMade() const;
  /// Whether this rank's device was lost, or no generator can be made on it any more; it stays so.
  bool isLost() const;
  /// The shown blocks; null if there are none. The object never changes.
  std::shared_ptr<const Shown> shown() const;
  /// Whether the volume shows `origin`, or will at the end of the turns taken so far; false after a failure.
  bool targets(const Origin& origin) const;

  // Main thread.
  /// Sets the blocks that the next turn shows.
  void setTarget(const Origin& origin);
  /// Registers a user until it leaves. `wants` tells whether the user would make its next VDI from these
  /// blocks. The volume doesn't keep the user alive.
  void join(const void* user, std::function<bool(const Origin&)> wants);
  void leave(const void* user);
  /// Whether another user wants the blocks that the volume shows or will show.
  bool isWantedBesides(const void* user) const;
  /// Makes the communicator for `make` unless that was done, because no other thread may make one.
  /// Collective. Throws vdi::Error on all ranks.
  void connect();
  bool isConnected() const { return isConnected_; }
  /// Carries out the collective operations of the thread that has the turn. Returns after `most`.
  void serve(std::chrono::milliseconds most) { funnel_.serve(most); }

  // The holder of the turn.
  /// Collective: makes the generator unless it exists, with the process's device. Call `connect` before.
  /// Throws vdi::Error on all ranks.
  void make();
  vdi::VdiGenerator& generator() { return *generator_; }
  /// Collective: uploads the blocks, unless all ranks show them. After a throw the volume shows nothing.
  void show(const Load& load);
  /// Collective: throws on all ranks if any rank shows other blocks.
  void requireShown(const Origin& origin);
  vdi::comm::Funnel& funnel() { return funnel_; }

 private:
  friend class Turn;

  vtkMultiProcessController* controller_;
  bool hasRanks_;
  std::uint64_t identity_;
  std::map<const void*, std::function<bool(const Origin&)>> users_;
  vdi::comm::Funnel funnel_;
  bool isConnected_ = false;
  std::optional<vdi::comm::Communicator> comm_;  // until there is a generator, which takes it
  std::unique_ptr<vdi::VdiGenerator> generator_;
  mutable std::mutex mutex_;  // guards the members below
  bool hasFailed_ = false;
  std::shared_ptr<vdi::gpu::Device> device_;
  std::shared_ptr<const Shown> shown_;
  std::optional<Origin> target_;
  std::uint64_t lastTurn_ = 0;
  std::set<std::uint64_t> turns_;  // turns that haven't ended
  std::condition_variable turnEnded_;
};

/// The right to use a volume's generator. Turns come in the order in which they are taken, which is the same
/// on all ranks: the main thread takes them.
class Turn {
 public:
  explicit Turn(Volume& volume);  // the volume must outlive the turn
  ~Turn() { this->end(); }
  Turn(const Turn&) = delete;
  Turn& operator=(const Turn&) = delete;
  Turn(Turn&&) = delete;
  Turn& operator=(Turn&&) = delete;

  /// On the main thread: waits until all earlier turns have ended, and serves them.
  void await();
  /// On another thread: waits for the earlier turns while the main thread serves. Calls `isUnwanted` now and
  /// then, and returns false once it returns true.
  bool awaitUnless(const std::function<bool()>& isUnwanted);
  void end();

 private:
  bool awaitFor(std::chrono::milliseconds most);

  Volume& volume_;
  std::uint64_t number_;
};

/// The volumes of the process's filters. It doesn't keep them alive. Only the main thread uses it.
class Volumes {
 public:
  /// Collective: chooses a volume with a working device that shows `origin` or will show it: `own`, or
  /// another filter's, the same on all ranks. If there is none, it returns `own` if no other user wants its
  /// blocks, so that the next blocks replace the last ones; otherwise it makes a new volume. `own` is the
  /// volume of `user`, or null.
  std::shared_ptr<Volume> choose(vtkMultiProcessController* controller, const Origin& origin,
                                 const std::shared_ptr<Volume>& own, const void* user);

 private:
  std::vector<std::weak_ptr<Volume>> volumes_;
};

/// The process's volumes, which live as long as a caller holds them. Any thread may call it.
std::shared_ptr<Volumes> sharedVolumes();

}  // namespace pv

#endif
