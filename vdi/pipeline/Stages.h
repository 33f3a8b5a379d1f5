// Timing and cancellation, which all stages of a frame share. Not part of the library's interface.
#pragma once

#include <chrono>

#include "vdi/comm/Communicator.h"
#include "vdi/core/Error.h"
#include "vdi/pipeline/Reports.h"

namespace vdi::detail {

/// Measures seconds since it was made or last read.
class Stopwatch {
 public:
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    const double seconds = std::chrono::duration<double>(now - start_).count();
    start_ = now;
    return seconds;
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// Collective: runs a stage as work(report), where report(done) returns false if the stage must stop. All
/// ranks throw Cancelled together if any was told to stop. `share` is the part of the frame that is finished
/// after this stage.
template <typename Work>
void cancellable(const comm::Communicator& comm, const Progress& progress, double share, Work work) {
  const bool cancelled = comm.anyTogether([&] {
    bool stop = false;
    work([&](double done) {
      if (progress && !progress(done * share)) stop = true;
      return !stop;
    });
    return stop;
  });
  if (cancelled) throw Error(ErrorCode::Cancelled, "stopped on request");
}

}  // namespace vdi::detail
