// Makes what a run asks for (vdi/config/Run.h) by vdi/pipeline, without ParaView and Python.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "catalyst_adaptor/json/Fields.h"
#include "vdi/config/ColorMap.h"
#include "vdi/config/Run.h"
#include "vdi/core/Vdi.h"
#include "vdi/runlog/Record.h"

namespace vdi::catalyst {

/// All functions but `wants` are collective. When one throws, it does so on all ranks, with Error{RemoteRank}
/// or std::runtime_error where another rank has more to tell, and the next frame is tried anew.
class RunEngine {
 public:
  /// `map` is that of the colours' file, if the run names one. Finds the device, and starts the stream on the
  /// first rank, so that what is wrong with either is known before the first step.
  RunEngine(int fortranCommunicator, config::Run run, std::optional<config::ColorMap> map);
  /// Hands the last frame over to the stream.
  ~RunEngine();
  RunEngine(const RunEngine&) = delete;
  RunEngine& operator=(const RunEngine&) = delete;

  bool wants(std::int64_t step) const { return step >= 0 && run_.wants(step); }
  /// Makes the step's frame from the fields as they are now. `waited` is how many seconds this rank has
  /// waited for the others to begin the step.
  void execute(const Fields& fields, std::int64_t step, double time, double waited);
  /// Ends the log. No more frames.
  void finish();

 private:
  struct State;
  struct Frame;
  void makeOrRetry(const Fields& fields, std::int64_t step, double time, runlog::FrameRecord& record);
  void make(const Fields& fields, std::int64_t step, double time, runlog::FrameRecord& record);
  Frame frameOf(const Fields& fields, std::int64_t step, double time);
  void deliver(const Frame& frame, std::int64_t step, runlog::FrameRecord& record);
  void save(Vdi vdi, std::int64_t step, runlog::FrameRecord& record);
  void noteFiles(std::int64_t step, runlog::FrameRecord& record);
  std::vector<double> millisecondsOfRanks(double seconds) const;

  config::Run run_;
  std::optional<config::ColorMap> map_;
  std::unique_ptr<State> state_;
};

}  // namespace vdi::catalyst
