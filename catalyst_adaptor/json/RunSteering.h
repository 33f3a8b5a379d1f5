// Applies the requests of a stream's viewers on all ranks, after the same step.
#pragma once

#include <cstdint>
#include <exception>
#include <string>

#include "catalyst_adaptor/Parameters.h"
#include "vdi/comm/Communicator.h"
#include "vdi/config/Run.h"
#include "vdi/config/Schedule.h"
#include "vdi/core/ScalarRange.h"
#include "vdi/stream/LiveStream.h"
#include "vdi/stream/Steering.h"

namespace vdi::catalyst {

/// The parts of the engine that viewers change, equal on all ranks. Colours are those of the run's first
/// field, which the stream shows.
struct Steered {
  config::Run& run;
  config::Schedule& schedule;
  const std::optional<ScalarRange>& range;  // range of the colours if the run has none
  Parameters& parameters;
};

class RunSteering {
 public:
  /// `stream` is null on all ranks but the first. Both arguments must outlive this object.
  RunSteering(const comm::Communicator& comm, stream::LiveStream* stream) : comm_(comm), stream_(stream) {}

  /// Collective: applies the viewers' requests since the last call, and logs them with this step. While
  /// viewers pause the simulation, it waits for more. Returns whether a request changes the VDI.
  bool take(const Steered& steered, std::int64_t step, double time);
  /// Collective: throws Error{Io} on all ranks if a line of the log couldn't be written since the last call.
  void requireLogged();
  bool isPaused() const { return isPaused_; }

 private:
  stream::Controls controlsOf(const Steered& steered) const;
  void apply(const stream::Wish& wish, const Steered& steered);
  void tell(const stream::SteeringRequest& request, const std::string& log, std::int64_t step, double time);

  const comm::Communicator& comm_;
  stream::LiveStream* stream_;
  bool isPaused_ = false;
  std::exception_ptr trouble_;  // an error of the log
};

}  // namespace vdi::catalyst
