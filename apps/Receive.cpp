// vdi receive: a viewer without a window. It stores or draws a server's frames.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "apps/Commands.h"
#include "apps/Help.h"
#include "apps/OutputFiles.h"
#include "apps/Say.h"
#include "apps/StreamOptions.h"
#include "vdi/core/Error.h"
#include "vdi/io/Files.h"
#include "vdi/io/Png.h"
#include "vdi/io/VdiFile.h"
#include "vdi/pipeline/VdiRenderer.h"
#include "vdi/stream/Client.h"

namespace vdi::apps {

namespace {

struct ReceiveOptions {
  std::string url;
  std::string command;
  std::string folder;
  std::string picture;
  std::uint64_t frames = 0;  // 0: until the server has ended
  double patience = 30.0;
  bool isCoarse = false;
  std::string tokenFile;
  std::string authority;
};

/// Stores and draws received frames.
class Recorder {
 public:
  explicit Recorder(const ReceiveOptions& options) : options_(options) {
    if (!options.picture.empty()) apps::requireOutputs({{"--render", options.picture}}, {});
    if (!options.folder.empty()) std::filesystem::create_directories(options.folder);
  }

  std::uint64_t count() const { return count_; }

  /// Reports a bad file and doesn't count it.
  void take(stream::Received received) {
    const stream::Level& level = received.level;
    std::optional<Vdi> vdi;
    try {
      vdi = received.decode();
    } catch (const Error& error) {
      say(fmt::format("frame {} is damaged: {}", level.frame, error.what()));
      return;
    }
    const std::string name = fmt::format("vdi_{:06}.vdi", count_);
    if (!options_.folder.empty())
      io::writeAtomically(std::filesystem::path(options_.folder) / name, received.file);
    if (!options_.picture.empty()) draw(*vdi);
    ++count_;
    fmt::print(
        "{}: frame {}, level {} of {}, {} x {} lists, step {}, time {:g}, {} bytes, age {:.3f} s, {} "
        "dropped\n",
        options_.folder.empty() ? "received" : name, level.frame, level.level + 1, level.levels, level.width,
        level.height, level.step, level.time.value_or(0.0), level.bytes, level.age, level.dropped);
    std::fflush(stdout);
  }

 private:
  void draw(const Vdi& vdi) {
    if (!renderer_) renderer_.emplace(gpu::Device::create(gpu::requestFromEnvironment(0)));
    renderer_->setVdi(vdi);
    const glm::ivec2 size = vdi.pictureSize();
    io::writePng(options_.picture,
                 io::toPicture(renderer_->renderBytes(vdi.camera, size.x, size.y, Alpha::Premultiplied,
                                                      defaultReconstruction)));
  }

  const ReceiveOptions& options_;
  std::optional<VdiRenderer> renderer_;
  std::uint64_t count_ = 0;
};

/// Requests all frames of a finished series, one after the other.
class SeriesWalk {
 public:
  /// Whether to keep `received`.
  bool wants(const stream::Received& received) const { return !next_ || received.level.frame == *next_; }
  bool hasBegun() const { return next_.has_value(); }
  bool isDone(const stream::Client::Standing& standing) const {
    return next_ && hasEnded(standing) && *next_ >= *standing.series;
  }
  /// Requests the first frame once the server has a finished series. A server that was live has no
  /// series when it ends: it says "ended" before it closes the connection.
  void begin(stream::Client& client, const stream::Client::Standing& standing) {
    if (next_ || !standing.isConnected || !hasEnded(standing) || standing.hasBeenLive) return;
    next_ = 0;
    if (*standing.series > 0) client.show(*next_);
  }
  void advance(stream::Client& client, const stream::Client::Standing& standing) {
    if (!next_) return;
    ++*next_;
    if (!isDone(standing)) client.show(*next_);
  }

 private:
  /// Whether the whole series is known. A restarted server may have sent only a part of it so far.
  static bool hasEnded(const stream::Client::Standing& standing) {
    return standing.series && standing.hasState && standing.state.phase == stream::Phase::Ended;
  }

  std::optional<std::uint32_t> next_;
};

void requirePatience(const stream::Client::Standing& standing, double patience, std::uint64_t count) {
  const auto alone = std::chrono::steady_clock::now() - standing.since;
  if (standing.isConnected || alone < std::chrono::duration<double>(patience)) return;
  throw Error(ErrorCode::Io, fmt::format("no connection for {:g} s after {} frames: {}", patience, count,
                                         standing.trouble.empty() ? "no answer" : standing.trouble));
}

/// Ends a walk whose server is a relay that can't reach the series' own server.
class SourcePatience {
 public:
  explicit SourcePatience(double seconds) : seconds_(seconds) {}
  /// Throws Error{Io} if the server has reported for that long why it has no frames.
  void require(const stream::Client::Standing& standing, std::uint64_t count) {
    const auto now = std::chrono::steady_clock::now();
    if (!standing.isConnected || standing.state.cause.empty()) since_ = now;
    if (now - since_ < std::chrono::duration<double>(seconds_)) return;
    throw Error(ErrorCode::Io, fmt::format("no frame for {:g} s after {} frames: {}", seconds_, count,
                                           standing.state.cause));
  }

 private:
  double seconds_;
  std::chrono::steady_clock::time_point since_ = std::chrono::steady_clock::now();
};

void receive(const ReceiveOptions& options) {
  constexpr std::chrono::milliseconds pause{100};
  stream::ClientOptions connection;
  if (options.command.empty()) {
    (void)stream::parseUrl(options.url);  // a malformed link is not a command
    connection = clientOf(options.url, options.tokenFile);
  } else {
    connection = clientOf(options.command, "");
  }
  connection.authority = options.authority;
  connection.decodes = options.folder.empty();
  Recorder recorder(options);
  stream::Client client(std::move(connection));
  SeriesWalk walk;
  SourcePatience sourcePatience(options.patience);
  while (options.frames == 0 || recorder.count() < options.frames) {
    std::optional<stream::Received> received = client.next(pause);
    const stream::Client::Standing standing = client.standing();
    walk.begin(client, standing);
    if (walk.isDone(standing)) return;
    if (!received) {
      // A server of a finished series may come back with the frames that this walk still lacks.
      const bool hasEnded = standing.state.phase == stream::Phase::Ended && !walk.hasBegun();
      if (hasEnded && !standing.isConnected && options.frames == 0 && recorder.count() > 0) return;
      requirePatience(standing, options.patience, recorder.count());
      if (walk.hasBegun()) sourcePatience.require(standing, recorder.count());
      continue;
    }
    if (!walk.wants(*received)) continue;
    if (!received->missing.empty()) {
      say(fmt::format("frame {}: {}", received->level.frame, received->missing));
      walk.advance(client, standing);
      continue;
    }
    const bool isFull = received->level.level + 1 == received->level.levels;
    if (isFull || options.isCoarse) recorder.take(*std::move(received));
    if (isFull) walk.advance(client, standing);
  }
}

}  // namespace

void addReceive(CLI::App& app, Job& job) {
  CLI::App* command = app.add_subcommand("receive", "Store or draw the VDIs that a server offers");
  command->footer(
      "Example:\n"
      "  vdi receive 'http://127.0.0.1:8080/#token=...' -o received --frames 10\n"
      "The command reconnects after a failure. It receives all frames of a finished series. While a series\n"
      "grows, it receives the newest frames and may skip some.");
  const auto options = std::make_shared<ReceiveOptions>();
  CLI::Option* const url =
      command->add_option("url", options->url, "the link that vdi serve or VDIStream printed")->type_name("");
  command
      ->add_option("--from", options->command,
                   "instead of the link: a command that runs vdi serve --stdio, such as\n"
                   "'ssh host vdi serve --stdio results'")
      ->type_name("COMMAND")
      ->excludes(url);
  command->add_option("-o,--output", options->folder, "folder for vdi_000000.vdi and so on")
      ->type_name("FOLDER");
  command->add_option("--render", options->picture, "PNG of the newest frame from its own viewpoint")
      ->type_name("FILE");
  command->add_option("--frames", options->frames, "number of frames; default: all until the server ends")
      ->type_name("N")
      ->check(requirePositive);
  command->add_flag("--coarse", options->isCoarse, "also take coarse levels, which arrive first");
  command->add_option("--patience", options->patience, "seconds without a connection after which to give up")
      ->type_name("S")
      ->capture_default_str()
      ->check(requirePositive);
  addTokenOption(*command, options->tokenFile, "default: the link's");
  command
      ->add_option("--authority", options->authority,
                   "PEM file of certificates to trust in addition to the system's")
      ->type_name("FILE");
  command->callback([options, &job] {
    if (options->url.empty() && options->command.empty()) throw CLI::RequiredError("a link, or --from");
    job = {[options](const comm::Communicator&) { receive(*options); }};
  });
}

}  // namespace vdi::apps
