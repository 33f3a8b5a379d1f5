// vdi serve: offers VDIs to browsers and other programs, over the network.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <csignal>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "apps/Commands.h"
#include "apps/FrameFiles.h"
#include "apps/Help.h"
#include "apps/StreamOptions.h"
#include "vdi/core/Error.h"
#include "vdi/page/Page.h"
#include "vdi/stream/GivenToken.h"
#include "vdi/stream/Server.h"
#include "vdi/stream/Token.h"

namespace vdi::apps {

namespace {

struct ServeOptions {
  std::vector<std::string> inputs;
  std::string host = "127.0.0.1";
  std::uint16_t port = 0;
  std::string tokenFile;
  std::string certificate;
  std::string key;
  std::vector<std::string> origins;
  std::string rate;
  std::uint32_t viewers = 64;
  bool isFinished = false;
};

void logLine(const std::string& line) {
  fmt::print(stderr, "vdi: {}\n", line);
}

/// Signals that end a server; they must be blocked before the first thread starts.
class EndSignals {
 public:
  EndSignals() {
    sigemptyset(&set_);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&set_, signal);
    pthread_sigmask(SIG_BLOCK, &set_, nullptr);
  }
  void wait() const {
    int signal = 0;
    sigwait(&set_, &signal);
  }

 private:
  sigset_t set_{};
};

FrameFiles::Options filesOf(const ServeOptions& options) {
  FrameFiles::Options files;
  files.log = logLine;
  files.follows = !options.isFinished;
  if (options.inputs.size() == 1 && std::filesystem::is_directory(options.inputs.front())) {
    files.folder = options.inputs.front();
  } else {
    files.files.assign(options.inputs.begin(), options.inputs.end());
  }
  return files;
}

void serve(const ServeOptions& options) {
  const EndSignals endSignals;
  FrameFiles files(filesOf(options));
  const std::string known = stream::givenToken(options.tokenFile);
  stream::ServerOptions server;
  server.host = options.host;
  server.port = options.port;
  server.token = known.empty() ? stream::randomToken() : known;
  server.page = page::emptyPage("Live");
  server.origins = options.origins;
  server.mostBytesPerSecond = bytesPerSecond(options.rate);
  server.mostViewers = options.viewers;
  server.certificate = options.certificate;
  server.key = options.key;
  server.show = [&files](std::uint32_t index) { files.show(index); };
  server.log = logLine;
  stream::Server running(std::move(server));
  files.start(running);
  // The only place that shows a token, and only one that nobody knows yet.
  fmt::print("{}\n", known.empty() ? running.link() : running.address());
  std::fflush(stdout);
  endSignals.wait();
}

}  // namespace

void addServe(CLI::App& app, Job& job) {
  CLI::App* command = app.add_subcommand("serve", "Offer VDIs to browsers and to vdi receive");
  command->footer(
      "Example:\n"
      "  vdi serve results/\n"
      "prints a link. Each .vdi file that appears in the folder is shown where the link is open.\n"
      "docs/live.md says how to reach a server on another machine.");
  const auto options = std::make_shared<ServeOptions>();
  command->add_option("inputs", options->inputs, "a folder to follow, or the .vdi files of a series")
      ->type_name("")
      ->required();
  command->add_flag("--finished", options->isFinished, "the folder's series is finished; don't follow it");
  command->add_option("--host", options->host, "name or address to listen at; 0.0.0.0: any of this machine's")
      ->capture_default_str();
  command->add_option("--port", options->port, "0: one that is free")->capture_default_str();
  addTokenOption(*command, options->tokenFile, "default: a new one, which is in the link");
  command->add_option("--rate", options->rate, "limit for each viewer, such as 100Mbit or 5MB a second")
      ->type_name("RATE")
      ->check(requireRate);
  command->add_option("--viewers", options->viewers, "most of them at a time")->capture_default_str();
  command->add_option("--certificate", options->certificate, "PEM file of a certificate: encrypts by TLS")
      ->type_name("FILE");
  command->add_option("--key", options->key, "PEM file of the certificate's key")->type_name("FILE");
  command
      ->add_option("--origin", options->origins,
                   "of another site whose pages may connect: https://example.org")
      ->type_name("ORIGIN");
  command->callback([options, &job] { job = {[options](const comm::Communicator&) { serve(*options); }}; });
}

}  // namespace vdi::apps
