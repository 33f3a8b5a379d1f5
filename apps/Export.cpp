// vdi export: writes VDIs into one page for browsers.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "apps/Commands.h"
#include "apps/Help.h"
#include "apps/OutputFiles.h"
#include "apps/Say.h"
#include "vdi/page/Page.h"

namespace vdi::apps {

namespace {

struct ExportOptions {
  std::vector<std::string> inputs;
  std::string output;
  std::string title;
};

void exportPage(const ExportOptions& options) {
  std::vector<std::filesystem::path> files(options.inputs.begin(), options.inputs.end());
  std::vector<NamedFile> inputs;
  std::uintmax_t inputBytes = 0;
  for (const std::filesystem::path& file : files) {
    inputs.push_back({"a VDI", file});
    std::error_code error;  // reading reports a missing file
    const std::uintmax_t bytes = std::filesystem::file_size(file, error);
    if (!error) inputBytes += bytes;
  }
  requireOutputs({{"--output", options.output}}, inputs);
  const std::string title = options.title.empty() ? files.front().stem().string() : options.title;
  page::writePage(options.output, title, page::framesOf(files));
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(options.output, error);
  if (error || inputBytes == 0) return;  // a pipe
  fmt::print("{}: {} bytes, {:.3f} times the .vdi {}\n", printable(options.output), bytes,
             static_cast<double>(bytes) / static_cast<double>(inputBytes),
             files.size() == 1 ? "file" : "files");
}

}  // namespace

void addExport(CLI::App& app, Job& job) {
  CLI::App* command = app.add_subcommand("export", "Write a page, in one file, that shows VDIs in a browser");
  command->footer(
      "Example:\n"
      "  vdi export coil.vdi -o coil.html\n"
      "writes a page that opens from disk. Several files become the frames of a series, in the given order.");
  const auto options = std::make_shared<ExportOptions>();
  command->add_option("inputs", options->inputs, "the .vdi files")->type_name("")->required();
  command->add_option("-o,--output", options->output, "the page, an HTML file")
      ->type_name("FILE")
      ->required()
      ->check(requireFileName);
  command->add_option("--title", options->title, "the page's title; default: the first file's name")
      ->type_name("TEXT");
  command->callback(
      [options, &job] { job = {[options](const comm::Communicator&) { exportPage(*options); }}; });
}

}  // namespace vdi::apps
