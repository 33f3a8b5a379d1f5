#include "bench/StreamSuite.h"

#include <fmt/format.h>
#include <stdlib.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <future>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "apps/Cameras.h"
#include "apps/FrameFiles.h"
#include "apps/StreamOptions.h"
#include "bench/Frames.h"
#include "bench/Timing.h"
#include "vdi/core/Error.h"
#include "vdi/core/ImageMetrics.h"
#include "vdi/core/Thinning.h"
#include "vdi/io/Files.h"
#include "vdi/io/Png.h"
#include "vdi/io/VdiFile.h"
#include "vdi/pipeline/VdiGenerator.h"
#include "vdi/pipeline/VdiRenderer.h"
#include "vdi/stream/Client.h"
#include "vdi/stream/Frame.h"
#include "vdi/stream/Publisher.h"
#include "vdi/stream/Server.h"
#include "vdi/stream/Token.h"

namespace vdi::bench {

namespace {

using nlohmann::json;
using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

/// The viewpoints of the streamed VDIs, in their order.
constexpr int viewpoints = 4;

/// A folder of this process. The destructor removes it.
class Folder {
 public:
  Folder() {
    std::string name = (std::filesystem::temp_directory_path() / "vdi-bench-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr)
      throw Error(ErrorCode::Io, "can't create a folder: " + std::generic_category().message(errno), name);
    path_ = name;
  }
  ~Folder() {
    std::error_code error;
    std::filesystem::remove_all(path_, error);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// The times at which frames began and at which their pictures were complete.
class Log {
 public:
  void begin(std::uint32_t frame) {
    const std::scoped_lock lock(mutex_);
    begun_[frame] = Clock::now();
  }
  /// `busy` is the viewer's time in seconds.
  void seen(const stream::Level& level, double busy) {
    const Clock::time_point now = Clock::now();
    const auto frame = static_cast<std::uint32_t>(level.step);
    const std::scoped_lock lock(mutex_);
    if (frame != last_) {
      last_ = frame;
      arrivals_.push_back(now);
      ages_.push_back(Seconds(now - begun_[frame]).count());
      firstLevels_.push_back(level.level);
    }
    if (level.level + 1 == level.levels) ++full_;
    busy_.push_back(busy);
  }
  bool hasSeen(std::uint32_t frame) const {
    const std::scoped_lock lock(mutex_);
    return last_ && *last_ >= frame;
  }

  struct Figures {
    double framesPerSecond = 0.0;
    double fullPerSecond = 0.0;
    std::size_t frames = 0;
    std::size_t firstLevel = 0;  // with which most frames began
    Spread age;                  // seconds from a frame's beginning to its first picture
    Spread busy;                 // seconds of the viewer for a level
  };
  Figures figures() const {
    const std::scoped_lock lock(mutex_);
    Figures figures;
    figures.frames = arrivals_.size();
    if (arrivals_.size() < 2) return figures;
    const double seconds = Seconds(arrivals_.back() - arrivals_.front()).count();
    figures.framesPerSecond = static_cast<double>(arrivals_.size() - 1) / seconds;
    figures.fullPerSecond = static_cast<double>(full_) / seconds;
    figures.age = spreadOf(ages_);
    std::map<std::uint32_t, std::size_t> counts;
    for (const std::uint32_t level : firstLevels_) ++counts[level];
    const auto isRarer = [](const auto& one, const auto& other) { return one.second < other.second; };
    figures.firstLevel = std::max_element(counts.begin(), counts.end(), isRarer)->first;
    figures.busy = spreadOf(busy_);
    return figures;
  }

 private:
  mutable std::mutex mutex_;
  std::map<std::uint32_t, Clock::time_point> begun_;
  std::optional<std::uint32_t> last_;
  std::vector<Clock::time_point> arrivals_;  // times of frames' first levels
  std::vector<std::uint32_t> firstLevels_;
  std::vector<double> ages_;
  std::vector<double> busy_;
  std::size_t full_ = 0;
};

/// A viewer that decodes and draws each level on its own thread.
class Viewer {
 public:
  Viewer(const std::string& link, std::shared_ptr<gpu::Device> device, double degrees, const glm::ivec2& size,
         Reconstruction reconstruction, Log& log)
      : renderer_(std::move(device)),
        degrees_(degrees),
        size_(size),
        reconstruction_(reconstruction),
        log_(log),
        client_(optionsOf(link)),
        done_(std::async(std::launch::async, [this] { view(); })) {}
  ~Viewer() { isEnding_ = true; }
  Viewer(const Viewer&) = delete;
  Viewer& operator=(const Viewer&) = delete;

  bool isConnected() const { return client_.standing().isConnected; }
  /// Ends the viewer. Rethrows an exception of its thread.
  void finish() {
    isEnding_ = true;
    done_.get();
  }

 private:
  static stream::ClientOptions optionsOf(const std::string& link) {
    stream::ClientOptions options = apps::clientOf(link, "");
    options.decodes = true;
    return options;
  }

  void view() {
    constexpr std::chrono::milliseconds patience{20};
    while (!isEnding_) {
      std::optional<stream::Received> received = client_.next(patience);
      if (!received) continue;
      const Clock::time_point start = Clock::now();
      const Vdi vdi = received->decode();
      renderer_.setVdi(vdi);
      (void)renderer_.renderBytes(apps::turned(vdi.camera, degrees_, 0.0), size_.x, size_.y,
                                  Alpha::Premultiplied, reconstruction_);
      log_.seen(received->level, Seconds(Clock::now() - start).count());
    }
  }

  VdiRenderer renderer_;
  double degrees_;
  glm::ivec2 size_;
  Reconstruction reconstruction_;
  Log& log_;
  stream::Client client_;
  std::atomic<bool> isEnding_{false};
  std::future<void> done_;  // the last member: its destructor waits for the thread
};

/// Waits until `isDone`, for ten seconds at most.
template <typename IsDone>
void waitUntil(IsDone isDone) {
  constexpr std::chrono::seconds most{10};
  constexpr std::chrono::milliseconds pause{2};
  const Clock::time_point end = Clock::now() + most;
  while (!isDone() && Clock::now() < end) std::this_thread::sleep_for(pause);
}

/// Viewers that decode nothing: six take what comes, one takes nothing, and one can vanish.
class Crowd {
 public:
  explicit Crowd(const std::string& link) {
    constexpr std::size_t takers = 6;
    for (std::size_t i = 0; i < takers + 2; ++i)
      clients_.push_back(std::make_unique<stream::Client>(apps::clientOf(link, "")));
    for (const auto& client : clients_) waitUntil([&client] { return client->standing().isConnected; });
    for (std::size_t i = 0; i < takers; ++i)
      done_.push_back(std::async(std::launch::async, [this, &client = *clients_[i]] { take(client); }));
  }
  ~Crowd() { isEnding_ = true; }
  Crowd(const Crowd&) = delete;
  Crowd& operator=(const Crowd&) = delete;
  void loseOne() { clients_.pop_back(); }

 private:
  void take(stream::Client& client) const {
    constexpr std::chrono::milliseconds patience{20};
    while (!isEnding_) (void)client.next(patience);
  }

  std::vector<std::unique_ptr<stream::Client>> clients_;
  std::atomic<bool> isEnding_{false};
  std::vector<std::future<void>> done_;  // the last member: its destructor waits for the threads
};

class StreamSuite {
 public:
  StreamSuite(const BenchOptions& options, const comm::Communicator& world,
              const std::shared_ptr<gpu::Device>& device, std::FILE* table)
      : options_(options),
        world_(world),
        device_(device),
        clock_(device),
        reconstruction_(reconstructionFromString(options.reconstruction)),
        generator_(device, comm::Communicator::world(), generatorOptionsFromEnvironment(world)),
        table_(table) {}

  std::vector<json> rows() {
    if (root()) {
      fmt::print(table_,
                 "{:<16} {:<7} {:>3} {:<8} {:>9} {:>6} {:>9} {:>9} {:>7} {:>10} {:>7} {:>10} {:>10} {:>8} "
                 "{:>8} {:>8} {:>9} {:>6}\n",
                 "data set", "way", "N_S", "rate", "full MiB", "one in", "first MiB", "SSIM full", "object",
                 "SSIM first", "object", "frames/s", "full/s", "age ms", "oldest", "view ms", "encode ms",
                 "crowd");
    }
    for (const DataSet& set : dataSets(options_)) {
      setBlocks(set);
      for (const std::uint32_t supersegments : options_.supersegments) {
        measure(set.name, benchSettings(options_, options_.algorithms.front(), supersegments));
      }
    }
    return std::move(rows_);
  }

 private:
  /// SSIM between a view and the true picture.
  struct Likeness {
    double whole = 0.0;
    double object = 0.0;  // over the object's bounding box, where no empty background hides errors
  };
  /// A viewer's figures for one level.
  struct LevelFigures {
    int factor = 1;  // the level keeps every factor-th list of each row and column
    double mebibytes = 0.0;
    Likeness ssim;
  };
  struct Sent {
    std::string dataset;
    std::string way;
    std::string rate;
    std::vector<LevelFigures> levels;  // the coarsest first
    double encodeMs = 0.0;             // all levels
    double stepMs = 0.0;               // a VDI made and published, without viewers
    double crowdStepMs = 0.0;
  };

  bool root() const { return world_.rank() == 0; }

  void setBlocks(const DataSet& set) {
    generator_.setBlocks(blocksOf(set, options_, device_, world_));
    world_.together([&] {
      function_ = apps::makeTransferFunction(options_.quality, generator_.scene(), generator_.scalarRange());
      const Camera camera = apps::makeCamera(options_.view, generator_.scene());
      cameras_.clear();
      for (int i = 0; i < viewpoints; ++i) cameras_.push_back(apps::turned(camera, i * 5.0, 0.0));
    });
  }

  void measure(const std::string& name, const GenerateSettings& settings) {
    GenerateSettings converged = settings;
    converged.samplesPerVoxel = options_.truthRate;
    converged.terminationOpacity = pictureTermination;
    const std::optional<Image> truth =
        generator_.renderVolume(apps::turned(cameras_.front(), options_.turn, 0.0), function_, converged);
    Sent sent;
    sent.dataset = name;
    std::vector<std::vector<std::byte>> files;
    for (int i = 0; i < viewpoints; ++i) {
      const std::optional<Vdi> vdi =
          generator_.generate(cameras_[static_cast<std::size_t>(i)], function_, settings);
      world_.together([&] {
        if (!root()) return;
        files.push_back(io::encode(*vdi));
        if (i > 0) return;
        const std::uint64_t expanded = io::decodeInfo(files.back()).expandedBytes;
        for (const int factor : stream::coarseFactorsOf(expanded))
          sent.levels.push_back(coarseFigures(*vdi, factor, *truth, settings));
        sent.levels.push_back({1, mebibytesOf(files.back()), ssimOf(*vdi, *truth, settings)});
        sent.encodeMs = repeated(options_.repeats, [&vdi] {
                          return wallMs([&vdi] {
                            stream::encodeFrame(
                                *vdi, 0, Clock::now(), [](const auto&) {}, [] { return true; });
                          });
                        }).median;
      });
    }
    measureSteps(sent, settings);
    for (const std::string& rate : options_.rates) {
      sent.rate = rate;
      sent.way = "live";
      sendLive(sent, settings);
      sent.way = "folder";
      world_.together([&] {
        if (root()) sendFiles(sent, settings, files);
      });
    }
  }

  static double mebibytesOf(const std::vector<std::byte>& file) {
    return static_cast<double>(file.size()) / (1 << 20);
  }

  Likeness ssimOf(const Vdi& vdi, const Image& truth, const GenerateSettings& settings) {
    VdiRenderer renderer(device_);
    renderer.setVdi(vdi);
    const io::Picture seen =
        io::toPicture(renderer.renderBytes(apps::turned(cameras_.front(), options_.turn, 0.0), settings.width,
                                           settings.height, Alpha::Premultiplied, reconstruction_));
    const io::Picture expected = io::toPicture(truth);
    return {compare(seen.rgb, expected.rgb, seen.width, seen.height, 3).ssim,
            objectSsim(seen.rgb, expected.rgb, seen.width, seen.height, 3)};
  }

  LevelFigures coarseFigures(const Vdi& vdi, int factor, const Image& truth,
                             const GenerateSettings& settings) {
    const Vdi coarse = thinned(vdi, factor);
    return {factor, mebibytesOf(io::encode(coarse)), ssimOf(coarse, truth, settings)};
  }

  stream::ServerOptions serverOptions(const std::string& rate) const {
    stream::ServerOptions server;
    server.token = stream::randomToken();
    server.mostBytesPerSecond = apps::bytesPerSecond(rate);
    return server;
  }

  std::unique_ptr<Viewer> viewerOf(const stream::Server& server, const GenerateSettings& settings, Log& log) {
    auto viewer = std::make_unique<Viewer>(server.link(), device_, options_.turn,
                                           glm::ivec2(settings.width, settings.height), reconstruction_, log);
    waitUntil([&viewer] { return viewer->isConnected(); });
    return viewer;
  }

  /// Waits until frame `index` is due.
  void waitFor(Clock::time_point start, int index) const {
    std::this_thread::sleep_until(
        start + std::chrono::duration_cast<Clock::duration>(Seconds(options_.period / 1000.0 * index)));
  }

  /// Measures steps that follow each other at once, alternately with eight viewers and with none. One of the
  /// eight takes nothing, and one vanishes.
  void measureSteps(Sent& sent, const GenerateSettings& settings) {
    constexpr int turns = 6;
    std::optional<stream::Server> server;
    std::optional<stream::Publisher> publisher;
    world_.together([&] {
      if (!root()) return;
      server.emplace(serverOptions(""));
      publisher.emplace(*server);
    });
    clock_.run();
    std::array<std::vector<double>, 2> times;
    for (int turn = 0; turn < turns; ++turn) {
      const bool isCrowded = turn % 2 == 1;
      std::optional<Crowd> crowd;
      world_.together([&] {
        if (root() && isCrowded) crowd.emplace(server->link());
      });
      for (int i = 0; i < options_.frames; ++i) {
        if (crowd && i == options_.frames / 2) crowd->loseOne();
        times[isCrowded ? 1 : 0].push_back(wallMs([&] {
          std::optional<Vdi> vdi = generator_.generate(
              cameras_[static_cast<std::size_t>(i) % cameras_.size()], function_, settings);
          if (vdi) publisher->publish(std::make_shared<const Vdi>(std::move(*vdi)));
        }));
      }
    }
    sent.stepMs = spreadOf(times[0]).median;
    sent.crowdStepMs = spreadOf(times[1]).median;
  }

  /// The ranks make each VDI when it is due. The root publishes it, as the extractor VDIStream
  /// does.
  void sendLive(const Sent& sent, const GenerateSettings& settings) {
    Log log;
    std::optional<stream::Server> server;
    std::optional<stream::Publisher> publisher;
    std::unique_ptr<Viewer> viewer;
    world_.together([&] {
      if (!root()) return;
      server.emplace(serverOptions(sent.rate));
      publisher.emplace(*server);
      viewer = viewerOf(*server, settings, log);
    });
    clock_.run();
    const Clock::time_point start = Clock::now();
    for (int i = 0; i < options_.frames; ++i) {
      const auto frame = static_cast<std::uint32_t>(i);
      if (root()) {
        waitFor(start, i);
        log.begin(frame);
      }
      std::optional<Vdi> vdi = generator_.generate(cameras_[frame % cameras_.size()], function_, settings);
      if (!vdi) continue;
      vdi->timeStep = frame;
      publisher->publish(std::make_shared<const Vdi>(std::move(*vdi)));
    }
    world_.together([&] {
      if (!root()) return;
      waitUntil([&] { return log.hasSeen(static_cast<std::uint32_t>(options_.frames - 1)); });
      viewer->finish();
      addRow(sent, settings, log.figures());
    });
  }

  /// Files appear in a folder, which the server follows as `vdi serve` does.
  void sendFiles(const Sent& sent, const GenerateSettings& settings,
                 const std::vector<std::vector<std::byte>>& files) {
    const Folder folder;
    const std::filesystem::path staged = folder.path() / "staged";
    const std::filesystem::path followed = folder.path() / "followed";
    std::filesystem::create_directory(staged);
    std::filesystem::create_directory(followed);
    for (int i = 0; i < options_.frames; ++i) {
      Vdi vdi = io::decode(files[static_cast<std::size_t>(i) % files.size()]);
      vdi.timeStep = static_cast<std::uint64_t>(i);
      io::writeVdi(staged / name(i), vdi);
    }
    Log log;
    apps::FrameFiles::Options options;
    options.folder = followed;
    options.log = [](const std::string&) {};
    apps::FrameFiles frames(options);
    stream::Server server(serverOptions(sent.rate));
    frames.start(server);
    const std::unique_ptr<Viewer> viewer = viewerOf(server, settings, log);
    const Clock::time_point start = Clock::now();
    for (int i = 0; i < options_.frames; ++i) {
      waitFor(start, i);
      log.begin(static_cast<std::uint32_t>(i));
      std::filesystem::rename(staged / name(i), followed / name(i));
    }
    waitUntil([&] { return log.hasSeen(static_cast<std::uint32_t>(options_.frames - 1)); });
    viewer->finish();
    addRow(sent, settings, log.figures());
  }

  static std::string name(int frame) { return fmt::format("{:06}.vdi", frame); }

  static json levelsOf(const Sent& sent) {
    json levels = json::array();
    for (const LevelFigures& level : sent.levels)
      levels.push_back({{"one_list_in", level.factor},
                        {"mib", level.mebibytes},
                        {"ssim", level.ssim.whole},
                        {"object_ssim", level.ssim.object}});
    return levels;
  }

  void addRow(const Sent& sent, const GenerateSettings& settings, const Log::Figures& figures) {
    const double milliseconds = 1000.0;
    const LevelFigures& full = sent.levels.back();
    const LevelFigures& first = sent.levels[figures.firstLevel];
    fmt::print(table_,
               "{:<16} {:<7} {:>3} {:<8} {:>9.2f} {:>6} {:>9.2f} {:>9.4f} {:>7.4f} {:>10.4f} {:>7.4f} "
               "{:>10.1f} {:>10.1f} {:>8.0f} {:>8.0f} {:>8.1f} {:>9.1f} {:>6.3f}\n",
               sent.dataset, sent.way, settings.supersegments, sent.rate, full.mebibytes, first.factor,
               first.mebibytes, full.ssim.whole, full.ssim.object, first.ssim.whole, first.ssim.object,
               figures.framesPerSecond, figures.fullPerSecond, figures.age.median * milliseconds,
               figures.age.maximum * milliseconds, figures.busy.median * milliseconds, sent.encodeMs,
               sent.crowdStepMs / sent.stepMs);
    std::fflush(table_);
    json row{{"dataset", sent.dataset},
             {"way", sent.way},
             {"rate", sent.rate},
             {"period_ms", options_.period},
             {"frames_sent", options_.frames},
             {"frames_seen", figures.frames},
             {"frames_per_second", figures.framesPerSecond},
             {"full_per_second", figures.fullPerSecond},
             {"age_ms", figures.age.median * milliseconds},
             {"oldest_ms", figures.age.maximum * milliseconds},
             {"view_ms", figures.busy.median * milliseconds},
             {"levels", levelsOf(sent)},
             {"first_level", figures.firstLevel},
             {"encode_ms", sent.encodeMs},
             {"step_ms", sent.stepMs},
             {"crowd_step_ratio", sent.crowdStepMs / sent.stepMs},
             {"ssim_full", full.ssim.whole},
             {"ssim_first", first.ssim.whole},
             {"object_ssim_full", full.ssim.object},
             {"object_ssim_first", first.ssim.object},
             {"turn", options_.turn},
             {"truth_rate", options_.truthRate},
             {"reconstruction", toString(reconstruction_)}};
    addSettings(row, settings);
    rows_.push_back(std::move(row));
  }

  const BenchOptions& options_;
  const comm::Communicator& world_;
  std::shared_ptr<gpu::Device> device_;
  ClockRaiser clock_;
  Reconstruction reconstruction_;
  VdiGenerator generator_;
  TransferFunction function_;    // for the current data set
  std::vector<Camera> cameras_;  // for the current data set
  std::FILE* table_;
  std::vector<json> rows_;
};

}  // namespace

void requireSoundStream(const BenchOptions& options) {
  for (const std::string& rate : options.rates) {
    const std::string reason = apps::requireRate(rate);
    if (!reason.empty()) throw Error(ErrorCode::InvalidArgument, reason, "--rates");
  }
  if (!(options.period >= 0.0) || !std::isfinite(options.period))
    throw Error(ErrorCode::InvalidArgument, "must be finite and at least 0", "--period");
  if (options.frames < 2)
    throw Error(ErrorCode::InvalidArgument, "the suite requires at least 2", "--frames");
}

std::vector<json> runStream(const BenchOptions& options, const comm::Communicator& world,
                            const std::shared_ptr<gpu::Device>& device, std::FILE* table) {
  return StreamSuite(options, world, device, table).rows();
}

}  // namespace vdi::bench
