#include "catalyst_adaptor/scripts/ScriptLog.h"

#include <cstddef>
#include <filesystem>
#include <string_view>
#include <utility>

#include "vdi/core/Environment.h"
#include "vdi/core/Error.h"

namespace vdi::catalyst {

namespace {

constexpr const char* variable = "VDI_LOG";
using Milliseconds = std::chrono::duration<double, std::milli>;

}  // namespace

std::optional<runlog::LogFiles> ScriptLog::filesFromEnvironment() {
  const std::optional<std::string> value = environmentText(variable);
  if (!value) return std::nullopt;
  runlog::LogFiles files;
  std::string_view rest = *value;
  for (;;) {
    const std::size_t comma = rest.find(',');
    const std::filesystem::path path(rest.substr(0, comma));
    std::optional<std::filesystem::path>& file = path.extension() == ".jsonl" ? files.json : files.text;
    if (path.empty() || file) refuseEnvironment(variable, *value);
    file = path;
    if (comma == std::string_view::npos) return files;
    rest.remove_prefix(comma + 1);
  }
}

ScriptLog::ScriptLog(const runlog::LogFiles& files, const runlog::RunStart& start)
    : log_(files, start), waits_(static_cast<std::size_t>(start.ranks)) {}

void ScriptLog::add(const Step& step, std::vector<MadeFrame> frames, const std::string& error) {
  const auto end = std::chrono::steady_clock::now();
  std::optional<Error> failure;  // one failure doesn't keep the other lines out of the log
  const auto append = [&](const runlog::FrameRecord& record) {
    try {
      log_.add(record);
    } catch (const Error& problem) {
      failure = problem;
    }
  };
  const auto recordOf = [&](double milliseconds) {
    runlog::FrameRecord record;
    record.step = step.number;
    record.time = step.time;
    record.milliseconds = milliseconds;
    return record;
  };
  auto begin = step.begin;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    MadeFrame& frame = frames[i];
    const auto next = i + 1 < frames.size() ? frames[i + 1].begin : end;
    runlog::FrameRecord record = recordOf(Milliseconds(next - std::exchange(begin, next)).count());
    record.camera = std::move(frame.name);
    runlog::setReports(record, frame.reports);
    if (i == 0) record.stages.insert(record.stages.begin(), runlog::stageOf("wait", waits_));
    record.files = std::move(frame.files);
    record.dropped = frame.dropped;
    append(record);
  }
  if (!error.empty()) {
    runlog::FrameRecord record = recordOf(frames.empty() ? Milliseconds(end - begin).count() : 0.0);
    record.error = error;
    append(record);
  }
  if (failure) throw *failure;
}

void ScriptLog::addLeftOut(std::int64_t step, double time) {
  log_.addNotHandedOver(step, time);
}

std::string ScriptLog::finish() {
  return runlog::textLine(log_.finish());
}

}  // namespace vdi::catalyst
