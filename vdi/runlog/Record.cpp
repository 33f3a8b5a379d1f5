#include "vdi/runlog/Record.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <nlohmann/json.hpp>
#include <utility>

#include "vdi/core/Error.h"
#include "vdi/io/Files.h"
#include "vdi/io/JsonText.h"

namespace vdi::runlog {

namespace {

using io::JsonObject;
using io::jsonOf;
using Json = nlohmann::ordered_json;

constexpr double millisecondsPerSecond = 1e3;
constexpr std::uint64_t largestFile = std::uint64_t{1} << 30;

struct Stage {
  const char* name;
  double RankReport::*seconds;
};
constexpr std::array<Stage, 6> stages{{{"upload", &RankReport::uploadSeconds},
                                       {"generate", &RankReport::generateSeconds},
                                       {"distribute", &RankReport::distributeSeconds},
                                       {"composite", &RankReport::compositeSeconds},
                                       {"gather", &RankReport::gatherSeconds},
                                       {"output", &RankReport::outputSeconds}}};

/// Rounds to microseconds.
double rounded(double milliseconds) {
  return std::round(milliseconds * millisecondsPerSecond) / millisecondsPerSecond;
}

std::string listOf(const std::vector<std::string>& texts) {
  std::vector<std::string> items;
  items.reserve(texts.size());
  for (const std::string& text : texts) items.push_back(jsonOf(text));
  return io::jsonListOf(items);
}

std::string stagesJson(const std::vector<StageTime>& times) {
  JsonObject object;
  for (const StageTime& stage : times) {
    object.add(stage.name, JsonObject()
                               .add("slowest", jsonOf(rounded(stage.slowest)))
                               .add("mean", jsonOf(rounded(stage.mean)))
                               .text());
  }
  return object.text();
}

std::vector<StageTime> stagesFrom(const Json& object) {
  std::vector<StageTime> times;
  for (const auto& [name, stage] : object.items())
    times.push_back({name, stage.at("slowest").get<double>(), stage.at("mean").get<double>()});
  return times;
}

RunStart startFrom(const Json& line) {
  RunStart start;
  if (line.contains("scripts")) {
    start.scripts = line.at("scripts").get<std::vector<std::string>>();
  } else if (line.contains("fields")) {
    start.fields = line.at("fields").get<std::vector<std::string>>();
  } else {
    start.fields = {line.at("field").get<std::string>()};
  }
  start.ranks = line.at("ranks").get<int>();
  start.unixTime = line.at("unix_time").get<std::int64_t>();
  start.isIsolated = line.value("isolated", false);
  return start;
}

FrameRecord frameFrom(const Json& line) {
  FrameRecord record;
  record.step = line.at("step").get<std::int64_t>();
  record.time = line.at("time").is_null() ? std::nan("") : line.at("time").get<double>();
  record.field = line.value("field", "");
  record.camera = line.value("camera", "");
  record.milliseconds = line.at("ms").get<double>();
  record.stages = stagesFrom(line.at("stages"));
  record.bytesWritten = line.at("bytes_written").get<std::uint64_t>();
  record.bytesSent = line.at("bytes_sent").get<std::uint64_t>();
  record.deviceBytes = line.at("device_bytes").get<std::uint64_t>();
  record.hostPeakBytes = line.at("host_peak_bytes").get<std::uint64_t>();
  record.dropped = line.at("dropped").get<std::uint64_t>();
  record.files = line.at("files").get<std::vector<std::string>>();
  record.error = line.value("error", "");
  return record;
}

LeftOut leftOutFrom(const Json& line) {
  return {line.at("step").get<std::int64_t>(),
          line.at("time").is_null() ? std::nan("") : line.at("time").get<double>(),
          line.at("cause").get<std::string>()};
}

RunSummary summaryFrom(const Json& line) {
  RunSummary summary;
  summary.frames = line.at("frames").get<std::uint64_t>();
  summary.failed = line.at("failed").get<std::uint64_t>();
  summary.leftOut = line.value("left_out", std::uint64_t{0});  // older logs have none
  summary.dropped = line.at("dropped").get<std::uint64_t>();
  summary.bytesWritten = line.at("bytes_written").get<std::uint64_t>();
  summary.seconds = line.at("seconds").get<double>();
  summary.waitedSeconds = line.at("waited_seconds").get<double>();
  summary.longestMilliseconds = line.at("longest_ms").get<double>();
  summary.stages = stagesFrom(line.at("stages"));
  summary.isIsolated = line.value("isolated", false);
  return summary;
}

/// Throws nlohmann's exception for a line that lacks a field or has another kind of value in it.
bool take(const Json& line, RunRecords& records) {
  if (!line.is_object()) return false;
  const std::string event = line.at("event").get<std::string>();
  if (event == "start") {
    records.starts.push_back(startFrom(line));
  } else if (event == "frame") {
    records.frames.push_back(frameFrom(line));
  } else if (event == "left_out") {
    records.leftOut.push_back(leftOutFrom(line));
  } else if (event == "end") {
    records.summaries.push_back(summaryFrom(line));
  } else {
    return false;
  }
  return true;
}

std::string mebibytes(std::uint64_t bytes) {
  return fmt::format("{:.2f} MiB", static_cast<double>(bytes) / bytesPerMebibyte);
}

std::string stagesText(const std::vector<StageTime>& times) {
  std::string text;
  for (const StageTime& stage : times) {
    text +=
        fmt::format("{}{} {:.1f} ({:.1f})", text.empty() ? "" : ", ", stage.name, stage.slowest, stage.mean);
  }
  return text;
}

/// Replaces the line ends of a message with spaces.
std::string onOneLine(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < ' '; }, ' ');
  return text;
}

}  // namespace

std::string subjectOf(const RunStart& start) {
  std::string names;
  for (const std::string& field : start.fields) names += (names.empty() ? "" : ", ") + field;
  for (const std::string& script : start.scripts)
    names += (names.empty() ? "" : ", ") + std::filesystem::path(script).filename().string();
  return names;
}

StageTime stageOf(std::string name, std::span<const double> milliseconds) {
  StageTime time{std::move(name)};
  for (const double rank : milliseconds) {
    time.slowest = std::max(time.slowest, rank);
    time.mean += rank / static_cast<double>(milliseconds.size());
  }
  return time;
}

std::vector<StageTime> stagesOf(std::span<const RankReport> reports) {
  std::vector<StageTime> times;
  std::vector<double> milliseconds(reports.size());
  for (const Stage& stage : stages) {
    std::transform(reports.begin(), reports.end(), milliseconds.begin(),
                   [&](const RankReport& report) { return report.*stage.seconds * millisecondsPerSecond; });
    times.push_back(stageOf(stage.name, milliseconds));
  }
  return times;
}

void countFile(RankReport& report, const std::string& file) {
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(file, error);
  if (!error) report.bytesWritten += bytes;
}

void setReports(FrameRecord& record, std::span<const RankReport> reports) {
  record.stages = stagesOf(reports);
  for (const RankReport& report : reports) {
    record.bytesWritten += report.bytesWritten;
    record.bytesSent += report.bytesSent;
    record.deviceBytes = std::max(record.deviceBytes, report.deviceBytes);
    record.hostPeakBytes = std::max(record.hostPeakBytes, report.hostPeakBytes);
  }
}

void RunSummary::add(const FrameRecord& record) {
  ++(record.error.empty() ? frames : failed);
  dropped = std::max(dropped, record.dropped);
  bytesWritten += record.bytesWritten;
  waitedSeconds += record.milliseconds / millisecondsPerSecond;
  longestMilliseconds = std::max(longestMilliseconds, record.milliseconds);
  for (const StageTime& stage : record.stages) {
    auto sum =
        std::find_if(stages.begin(), stages.end(), [&](const StageTime& s) { return s.name == stage.name; });
    if (sum == stages.end()) sum = stages.insert(stages.end(), {stage.name});
    sum->slowest += stage.slowest;
    sum->mean += stage.mean;
  }
}

std::string jsonLine(const RunStart& start) {
  JsonObject line;
  line.add("event", jsonOf("start"));
  if (!start.scripts.empty()) {
    line.add("scripts", listOf(start.scripts));
  } else if (start.fields.size() == 1) {
    line.add("field", jsonOf(start.fields.front()));
  } else {
    line.add("fields", listOf(start.fields));
  }
  line.add("ranks", jsonOf(start.ranks));
  line.add("unix_time", jsonOf(start.unixTime));
  if (start.isIsolated) line.add("isolated", "true");
  return line.text();
}

std::string jsonLine(const FrameRecord& record) {
  JsonObject line;
  line.add("event", jsonOf("frame")).add("step", jsonOf(record.step)).add("time", jsonOf(record.time));
  if (!record.field.empty()) line.add("field", jsonOf(record.field));
  if (!record.camera.empty()) line.add("camera", jsonOf(record.camera));
  line.add("ms", jsonOf(rounded(record.milliseconds)));
  line.add("stages", stagesJson(record.stages));
  line.add("bytes_written", jsonOf(record.bytesWritten));
  line.add("bytes_sent", jsonOf(record.bytesSent));
  line.add("device_bytes", jsonOf(record.deviceBytes));
  line.add("host_peak_bytes", jsonOf(record.hostPeakBytes));
  line.add("dropped", jsonOf(record.dropped));
  line.add("files", listOf(record.files));
  if (!record.error.empty()) line.add("error", jsonOf(record.error));
  return line.text();
}

std::string jsonLine(const LeftOut& frame) {
  return JsonObject()
      .add("event", jsonOf("left_out"))
      .add("step", jsonOf(frame.step))
      .add("time", jsonOf(frame.time))
      .add("cause", jsonOf(frame.cause))
      .text();
}

std::string jsonLine(const RunSummary& summary) {
  JsonObject line;
  line.add("event", jsonOf("end"))
      .add("frames", jsonOf(summary.frames))
      .add("failed", jsonOf(summary.failed))
      .add("left_out", jsonOf(summary.leftOut))
      .add("dropped", jsonOf(summary.dropped))
      .add("bytes_written", jsonOf(summary.bytesWritten))
      .add("seconds", jsonOf(rounded(summary.seconds)))
      .add("waited_seconds", jsonOf(rounded(summary.waitedSeconds)))
      .add("longest_ms", jsonOf(rounded(summary.longestMilliseconds)))
      .add("stages", stagesJson(summary.stages));
  if (summary.isIsolated) line.add("isolated", "true");
  return line.text();
}

std::string textLine(const RunStart& start) {
  const std::time_t seconds = start.unixTime;
  std::tm parts{};
  std::array<char, 32> when{};
  if (::gmtime_r(&seconds, &parts) != nullptr)
    (void)std::strftime(when.data(), when.size(), "%Y-%m-%d %H:%M:%S", &parts);
  return fmt::format("run of {}, {} rank{}, {} UTC; ms of the slowest rank (of the mean rank)",
                     onOneLine(subjectOf(start)), start.ranks, start.ranks == 1 ? "" : "s", when.data());
}

std::string textLine(const FrameRecord& record) {
  std::string line = fmt::format("step {}, time {:g}", record.step, record.time);
  if (!record.field.empty()) line += ", " + record.field;
  if (!record.camera.empty()) line += ", " + record.camera;
  line += fmt::format(": {:.1f} ms", record.milliseconds);
  if (!record.error.empty()) return line + ", failed: " + onOneLine(record.error);
  line += fmt::format(": {}; {} written, {} sent", stagesText(record.stages), mebibytes(record.bytesWritten),
                      mebibytes(record.bytesSent));
  if (record.dropped > 0) line += fmt::format("; {} dropped so far", record.dropped);
  for (const std::string& file : record.files) line += "; " + onOneLine(file);
  return line;
}

std::string textLine(const LeftOut& frame) {
  return fmt::format("step {}, time {:g}: left out: {}", frame.step, frame.time, onOneLine(frame.cause));
}

std::string textLine(const RunSummary& summary) {
  const std::uint64_t all = summary.frames + summary.failed;
  const double share = summary.seconds > 0.0 ? 100.0 * summary.waitedSeconds / summary.seconds : 0.0;
  std::string line = fmt::format("{} frame{} made, {} failed, ", summary.frames,
                                 summary.frames == 1 ? "" : "s", summary.failed);
  if (summary.leftOut > 0) line += fmt::format("{} left out, ", summary.leftOut);
  line +=
      fmt::format("{} dropped by the stream; {} written", summary.dropped, mebibytes(summary.bytesWritten));
  line += fmt::format("; {} {:.2f} s of {:.2f} s ({:.1f} %)",
                      summary.isIsolated ? "frames in separate processes took" : "the simulation waited",
                      summary.waitedSeconds, summary.seconds, share);
  if (all > 0) {
    line += fmt::format(", {:.1f} ms a frame, {:.1f} ms at most",
                        summary.waitedSeconds * millisecondsPerSecond / static_cast<double>(all),
                        summary.longestMilliseconds);
  }
  if (!summary.stages.empty()) line += "; sums: " + stagesText(summary.stages);
  return line;
}

RunRecords parseRecords(std::string_view lines) {
  RunRecords records;
  while (!lines.empty()) {
    const std::size_t end = std::min(lines.find('\n'), lines.size());
    const std::string_view line = lines.substr(0, end);
    lines.remove_prefix(std::min(end + 1, lines.size()));
    if (line.find_first_not_of(" \t\r") == std::string_view::npos) continue;
    bool taken = false;
    try {
      taken = take(Json::parse(line), records);
    } catch (const Json::exception&) {
      taken = false;  // counted below, and reported by the caller
    }
    if (!taken) ++records.skipped;
  }
  return records;
}

RunRecords readRecords(const std::filesystem::path& path) {
  const io::InputFile file(path);
  if (file.size() > largestFile) {
    throw Error(ErrorCode::Format, fmt::format("{} bytes are too many for a log", file.size()),
                path.string());
  }
  const std::vector<std::byte> bytes = file.readAll();
  RunRecords records = parseRecords({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  if (records.starts.empty() && records.frames.empty())
    throw Error(ErrorCode::Format, "not a run's log of JSON lines", path.string());
  return records;
}

}  // namespace vdi::runlog
