// The schedule of a run's frames, the share of the wall time that they may take, and the memory of a process.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

#include "vdi/config/Run.h"

namespace vdi::config {

/// A frame is due
/// - at multiples of `every` steps;
/// - at the first step at or after each multiple of `everyTime`, at most a millionth of it early, so that a
///   restart continues with the same frames;
/// - at the first step that comes `everySeconds` or more after the last step that was due by this rule.
/// At the simulation's first step, the last two conditions hold.
class Schedule {
 public:
  explicit Schedule(const Run& run)
      : every_(run.every), everyTime_(run.everyTime), everySeconds_(run.everySeconds) {}

  /// True if only the first rank can tell whether a frame is due: other ranks' clocks and times may differ.
  bool needsRoot() const { return everyTime_ || everySeconds_; }
  /// `now` is in seconds of a monotonic clock. A time that isn't finite is never due.
  bool isDue(std::int64_t step, double time, double now) const;
  /// Notes that a frame was due at this step, whether or not it has been made.
  void begin(double time, double now);
  /// From now on, frames are due only at multiples of `steps`.
  void setPeriod(std::int64_t steps);
  /// The number of steps from frame to frame; 1 if steps don't matter.
  std::int64_t period() const { return every_ > 0 ? every_ : 1; }

 private:
  std::int64_t every_;  // 0: steps don't count
  std::optional<double> everyTime_;
  std::optional<double> everySeconds_;
  std::optional<double> lastPeriod_;  // last period of `everyTime` with a frame
  std::optional<double> lastSeconds_;
};

/// Keeps the seconds that frames take below a share of the run's. A frame is left out unless there is room
/// for one as long as the last. The first frame is always made.
class WallTimeShare {
 public:
  explicit WallTimeShare(std::optional<double> share) : share_(share) {}
  bool isLimited() const { return share_.has_value(); }
  /// `elapsed` is in seconds since the run's start.
  bool hasRoom(double elapsed) const { return !share_ || spent_ + last_ <= *share_ * (elapsed + last_); }
  void spend(double seconds) {
    spent_ += seconds;
    last_ = seconds;
  }
  double spent() const { return spent_; }
  double share() const { return share_.value_or(1.0); }

 private:
  std::optional<double> share_;
  double spent_ = 0.0;
  double last_ = 0.0;
};

/// Keeps the memory of a process within a bound. A frame is left out if the process would need too much in
/// case the frame uses as much as the most expensive one so far. Memory that earlier frames have left for
/// later ones counts once.
class HostMemoryBound {
 public:
  /// Bytes of host memory in use, and the most since the process's start.
  struct Use {
    std::uint64_t now = 0;
    std::uint64_t peak = 0;
  };
  explicit HostMemoryBound(std::optional<std::int64_t> mebibytes) : mebibytes_(mebibytes) {}
  bool isSet() const { return mebibytes_.has_value(); }
  std::int64_t mebibytes() const { return mebibytes_.value_or(0); }
  /// The bytes that the process would have in the next frame.
  std::uint64_t needed(const Use& use) const { return std::max(use.now, withoutFrames(use) + mostUsed_); }
  bool hasRoom(std::uint64_t needed) const {
    return !mebibytes_ || needed <= static_cast<std::uint64_t>(*mebibytes_) << 20U;
  }
  /// Call after each frame. Within one, the peak is known only if it exceeds all earlier ones.
  void spend(const Use& before, const Use& after) {
    const std::uint64_t most = after.peak > before.peak ? after.peak : after.now;
    const std::uint64_t others = withoutFrames(before);
    mostUsed_ = std::max(mostUsed_, most - std::min(most, others));
    keep(before, after);
  }
  /// Call when memory that frames have left has been freed.
  void free(const Use& before, const Use& after) { keep(before, after); }

 private:
  std::uint64_t withoutFrames(const Use& use) const { return use.now - std::min(use.now, kept_); }
  void keep(const Use& before, const Use& after) {
    const std::uint64_t all = kept_ + after.now;
    kept_ = all - std::min(all, before.now);
  }

  std::optional<std::int64_t> mebibytes_;
  std::uint64_t mostUsed_ = 0;
  std::uint64_t kept_ = 0;  // between frames, for later ones
};

}  // namespace vdi::config
