// vdi serve: offers VDIs to browsers and other programs over the network.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "apps/Commands.h"
#include "apps/FrameFiles.h"
#include "apps/Help.h"
#include "apps/Relay.h"
#include "apps/Say.h"
#include "apps/StreamOptions.h"
#include "vdi/core/Error.h"
#include "vdi/page/Page.h"
#include "vdi/stream/Pipe.h"
#include "vdi/stream/Server.h"
#include "vdi/stream/Token.h"

namespace vdi::apps {

namespace {

struct ServeOptions {
  std::vector<std::string> inputs;
  std::string from;
  std::string fromTokenFile;
  bool isStdio = false;
  std::string host = "127.0.0.1";
  std::uint16_t port = 0;
  std::string tokenFile;
  std::string certificate;
  std::string key;
  std::vector<std::string> origins;
  std::vector<std::string> embedders;
  std::string title = "Live";
  std::string rate;
  std::uint32_t viewers = 64;
  bool isFinished = false;
};

/// The signals that end a server. The program must block them before it starts the first thread.
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
  bool hasCome() const {
    const timespec none{};
    return sigtimedwait(&set_, nullptr, &none) > 0;
  }

 private:
  sigset_t set_{};
};

/// Its destructor stops `files` before their server ends.
class FilesStop {
 public:
  explicit FilesStop(FrameFiles& files) : files_(files) {}
  ~FilesStop() { files_.stop(); }
  FilesStop(const FilesStop&) = delete;
  FilesStop& operator=(const FilesStop&) = delete;

 private:
  FrameFiles& files_;
};

FrameFiles::Options filesOf(const ServeOptions& options) {
  FrameFiles::Options files;
  files.log = say;
  files.follows = !options.isFinished;
  if (options.inputs.size() == 1 && std::filesystem::is_directory(options.inputs.front())) {
    files.folder = options.inputs.front();
  } else {
    files.files.assign(options.inputs.begin(), options.inputs.end());
  }
  return files;
}

/// Prints the link. It omits the token if the user gave one. Nothing else prints a token.
void printLink(const stream::Server& server, bool isKnown) {
  fmt::print("{}\n", isKnown ? server.address() : server.link());
  std::fflush(stdout);
}

/// Serves standard input and output until they are closed. Nothing else writes to them.
void serveStdio(const ServeOptions& options) {
  std::signal(SIGPIPE, SIG_IGN);
  FrameFiles files(filesOf(options));
  stream::ServerOptions server;
  server.listens = false;
  server.token = stream::randomToken();
  server.mostBytesPerSecond = bytesPerSecond(options.rate);
  server.show = [&files](std::uint32_t index) { files.show(index); };
  server.log = say;
  const std::string token = server.token;
  stream::Server running(std::move(server));
  const FilesStop stop(files);
  files.start(running);
  stream::serveOver(running, token, STDIN_FILENO, STDOUT_FILENO);
}

stream::ServerOptions serverOf(const ServeOptions& options, const std::string& known) {
  stream::ServerOptions server;
  server.host = options.host;
  server.port = options.port;
  server.token = known.empty() ? stream::randomToken() : known;
  server.page = page::emptyPage(options.title);
  server.origins = options.origins;
  server.originOption = "--origin {}";
  server.embedders = options.embedders;
  server.mostBytesPerSecond = bytesPerSecond(options.rate);
  server.mostViewers = options.viewers;
  server.certificate = options.certificate;
  server.key = options.key;
  server.log = say;
  return server;
}

void relay(const ServeOptions& options) {
  constexpr std::chrono::milliseconds pause{100};
  const EndSignals endSignals;
  const std::string known = tokenOf(options.tokenFile);
  Relay relay(clientOf(options.from, options.fromTokenFile), serverOf(options, known));
  printLink(relay.server(), !known.empty());
  while (!endSignals.hasCome()) relay.step(pause);
}

void serve(const ServeOptions& options) {
  const EndSignals endSignals;
  FrameFiles files(filesOf(options));
  const std::string known = tokenOf(options.tokenFile);
  stream::ServerOptions server = serverOf(options, known);
  server.show = [&files](std::uint32_t index) { files.show(index); };
  stream::Server running(std::move(server));
  const FilesStop stop(files);
  files.start(running);
  printLink(running, !known.empty());
  endSignals.wait();
}

void addServerOptions(CLI::App& command, ServeOptions& options) {
  command
      .add_option("--host", options.host,
                  "name or address to listen at; 0.0.0.0: all addresses of this machine")
      ->capture_default_str();
  command.add_option("--port", options.port, "port to listen at; 0: any free one")->capture_default_str();
  addTokenOption(command, options.tokenFile, "default: a new token, which is part of the link");
  command
      .add_option("--title", options.title,
                  "title of the page and its tab, which whoever reaches the port can read")
      ->type_name("TEXT")
      ->capture_default_str();
  command.add_option("--rate", options.rate, "limit per viewer and second, such as 100Mbit or 5MB")
      ->type_name("RATE")
      ->check(requireRate);
  command.add_option("--viewers", options.viewers, "maximum number of viewers at a time")
      ->check(requirePositive)
      ->capture_default_str();
  command.add_option("--certificate", options.certificate, "PEM file of a certificate; turns on TLS")
      ->type_name("FILE");
  command.add_option("--key", options.key, "PEM file of the certificate's key")->type_name("FILE");
  command
      .add_option("--origin", options.origins,
                  "another site whose pages may connect, such as https://example.org")
      ->type_name("ORIGIN")
      ->check(requireOrigin);
  command
      .add_option("--embed-in", options.embedders,
                  "a site whose pages may show this page in a frame, such as https://example.org")
      ->type_name("ORIGIN")
      ->check(requireOrigin);
}

}  // namespace

void addServe(CLI::App& app, Job& job) {
  CLI::App* command = app.add_subcommand("serve", "Offer VDIs to browsers and to vdi receive");
  command->footer(
      "Example:\n"
      "  vdi serve results/\n"
      "prints a link. Whoever has it open sees each .vdi file that appears in the folder.\n"
      "docs/live.md explains how to reach a server on another machine.");
  const auto options = std::make_shared<ServeOptions>();
  CLI::Option* const inputs =
      command->add_option("inputs", options->inputs, "a folder to follow, or the .vdi files of a series")
          ->type_name("");
  command->add_flag("--finished", options->isFinished, "the folder's series is finished; don't follow it");
  addServerOptions(*command, *options);
  CLI::Option* const from =
      command
          ->add_option("--from", options->from,
                       "offer another server's frames: its link, or a command that runs\n"
                       "vdi serve --stdio, such as 'ssh host vdi serve --stdio results'")
          ->type_name("LINK|COMMAND")
          ->excludes(inputs);
  command
      ->add_option("--from-token-file", options->fromTokenFile,
                   "file whose first line is the token, if the link of --from has none")
      ->type_name("FILE")
      ->needs(from);
  CLI::Option* const stdio = command
                                 ->add_flag("--stdio", options->isStdio,
                                            "serve one viewer at standard input and output instead of a port")
                                 ->excludes(from);
  for (const char* const name :
       {"--host", "--port", "--token-file", "--certificate", "--key", "--origin", "--embed-in", "--title"})
    stdio->excludes(command->get_option(name));
  command->callback([options, &job] {
    if (options->inputs.empty() && options->from.empty())
      throw CLI::RequiredError("a folder, .vdi files, or --from");
    job = {[options](const comm::Communicator&) {
      if (options->isStdio) {
        serveStdio(*options);
      } else if (!options->from.empty()) {
        relay(*options);
      } else {
        serve(*options);
      }
    }};
  });
}

}  // namespace vdi::apps
