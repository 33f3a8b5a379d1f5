// The schedule of a run's frames, and the share of the wall time that they may take.
#pragma once

#include <cstdint>
#include <optional>

#include "vdi/config/Run.h"

namespace vdi::config {

/// A frame is due
/// - at multiples of `every` steps;
/// - at the first step at or after each multiple of `everyTime`, at most a millionth of it early, so that a
///   restart goes on with the same frames;
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

}  // namespace vdi::config
