#include "vdi/config/Schedule.h"

#include <cmath>

namespace vdi::config {

bool Schedule::isDue(std::int64_t step, double time, double now) const {
  if (every_ > 0 && step % every_ == 0) return true;
  if (everySeconds_ && (!lastSeconds_ || now >= *lastSeconds_ + *everySeconds_)) return true;
  // A simulation may go back in time, for example to its last checkpoint.
  return everyTime_ && std::isfinite(time) && (!lastPeriod_ || periodsIn(time, *everyTime_) != *lastPeriod_);
}

void Schedule::begin(double time, double now) {
  if (everySeconds_ && (!lastSeconds_ || now >= *lastSeconds_ + *everySeconds_)) lastSeconds_ = now;
  if (everyTime_ && std::isfinite(time)) lastPeriod_ = periodsIn(time, *everyTime_);
}

void Schedule::setPeriod(std::int64_t steps) {
  every_ = steps;
  everyTime_.reset();
  everySeconds_.reset();
}

}  // namespace vdi::config
