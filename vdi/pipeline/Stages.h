// What all stages of a frame have in common: they're timed and can be stopped. Not part of the library's
// interface.
#pragma once

#include <chrono>

#include "vdi/comm/Communicator.h"
#include "vdi/core/Error.h"
#include "vdi/pipeline/Reports.h"

namespace vdi::detail {

/// Seconds since it was made or last asked.
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

/// Collective: runs a stage that asks for progress, as work(report), report(done) being false when it's to
/// stop. All ranks throw Cancelled together if any was told to stop. `share`: of the frame, when it's done.
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
