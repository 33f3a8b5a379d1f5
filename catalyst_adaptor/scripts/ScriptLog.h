// The log of a run with scripts, which the first rank writes.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "vdi/pipeline/Reports.h"
#include "vdi/runlog/RunLog.h"

namespace vdi::catalyst {

/// A VDI or a picture that scripts have made in a step.
struct MadeFrame {
  const void* filter = nullptr;                 // identifies the script's filter
  std::string name;                             // the filter's; empty if the scripts have no other
  std::chrono::steady_clock::time_point begin;  // of the filter's update
  std::vector<RankReport> reports;              // of all ranks
  std::vector<std::string> files;               // made from the frame by extractors of ours
  std::uint64_t dropped = 0;                    // frames that a stream has left out so far
};

class ScriptLog {
 public:
  /// The files that VDI_LOG names; nullopt if it is unset. Throws Error{InvalidArgument} if it names two
  /// files of one kind.
  static std::optional<runlog::LogFiles> filesFromEnvironment();

  /// Throws Error{Io} as RunLog.
  ScriptLog(const runlog::LogFiles& files, const runlog::RunStart& start);

  struct Step {
    std::int64_t number = 0;
    double time = 0.0;
    std::chrono::steady_clock::time_point begin;
  };
  /// Receives each rank's wait for the slowest rank to begin the step, in ms: [ranks].
  std::span<double> waits() { return waits_; }
  /// Appends a line for each frame and, unless `error` is empty, one for the step's failure. The frames share
  /// the time since the step's beginning: each ends where the next one begins. Throws Error{Io}.
  void add(const Step& step, std::vector<MadeFrame> frames, const std::string& error);
  /// Appends a line for a step that the simulation didn't hand over. Throws Error{Io}.
  void addLeftOut(std::int64_t step, double time);
  /// Appends the summary, and returns it as a line of text. Throws Error{Io}.
  std::string finish();

 private:
  runlog::RunLog log_;
  std::vector<double> waits_;
};

}  // namespace vdi::catalyst
