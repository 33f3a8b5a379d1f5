// A run whose frames other processes make, one for each rank.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "catalyst_adaptor/FieldCalls.h"
#include "catalyst_adaptor/Parameters.h"
#include "catalyst_adaptor/Scripts.h"
#include "catalyst_adaptor/isolated/FrameProcess.h"
#include "catalyst_adaptor/isolated/Job.h"
#include "vdi/config/Run.h"
#include "vdi/config/Schedule.h"

namespace vdi::catalyst {

/// The run, the same on all ranks, except `json`: rank 0's counts.
struct IsolatedOptions {
  config::RunIsolation isolation;
  std::string launcher;            // empty: the usual one
  std::optional<config::Run> run;  // none: scripts
  std::optional<std::string> json;
  std::vector<Script> scripts;
};

/// All functions are collective. They return codes of vdi_catalyst.h, the same on all ranks, and report as
/// `conclude` does. The processes report their own errors.
class IsolatedRun {
 public:
  /// `self` must outlive this object.
  IsolatedRun(FieldCalls& self, IsolatedOptions options);
  ~IsolatedRun();
  IsolatedRun(const IsolatedRun&) = delete;
  IsolatedRun& operator=(const IsolatedRun&) = delete;

  /// Starts the processes, and waits until they have initialised.
  int start();
  bool wants(std::int64_t step, double time);
  /// Hands the step over if it is wanted. Returns the code of earlier steps' frames that have become known,
  /// or VDI_CATALYST_ENGINE if the processes have ended.
  int execute(std::int64_t step, double time);
  /// Waits for the frames under way, and ends the run. Returns the worst code that wasn't known yet.
  int finish();

  Parameters& parameters() { return parameters_; }

 private:
  using Clock = std::chrono::steady_clock;
  using Milliseconds = std::chrono::milliseconds;
  enum class Wait { Over, Dead, TimedOut };

  int launch(bool isGoingOn);
  int awaitStart();
  int reapDead(std::optional<std::int64_t> step);
  void end();
  /// A step of the simulation and its time.
  struct At {
    std::int64_t step;
    double time;
  };
  using Values = std::map<std::string, double>;
  int take(const DoneNotice& notice, int worst, Values& changes);
  int settle(std::int64_t done, std::optional<At> at);
  void tell(const Values& changes, const At& at) const;
  template <typename Progress>
  std::pair<Wait, std::int64_t> wait(Progress progress, std::int64_t goal, double limit);
  bool isLocallyWanted(std::int64_t step, double time, double now) const;
  int checked(std::int64_t step, double time);
  int handOver(std::int64_t step, double time, double now);
  bool isOfAny(bool answer) const;
  int leaveOut(std::int64_t step, double time);
  void tellLeftOut();
  std::vector<std::string> namedArrays() const;
  bool hasNamedFields() const;
  StepFields fieldsOf(bool namedAlone) const;
  StepFields fetched(StepFields fields);
  Setup setupOf(bool isGoingOn) const;
  double elapsed() const { return std::chrono::duration<double>(Clock::now() - begin_).count(); }
  bool isSteered() const { return options_.run && options_.run->stream && options_.run->stream->steer; }

  FieldCalls& self_;
  IsolatedOptions options_;
  int rank_ = 0;
  int size_ = 1;
  Clock::time_point begin_ = Clock::now();
  std::optional<config::Schedule> schedule_;  // only in a JSON run
  Parameters parameters_;
  std::unique_ptr<FrameProcess> process_;   // null on all ranks if the processes have ended
  std::unique_ptr<Job> job_;                // the first rank's
  std::int64_t handedOver_ = 0;             // steps since the processes' start, equal on all ranks
  std::int64_t settled_ = 0;                // number of these steps whose results all ranks know
  std::optional<std::int64_t> timedOutAt_;  // `settled_` when a wait was given up
  std::int64_t leftOut_ = 0;
  /// The first rank's: steps left out that the process doesn't know of yet, for its log.
  LeftOutSteps unreportedSkips_;
  bool hasReportedSkips_ = false;
};

}  // namespace vdi::catalyst
