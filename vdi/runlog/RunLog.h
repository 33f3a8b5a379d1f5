// Writes a run's log during the run.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>

#include "vdi/runlog/Record.h"

namespace vdi::runlog {

/// The log's files, of which at least one is set.
struct LogFiles {
  std::optional<std::filesystem::path> json;
  std::optional<std::filesystem::path> text;
};

/// A log that one rank writes. It appends each line at once, whole or not at all, so that the log of a killed
/// run ends with its last frame.
class RunLog {
 public:
  enum class Before { Stays, Goes };  // whether the files keep their old content
  /// Makes folders and files if need be. Throws Error{Io} with the path, and then removes the files that it
  /// has made.
  RunLog(const LogFiles& files, const RunStart& start, Before before = Before::Stays);
  /// Doesn't write the summary.
  ~RunLog();
  RunLog(const RunLog&) = delete;
  RunLog& operator=(const RunLog&) = delete;

  /// Appends a line to each file. Throws Error{Io} if that fails for one, after the other file got its line.
  void add(const FrameRecord& record);
  void add(const LeftOut& frame);  // throws as above
  /// Appends a line for a step that the simulation of an isolated run didn't hand over, because two earlier
  /// frames were still to be made. Throws as above.
  void addNotHandedOver(std::int64_t step, double time);
  const RunSummary& soFar() const { return summary_; }
  /// Appends the summary, and returns it. Throws as add.
  RunSummary finish();

 private:
  class Appended;
  void append(const std::string& json, const std::string& text);

  std::unique_ptr<Appended> json_;
  std::unique_ptr<Appended> text_;
  RunSummary summary_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace vdi::runlog
