// vdi check: finds the mistakes of a vdi.json before a simulation runs with it.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "apps/Commands.h"
#include "apps/Help.h"
#include "vdi/config/ColorMap.h"
#include "vdi/config/Run.h"
#include "vdi/core/ScalarRange.h"
#include "vdi/core/TransferFunction.h"
#include "vdi/io/Files.h"

namespace vdi::apps {

namespace {

/// A folder that isn't there will be made.
void requireWritable(const std::filesystem::path& file) {
  const std::filesystem::path folder = file.parent_path();
  if (folder.empty() || std::filesystem::exists(folder)) (void)io::requireWritable(file);
}

void check(const std::string& file) {
  const config::RunText source = config::readRun(file);
  const config::Run run = config::parseRun(source.text, source.name);
  std::optional<config::ColorMap> map;
  if (const std::optional<std::string> colors = config::readColorsFile(run, source))
    map = config::colorMapOf(*colors, run.colors.file, run.colors.name);
  const ScalarRange any{0.0, 1.0};
  validate(run.transferFunction(map, any, 1.0));
  fmt::print("{}: {}, {} x {}, at steps 0, {}, {} ...\n", source.name, run.field, run.settings.width,
             run.settings.height, run.every, 2 * run.every);
  for (const auto& pattern : {run.vdi, run.png}) {
    if (!pattern) continue;
    requireWritable(pattern->path(run.every));
    fmt::print("step {}: {}\n", run.every, pattern->path(run.every).string());
  }
  for (const std::string& log : {run.log.json, run.log.text}) {
    if (log.empty()) continue;
    requireWritable(log);
    fmt::print("a log: {}\n", log);
  }
  if (run.stream) fmt::print("a stream, at {}:{}\n", run.stream->host, run.stream->port);
  if (!run.colors.range)
    fmt::print("colours without a range: the first frame's values decide, also after a restart\n");
}

}  // namespace

void addCheck(CLI::App& app, Job& job) {
  CLI::App* command = app.add_subcommand(
      "check", "Find mistakes in a vdi.json, with which a simulation makes VDIs without a script");
  const auto file = std::make_shared<std::string>();
  command->add_option("run", *file, "the file, or its text; docs/vdi-run.schema.json has all fields")
      ->required()
      ->type_name("FILE");
  command->callback([file, &job] { job = {[file](const comm::Communicator&) { check(*file); }, false}; });
}

}  // namespace vdi::apps
