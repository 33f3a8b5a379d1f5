// Carries out a run (vdi/config/Run.h) with vdi/pipeline, without ParaView and Python.
#pragma once

#include <chrono>
#include <cstdint>
#include <exception>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "catalyst_adaptor/Fields.h"
#include "catalyst_adaptor/Parameters.h"
#include "vdi/config/Run.h"
#include "vdi/core/FunctionRef.h"
#include "vdi/core/Vdi.h"
#include "vdi/runlog/Record.h"

namespace vdi::catalyst {

/// All functions are collective unless their comments say otherwise. When one throws, it throws on all ranks,
/// with Error{RemoteRank} or std::runtime_error if another rank reports more. The next frame is tried again.
class RunEngine {
 public:
  /// Not collective. `comm` is a duplicate of `fortranCommunicator`. The colours' files are read.
  RunEngine(int fortranCommunicator, comm::Communicator comm, config::Run run);
  /// Hands the last frame over to the stream.
  ~RunEngine();
  RunEngine(const RunEngine&) = delete;
  RunEngine& operator=(const RunEngine&) = delete;

  /// Call once, first. Finds the device, and starts the stream on the first rank, so that errors of either
  /// are known before the first step. `isIsolated` tells the log that this process only makes frames.
  void start(bool isIsolated);
  /// Whether the step may have a frame. This depends on the schedule, but not on conditions on the data. If
  /// only the first rank can tell, the others return false. Not collective.
  bool wants(std::int64_t step, double time) const;
  /// Whether `execute` has anything to do at the step; equal on all ranks. Not collective.
  bool mayExecute(std::int64_t step, double time) const;
  /// Makes the step's frames, if any, from the current fields, and takes the viewers' requests. `waited` is
  /// the time in seconds that this rank has waited for the others to begin the step. Particles become arrays
  /// for this time, if a frame or its condition needs them.
  void execute(Fields& fields, Parameters& parameters, std::int64_t step, double time, double waited);
  /// Sets the clock by which the schedule decides on the next step, in seconds since the run's start, instead
  /// of this process's own. Not collective; the first rank's counts.
  void setClock(double seconds);
  /// Logs a step at which a frame was due, and which the simulation didn't hand over. Not collective.
  void logLeftOut(std::int64_t step, double time) noexcept;
  /// Ends the log. No frames may follow.
  void finish();

 private:
  struct State;
  struct LoadedFrame;
  struct Shown;
  using Clock = std::chrono::steady_clock;
  void open(bool isIsolated);
  bool isDue(std::int64_t step, double time);
  void deposit(Fields& fields, const std::string& name, std::int64_t step);
  bool shouldRender(Fields& fields, std::int64_t step, double time);
  bool hasWallTime(std::int64_t step, double time);
  bool hasHostMemory(std::int64_t step, double time);
  void leaveOut(std::int64_t step, double time, bool& hasTold, FunctionRef<std::string()> causeText);
  void makeAll(Fields& fields, std::int64_t step, double time, double waited, bool isForFiles);
  void makeOne(Fields& fields, std::int64_t step, double time, const Shown& shown, bool isForFiles,
               runlog::FrameRecord& record);
  void throwFailures();
  void record(runlog::FrameRecord& record, const std::exception_ptr& failure,
              FunctionRef<void(const char* error)> failed, const std::vector<double>& waits,
              Clock::time_point start);
  void steer(Fields& fields, Parameters& parameters, std::int64_t step, double time);
  template <typename Work>
  void tryTwice(Work work);
  bool isFirst(const Shown& shown) const;
  void prepare(Fields& fields, std::int64_t step, double time, const config::RunField& field);
  void noteRange(const config::RunField& field, const ScalarRange& range) const;
  void deliver(const Shown& shown, bool isForFiles, runlog::FrameRecord& record);
  void save(Vdi vdi, const Shown& shown, bool isForFiles, runlog::FrameRecord& record);
  void writePictures(const Vdi& vdi, const Shown& shown, runlog::FrameRecord& record);
  void noteLatest(const Shown& shown) const;
  std::vector<double> millisecondsOfRanks(double seconds) const;

  config::Run run_;
  std::unique_ptr<State> state_;
};

}  // namespace vdi::catalyst
