// vdi: Volumetric Depth Images without ParaView.
#include <fcntl.h>
#include <fmt/format.h>
#include <mpi.h>
#include <unistd.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <iostream>
#include <memory>
#include <new>
#include <sstream>
#include <string>
#include <string_view>
#include <thread>

#include "BuildCommit.h"
#include "apps/Commands.h"
#include "apps/Help.h"
#include "apps/Say.h"
#include "apps/StreamOptions.h"
#include "bench/Bench.h"
#include "vdi/core/Environment.h"
#include "vdi/core/Error.h"

namespace {

constexpr int failed = 1;
constexpr int badUsage = 2;

using vdi::apps::say;

/// The end of this rank's work.
struct Outcome {
  int status = 0;
  std::string message;  // printable lines; empty: no error, or another rank reports it
};

/// Returns a line for each environment variable that users may set.
std::string environmentHelp() {
  std::string text;
  for (const vdi::EnvironmentVariable& variable : vdi::environmentVariables()) {
    if (variable.forUsers)
      text += fmt::format("  {:<20} {} ({})\n", variable.name, variable.meaning, variable.values);
  }
  return text;
}

std::string firstLine(std::string_view text) {
  return std::string(text.substr(0, text.find('\n')));
}

/// Flushes printed text. Writing it may fail, for example on a full disk.
void requirePrinted() {
  std::cout.flush();
  if (std::cout && std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return;
  throw vdi::Error(vdi::ErrorCode::Io, "can't write to standard output");
}

Outcome outcomeOf(const CLI::App& app, const CLI::ParseError& error, bool speaks) {
  if (error.get_exit_code() == 0) {  // --help, --version
    if (speaks) app.exit(error);
    requirePrinted();
    return {};
  }
  const auto chosen = app.get_subcommands();
  const std::string command = chosen.empty() ? "vdi" : "vdi " + chosen.front()->get_name();
  return {badUsage,
          fmt::format("{} (see '{} --help')", vdi::apps::printable(firstLine(error.what())), command)};
}

/// Requires equal arguments, because ranks with different ones would wait for each other in different calls.
void requireEqualArguments(const vdi::comm::Communicator& world, int argc, char** argv) {
  std::string all;
  for (int i = 1; i < argc; ++i) all += std::string(argv[i]) + '\n';
  world.requireEqual(std::hash<std::string>{}(all), "command line");
}

/// The message of an error in printable lines. Only the list of devices has several.
std::string linesOf(const std::string& message, bool isList) {
  if (!isList) return vdi::apps::printable(message);
  std::stringstream list(message);
  std::string text;
  for (std::string line; std::getline(list, line);)
    text += (text.empty() ? "" : "\n") + vdi::apps::printable(line);
  return text;
}

void sayLines(const std::string& lines) {
  fmt::print(stderr, "vdi: {}\n", lines);
}

/// Parses the command line and runs the selected subcommand.
Outcome runCommand(int argc, char** argv) {
  const vdi::comm::Communicator world = vdi::comm::Communicator::world();
  CLI::App app(
      "Volumetric Depth Images: small, view-dependent pictures with depth, for viewing from new "
      "viewpoints",
      "vdi");
  app.formatter(std::make_shared<vdi::apps::HelpFormatter>());  // inherited by subcommands
  app.require_subcommand(1);
  app.set_version_flag("--version", fmt::format("vdi {} ({})", VDI_VERSION, buildCommit));
  app.footer("Environment variables:\n" + environmentHelp() +
             "vdi info --devices lists the devices. The exit status is 0 for success, 1 for a failure, and 2 "
             "for a wrong command line.");
  vdi::apps::Job job;
  vdi::apps::addGenerate(app, job);
  vdi::apps::addRender(app, job);
  vdi::apps::addExport(app, job);
  vdi::apps::addServe(app, job);
  vdi::apps::addReceive(app, job);
  vdi::apps::addCompare(app, job);
  vdi::apps::addCheck(app, job);
  vdi::apps::addLog(app, job);
  vdi::apps::addInfo(app, job);
  vdi::bench::addBench(app, job);
  try {
    world.together([&] { app.parse(argc, argv); });
  } catch (const CLI::ParseError& error) {
    return outcomeOf(app, error, world.rank() == 0);
  }
  requireEqualArguments(world, argc, argv);
  vdi::apps::hideTokens({argv, static_cast<std::size_t>(argc)});
  if (world.size() > 1 && !job.collective) {
    throw vdi::Error(vdi::ErrorCode::InvalidArgument,
                     "this subcommand runs on one rank; only generate and bench run on several");
  }
  if (world.rank() == 0) {
    if (const std::string issue = vdi::cacheIssue(); !issue.empty()) say("warning: " + issue);
  }
  job.run(world);
  requirePrinted();
  return {};
}

/// Runs the tool, and lets no exception out.
Outcome runTool(int argc, char** argv) {
  try {
    return runCommand(argc, argv);
  } catch (const vdi::Error& error) {
    if (error.code() == vdi::ErrorCode::RemoteRank) return {failed, {}};
    return {error.code() == vdi::ErrorCode::InvalidArgument ? badUsage : failed,
            linesOf(error.what(), error.code() == vdi::ErrorCode::DeviceUnavailable)};
  } catch (const std::bad_alloc&) {
    return {failed, "out of memory"};
  } catch (const std::exception& error) {
    return {failed, linesOf(error.what(), false)};
  }
}

/// All ranks end with the worst status, and the lowest rank with a message prints it. A rank that
/// failed ends the others after a while, because they may wait for it in a call that it never
/// makes.
int leaveTogether(const Outcome& mine) {
  constexpr auto patience = std::chrono::seconds(20);
  int rank = 0;
  int size = 1;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Comm_size(MPI_COMM_WORLD, &size);
  std::array<int, 2> minimum{mine.message.empty() ? size : rank, -mine.status};
  MPI_Request request = MPI_REQUEST_NULL;
  MPI_Iallreduce(MPI_IN_PLACE, minimum.data(), 2, MPI_INT, MPI_MIN, MPI_COMM_WORLD, &request);
  const auto start = std::chrono::steady_clock::now();
  int done = 0;
  MPI_Test(&request, &done, MPI_STATUS_IGNORE);
  while (done == 0) {
    if (mine.status != 0 && std::chrono::steady_clock::now() - start > patience) {
      sayLines(mine.message);
      MPI_Abort(MPI_COMM_WORLD, mine.status);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    MPI_Test(&request, &done, MPI_STATUS_IGNORE);
  }
  if (minimum[0] == rank) sayLines(mine.message);
  return -minimum[1];
}

/// The next opened file would get the number of a closed standard stream, and printed text would
/// end up in it. Each closed stream gets a descriptor that doesn't support its purpose, so printing
/// fails.
void occupyStandardStreams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(stream, F_GETFD) < 0) (void)::open("/dev/null", stream == STDIN_FILENO ? O_WRONLY : O_RDONLY);
  }
}

/// Launchers set these variables. A single process needs no MPI, whose start takes seconds on some
/// machines.
bool startedByMpi() {
  constexpr std::array signs{"OMPI_COMM_WORLD_SIZE", "PMIX_RANK",    "PMI_RANK",    "PMI_SIZE",
                             "MPI_LOCALNRANKS",      "SLURM_PROCID", "PALS_RANKID", "ALPS_APP_PE"};
  return std::any_of(signs.begin(), signs.end(),
                     [](const char* sign) { return std::getenv(sign) != nullptr; });
}

}  // namespace

int main(int argc, char** argv) {
  occupyStandardStreams();
  if (!startedByMpi()) {
    const Outcome outcome = runTool(argc, argv);
    if (!outcome.message.empty()) sayLines(outcome.message);
    return outcome.status;
  }
  MPI_Init(&argc, &argv);
  const int result = leaveTogether(runTool(argc, argv));
  MPI_Finalize();
  return result;
}
