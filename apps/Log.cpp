// vdi log: draws the log of an in situ run.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <span>
#include <string>

#include "apps/Commands.h"
#include "apps/Help.h"
#include "apps/OutputFiles.h"
#include "apps/Say.h"
#include "vdi/io/Files.h"
#include "vdi/runlog/Plot.h"
#include "vdi/runlog/Record.h"

namespace vdi::apps {

namespace {

struct LogOptions {
  std::string input;
  std::string output;
  bool means = false;
};

void drawLog(const LogOptions& options) {
  const std::filesystem::path input = options.input;
  std::filesystem::path output = options.output;
  if (output.empty()) output = std::filesystem::path(input).replace_extension(".svg");
  requireOutputs({{"--output", output}}, {{"the log", input}});
  const runlog::RunRecords records = runlog::readRecords(input);
  const std::string svg = runlog::plot(records, {input.filename().string(), options.means});
  io::writeAtomically(output, std::as_bytes(std::span(svg)));
  if (records.skipped > 0) say(fmt::format("{}: {} lines aren't records", input.string(), records.skipped));
  for (const runlog::RunSummary& summary : records.summaries)
    fmt::print("{}\n", printable(textLine(summary)));
  if (records.summaries.size() < records.starts.size()) {  // killed, or still running
    runlog::RunSummary sum;
    for (const runlog::FrameRecord& frame : records.frames) sum.add(frame);
    fmt::print("{} of {} runs not finalized; {} frames in all, {} failed\n",
               records.starts.size() - records.summaries.size(), records.starts.size(), sum.frames,
               sum.failed);
  }
  fmt::print("{}\n", printable(output.string()));
}

}  // namespace

void addLog(CLI::App& app, Job& job) {
  CLI::App* command =
      app.add_subcommand("log", "Draw the log of an in situ run: each frame's stages over the steps");
  command->footer(
      "Example:\n"
      "  vdi log run.jsonl\n"
      "writes run.svg and prints the summary. The field 'log' of a vdi.json makes a run write such a log. "
      "So does the variable VDI_LOG for a run with Catalyst scripts.");
  const auto options = std::make_shared<LogOptions>();
  command->add_option("log", options->input, "the log, of JSON lines")->type_name("FILE")->required();
  command->add_option("-o,--output", options->output, "the picture; default: the log's name with .svg")
      ->type_name("FILE")
      ->check(requireFileName);
  command->add_flag("--mean", options->means, "show the mean of all ranks instead of the slowest rank");
  command->callback([options, &job] { job = {[options](const comm::Communicator&) { drawLog(*options); }}; });
}

}  // namespace vdi::apps
