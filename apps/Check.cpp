// vdi check: finds mistakes in a vdi.json before a simulation uses it.
#include <fmt/format.h>
#include <fmt/ranges.h>  // fmt::join
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/Commands.h"
#include "apps/Say.h"
#include "vdi/config/ColorMap.h"
#include "vdi/config/Run.h"
#include "vdi/core/TransferFunction.h"
#include "vdi/io/Files.h"

namespace vdi::apps {

namespace {

/// Ignores a missing folder, because the run creates it.
void requireWritable(const std::filesystem::path& file) {
  const std::filesystem::path folder = file.parent_path();
  if (folder.empty() || std::filesystem::exists(folder)) (void)io::requireWritable(file);
}

/// Describes when a run makes frames.
std::string triggersOf(const config::Run& run) {
  std::vector<std::string> due;
  if (run.every > 0) due.push_back(fmt::format("at steps 0, {}, {} ...", run.every, 2 * run.every));
  if (run.everyTime) due.push_back(fmt::format("every {} of the simulation's time", *run.everyTime));
  if (run.everySeconds) due.push_back(fmt::format("every {} s", *run.everySeconds));
  std::string text = fmt::format("{}", fmt::join(due, " and "));
  if (run.when) {
    using Measure = config::RunCondition::Measure;
    const char* measure = run.when->measure == Measure::Max    ? "maximum"
                          : run.when->measure == Measure::Min  ? "minimum"
                          : run.when->measure == Measure::Mean ? "mean"
                                                               : "mean's change";
    text += fmt::format(", if {}'s {} is", run.when->field, measure);
    if (run.when->above) text += fmt::format(" above {}", *run.when->above);
    if (run.when->above && run.when->below) text += " and";
    if (run.when->below) text += fmt::format(" below {}", *run.when->below);
  }
  if (run.maxShare) text += fmt::format(", in at most {} % of the wall time", 100.0 * *run.maxShare);
  return text;
}

/// Checks and prints the files of a step.
void checkFiles(const config::Run& run) {
  const std::int64_t step = std::max<std::int64_t>(run.every, 1);
  const auto check = [&](const config::FilePattern& pattern) {
    for (const config::RunField& field : run.fields) {
      for (const config::RunCamera& camera : run.cameras)
        requireWritable(pattern.path(step, camera.name, field.name));
      const std::filesystem::path first = pattern.path(step, run.cameras.front().name, field.name);
      fmt::print("step {}: {}\n", step, printable(first.string()));
    }
    if (run.cameras.size() > 1) fmt::print("... and those of {} other viewpoints\n", run.cameras.size() - 1);
  };
  if (run.vdi) check(*run.vdi);
  if (run.png) check(*run.png);
  if (run.cinema) {
    check(run.cinema->pictures);
    fmt::print("Cinema database: {}\n", printable(run.cinema->folder.string()));
  }
}

void check(const std::string& file) {
  const config::RunText source = config::readRun(file);
  config::Run run = config::parseRun(source.text, source.name);
  std::string shown;
  bool isAutomatic = false;  // the range of a field's colours
  for (config::RunField& field : run.fields) {
    config::RunColors& colors = field.colors;
    if (!colors.file.empty())
      colors.map = config::colorMapOf(config::readColorsFile(colors, source), colors.file, colors.name);
    validate(colors.transferFunction({0.0, 1.0}, 1.0));
    isAutomatic = isAutomatic || !colors.range;
    shown += (shown.empty() ? "" : ", ") + (field.name.empty() ? field.array : field.name);
  }
  fmt::print("{}: {}, {} x {}, {}\n", printable(source.name), printable(shown), run.settings.width,
             run.settings.height, printable(triggersOf(run)));
  checkFiles(run);
  for (const std::string& log : {run.log.json, run.log.text}) {
    if (log.empty()) continue;
    requireWritable(log);
    fmt::print("log: {}\n", printable(log));
  }
  if (run.stream) {
    fmt::print("stream at {}:{}{}{}\n", printable(run.stream->host), run.stream->port,
               run.fields.size() > 1 ? " of the first field" : "",
               run.stream->steer ? ", which viewers may steer" : "");
  }
  if (isAutomatic)
    fmt::print("the colours have no range: the first frame's values set it, also after a restart\n");
  // The run may start in another folder.
  if (const auto there = run.firstExisting(); there && run.existing == config::Existing::Refuse) {
    fmt::print(
        "{} exists already: a run won't start in this folder unless \"existing\" is \"continue\" or "
        "\"overwrite\"\n",
        printable(there->string()));
  }
}

}  // namespace

void addCheck(CLI::App& app, Job& job) {
  CLI::App* command = app.add_subcommand(
      "check", "Find mistakes in a vdi.json, which lets a simulation make VDIs without a script");
  const auto file = std::make_shared<std::string>();
  command->add_option("run", *file, "the file or its text; docs/vdi-run.schema.json lists all fields")
      ->required()
      ->type_name("FILE");
  command->callback([file, &job] { job = {[file](const comm::Communicator&) { check(*file); }, false}; });
}

}  // namespace vdi::apps
