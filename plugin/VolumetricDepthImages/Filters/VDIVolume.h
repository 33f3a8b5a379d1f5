// A volume on the device. The filters of one input share it: its blocks are uploaded once, and all VDIs of
// them are made with the same pipelines, in the same memory. What belongs to one viewpoint stays with the
// filter: properties, transfer function, the VDI itself.
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
#include <vector>

#include "VDILoad.h"
#include "vdi/comm/Funnel.h"
#include "vdi/core/Box.h"
#include "vdi/core/Coloring.h"
#include "vdi/core/ScalarRange.h"
#include "vdi/pipeline/VdiGenerator.h"

class vtkMultiProcessController;

namespace pv {

/// What is known of the blocks that a volume shows, of all ranks.
struct Shown {
  Origin of;
  vdi::Box bounds;
  vdi::ScalarRange range;
  double voxelVolume = 0.0;
  vdi::ScalarArray array;
  std::vector<double> values;  // some of theirs; the root's
};

/// Collective on the controller's ranks: a number that no other object of the first rank has had.
std::uint64_t newIdentity(vtkMultiProcessController* controller);

/// Users take turns (Turn): who makes a VDI has the generator alone. Functions say who may call them: the
/// main thread, whoever has the turn, or any thread. Collective ones are so on the controller's ranks.
class Volume {
 public:
  /// The controller lives as long as there are users; null: there is this rank alone. `identity` is of
  /// newIdentity.
  Volume(vtkMultiProcessController* controller, std::uint64_t identity);
  ~Volume();  // with several ranks in the main thread alone: it frees a communicator
  Volume(const Volume&) = delete;
  Volume& operator=(const Volume&) = delete;
  Volume(Volume&&) = delete;
  Volume& operator=(Volume&&) = delete;

  vtkMultiProcessController* controller() const { return controller_; }
  /// Whether there are several.
  bool hasRanks() const { return hasRanks_; }
  std::uint64_t identity() const { return identity_; }

  // Any thread.
  /// Whether there is a generator.
  bool isMade() const;
  /// Whether this rank's device was lost; it stays so.
  bool isLost() const;
  /// Null while nothing is shown. What it points to never changes.
  std::shared_ptr<const Shown> shown() const;
  /// Whether that is shown, or will be at the end of the turns that were taken; false after a failure.
  bool targets(const Origin& origin) const;

  // Main thread.
  /// What the next turn shows.
  void setTarget(const Origin& origin);
  /// A user, until it leaves. `wants` tells whether it would make its next VDI of these blocks. Doesn't keep
  /// the user alive.
  void join(const void* user, std::function<bool(const Origin&)> wants);
  void leave(const void* user);
  /// Whether another user wants what is shown, or will be.
  bool isWantedBesides(const void* user) const;
  /// Makes the generator unless there is one, with the process's device. Collective on several ranks; there
  /// the first user calls it, since no other thread may make a communicator. Alone, it needs the turn.
  /// Throws vdi::Error on all ranks.
  void make();
  /// Carries on what the thread that has the turn does together with other ranks. Returns after `most`.
  void serve(std::chrono::milliseconds most) { funnel_.serve(most); }

  // Whoever has the turn.
  vdi::VdiGenerator& generator() { return *generator_; }
  /// Collective: uploads the blocks, unless they are shown on all ranks. After a throw nothing is shown.
  void show(const Load& load);
  /// Collective: throws on all ranks where any doesn't show that.
  void requireShown(const Origin& origin);
  vdi::comm::Funnel& funnel() { return funnel_; }

 private:
  friend class Turn;

  vtkMultiProcessController* controller_;
  bool hasRanks_;
  std::uint64_t identity_;
  std::map<const void*, std::function<bool(const Origin&)>> users_;
  vdi::comm::Funnel funnel_;
  std::unique_ptr<vdi::VdiGenerator> generator_;
  mutable std::mutex mutex_;  // of all that follows
  std::shared_ptr<vdi::gpu::Device> device_;
  std::shared_ptr<const Shown> shown_;
  std::optional<Origin> target_;
  std::uint64_t lastTurn_ = 0;
  std::set<std::uint64_t> turns_;  // that haven't ended
  std::condition_variable turnEnded_;
};

/// The right to use a volume's generator. Turns come in the order in which they are taken, which is the same
/// on all ranks: the main thread takes them.
class Turn {
 public:
  explicit Turn(Volume& volume);  // must outlive the turn
  ~Turn() { this->end(); }
  Turn(const Turn&) = delete;
  Turn& operator=(const Turn&) = delete;
  Turn(Turn&&) = delete;
  Turn& operator=(Turn&&) = delete;

  /// Main thread: waits until all earlier turns have ended, and serves them.
  void await();
  /// Another thread: likewise, while the main thread serves. Asks `isUnwanted` now and then, and returns
  /// false once that is so.
  bool awaitUnless(const std::function<bool()>& isUnwanted);
  void end();

 private:
  bool awaitFor(std::chrono::milliseconds most);

  Volume& volume_;
  std::uint64_t number_;
};

/// The volumes of the process's filters, which it doesn't keep alive. Main thread.
class Volumes {
 public:
  /// Collective: a volume that shows `origin`, or will, and whose device isn't lost: `own`, or another
  /// filter's, the same on all ranks. Where there is none: `own` if nobody else wants what it shows, so that
  /// the next blocks take the place of the last ones; else a new one. `own`, null if there is none, is that
  /// of `user`.
  std::shared_ptr<Volume> choose(vtkMultiProcessController* controller, const Origin& origin,
                                 const std::shared_ptr<Volume>& own, const void* user);

 private:
  std::vector<std::weak_ptr<Volume>> volumes_;
};

}  // namespace pv

#endif
