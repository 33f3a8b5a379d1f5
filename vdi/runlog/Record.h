// The log of a run in situ: one record per frame, as a line of text and as a line of JSON.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "vdi/pipeline/Reports.h"

namespace vdi::runlog {

constexpr double bytesPerMebibyte = 1048576.0;

/// Wall-clock milliseconds of a stage, including waits for other ranks.
struct StageTime {
  std::string name;
  double slowest = 0.0;  // of the ranks
  double mean = 0.0;     // of the ranks
  bool operator==(const StageTime&) const = default;
};

/// The slowest and the mean of the ranks' milliseconds; requires at least one rank.
StageTime stageOf(std::string name, std::span<const double> milliseconds);

/// upload, generate, distribute, composite, gather and output, in this order; `reports` are all ranks'.
std::vector<StageTime> stagesOf(std::span<const RankReport> reports);

/// The beginning of a run.
struct RunStart {
  std::vector<std::string> fields;  // the names of those that a run without scripts shows
  int ranks = 1;
  std::int64_t unixTime = 0;  // seconds
  bool isIsolated = false;    // other processes make the frames; times are theirs, not the simulation's
  std::vector<std::string> scripts = {};  // the files of a run with scripts
  bool operator==(const RunStart&) const = default;
};

/// The names of the fields or of the scripts, for people.
std::string subjectOf(const RunStart& start);

struct FrameRecord {
  std::int64_t step = 0;
  double time = 0.0;
  std::string field;                // the field's name, if the run has several
  std::string camera;               // or the name of the script's filter; empty: the run's only one
  double milliseconds = 0.0;        // duration of the frame on the first rank
  std::vector<StageTime> stages;    // of a failed frame: none
  std::uint64_t bytesWritten = 0;   // into files
  std::uint64_t bytesSent = 0;      // between ranks, all of them together
  std::uint64_t deviceBytes = 0;    // device memory held, maximum over ranks
  std::uint64_t hostPeakBytes = 0;  // of a process so far, maximum over ranks
  std::uint64_t dropped = 0;        // frames that the stream has left out so far
  std::vector<std::string> files;   // as the run names them
  std::string error;                // of a failed frame; empty: it was made
  bool operator==(const FrameRecord&) const = default;
};

/// Adds the size of a written file to the report of its rank; a file that is gone adds nothing.
void countFile(RankReport& report, const std::string& file);
/// Fills in stages, bytes and memory from all ranks' reports.
void setReports(FrameRecord& record, std::span<const RankReport> reports);

/// A frame that was due and has not been made.
struct LeftOut {
  std::int64_t step = 0;
  double time = 0.0;
  std::string cause;
  bool operator==(const LeftOut&) const = default;
};

/// The end of a run that was finalized.
struct RunSummary {
  std::uint64_t frames = 0;  // made
  std::uint64_t failed = 0;
  std::uint64_t leftOut = 0;
  std::uint64_t dropped = 0;  // by the stream
  std::uint64_t bytesWritten = 0;
  double seconds = 0.0;              // of the run, from its start
  double waitedSeconds = 0.0;        // of these, spent on frames, failed ones included
  double longestMilliseconds = 0.0;  // of a frame
  std::vector<StageTime> stages;     // sums over frames
  bool isIsolated = false;           // as in RunStart; if not, the simulation waited for the frames
  bool operator==(const RunSummary&) const = default;

  void add(const FrameRecord& record);
};

// One line each, without the line's end.
std::string jsonLine(const RunStart& start);
std::string jsonLine(const FrameRecord& record);
std::string jsonLine(const LeftOut& frame);
std::string jsonLine(const RunSummary& summary);
std::string textLine(const RunStart& start);
std::string textLine(const FrameRecord& record);
std::string textLine(const LeftOut& frame);
std::string textLine(const RunSummary& summary);

/// The records in a log of JSON lines, of several runs if these have appended to one file.
struct RunRecords {
  std::vector<RunStart> starts;
  std::vector<FrameRecord> frames;
  std::vector<LeftOut> leftOut;
  std::vector<RunSummary> summaries;
  std::size_t skipped = 0;  // lines that aren't records, such as one cut short by a full disk
};
RunRecords parseRecords(std::string_view lines);
/// Throws Error: Io as io::InputFile, Format if no line of the file is a record or the file has more than
/// 1 GiB.
RunRecords readRecords(const std::filesystem::path& file);

}  // namespace vdi::runlog
