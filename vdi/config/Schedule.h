// When a run's frames are due, and which of them its share of the wall time has room for.
#pragma once

#include <cstdint>
#include <optional>

#include "vdi/config/Run.h"

namespace vdi::config {

/// A frame is due
/// - at steps that `every` divides;
/// - at the first step at or after each multiple of `everyTime`, a millionth of it early at most, so that a
///   restart goes on with the same frames;
/// - at the first step that comes `everySeconds` or more after the last such one.
/// At the first step that is handed over, the last two are due.
class Schedule {
 public:
  explicit Schedule(const Run& run)
      : every_(run.every), everyTime_(run.everyTime), everySeconds_(run.everySeconds) {}

  /// Whether only the first rank can tell: other ranks may have another clock, and another time.
  bool needsRoot() const { return everyTime_ || everySeconds_; }
  /// `now`: seconds of a clock that only rises. A time that isn't finite is never due.
  bool isDue(std::int64_t step, double time, double now) const;
  /// A frame was due at this step, whether it has been made or not.
  void begin(double time, double now);
  /// From now on at steps that this divides, and at no others.
  void setPeriod(std::int64_t steps);
  /// Steps from frame to frame; 1 where steps don't tell.
  std::int64_t period() const { return every_ > 0 ? every_ : 1; }

 private:
  std::int64_t every_;  // 0: steps don't count
  std::optional<double> everyTime_;
  std::optional<double> everySeconds_;
  std::optional<double> lastPeriod_;  // of times
  std::optional<double> lastSeconds_;
};

/// Keeps the seconds that frames take below a share of the run's: a frame is left out unless there is room
/// for one as long as the last. The first one is always made.
class Budget {
 public:
  explicit Budget(std::optional<double> share) : share_(share) {}
  bool isLimited() const { return share_.has_value(); }
  /// `elapsed`: seconds since the run's start.
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
