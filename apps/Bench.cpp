// vdi bench: how long each stage takes and how true the result is.
#include "apps/Bench.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <utility>

#include "BuildCommit.h"
#include "apps/Commands.h"
#include "apps/Source.h"
#include "vdi/core/Error.h"
#include "vdi/core/ImageMetrics.h"
#include "vdi/gpu/Commands.h"
#include "vdi/gpu/Device.h"
#include "vdi/gpu/Memory.h"
#include "vdi/io/Png.h"
#include "vdi/io/VdiFile.h"
#include "vdi/pipeline/Pipeline.h"

namespace vdi::apps {

namespace {

using nlohmann::json;

struct Options {
  std::vector<std::string> raws;
  std::vector<std::string> fields;
  DealOptions deal;
  ViewOptions view;
  QualityOptions quality;
  std::vector<double> angles{0.0, 5.0, 10.0, 20.0, 30.0, 40.0, 50.0};
  std::vector<std::string> algorithms;       // empty: merge, or the suite's
  std::vector<std::uint32_t> supersegments;  // empty: 25, or the suite's
  int views = 0;                             // 0: 1, or the suite's
  int repeats = 5;
  std::string reconstruction = "smooth";
  std::string suite;
  std::string output;
  std::vector<std::string> comparison;
};

struct DataSet {
  std::string name;
  std::string field;  // or, if empty:
  std::string raw;    // sidecar
  std::string size;
  std::string type;
};

/// The paper's configurations (its section 6), with fields of the same size, type and character instead of
/// its data. Names: what they stand in for.
std::vector<DataSet> suiteSets(const std::string& suite) {
  if (suite == "paper") {
    return {{"kingsnake-like", "coil", "", "1024x1024x795", "u8"},
            {"rayleigh-taylor-like", "mixing", "", "1024x1024x1024", "u16"},
            {"richtmyer-meshkov-like", "interface", "", "2048x2048x1920", "u8"}};
  }
  return {{"kingsnake-like", "coil", "", "64x64x50", "u8"},
          {"rayleigh-taylor-like", "mixing", "", "64x64x64", "u16"},
          {"richtmyer-meshkov-like", "interface", "", "96x96x90", "u8"}};
}

void applySuite(Options& options) {
  const bool paper = options.suite == "paper";
  const bool small = options.suite == "small";
  if (paper || small) {
    if (options.views == 0) options.views = paper ? 4 : 1;
    options.quality.resolution = paper ? "1920x1080" : "240x136";
  }
  if (options.algorithms.empty()) {
    options.algorithms = {"merge"};
    if (paper || small) options.algorithms.emplace_back("bisection");
  }
  if (options.views == 0) options.views = 1;
  if (options.supersegments.empty()) {
    options.supersegments = paper   ? std::vector<std::uint32_t>{20, 25, 30}
                            : small ? std::vector<std::uint32_t>{10}
                                    : std::vector<std::uint32_t>{25};
  }
  if (small) options.repeats = std::min(options.repeats, 3);
}

std::vector<DataSet> dataSets(const Options& options) {
  if (!options.suite.empty()) {
    std::vector<DataSet> sets = suiteSets(options.suite);
    if (!options.fields.empty()) {
      std::erase_if(sets, [&](const DataSet& set) {
        return std::find(options.fields.begin(), options.fields.end(), set.field) == options.fields.end();
      });
    }
    return sets;
  }
  std::vector<DataSet> sets;
  for (const std::string& sidecar : options.raws)
    sets.push_back({std::filesystem::path(sidecar).stem().string(), "", sidecar, "", ""});
  std::vector<std::string> fields = options.fields;
  if (fields.empty() && options.raws.empty()) fields = {"turbulence", "mixing", "coil"};
  for (const std::string& field : fields)
    sets.push_back({field, field, "", options.deal.size, options.deal.type});
  return sets;
}

struct Spread {
  double median = 0.0;
  double least = 0.0;
  double most = 0.0;
};

Spread spreadOf(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t half = values.size() / 2;
  const double middle = values.size() % 2 == 1 ? values[half] : 0.5 * (values[half - 1] + values[half]);
  return {middle, values.front(), values.back()};
}

/// Of the milliseconds that `measure` returns, after a run that doesn't count.
template <typename Measure>
Spread repeated(int repeats, Measure measure) {
  measure();
  std::vector<double> times(static_cast<std::size_t>(repeats));
  for (double& time : times) time = measure();
  return spreadOf(times);
}

/// A GPU lowers its clock while the host works, to a fifth of what it has when it's busy, and takes a second
/// or two to raise it again: gives it something to do before a run that counts. Nothing on a CPU.
class ClockRaiser {
 public:
  explicit ClockRaiser(const std::shared_ptr<gpu::Device>& device) : commands_(device) {
    constexpr std::uint64_t bytes = std::uint64_t{256} << 20;
    if (!device->isCpu()) buffer_ = gpu::Buffer(device, bytes, gpu::MemoryKind::DeviceLocal);
  }

  void run() {
    if (!buffer_) return;
    using std::chrono::milliseconds;
    const bool low = Clock::now() - lastRun_ > milliseconds(1000);
    const auto enough = Clock::now() + (low ? milliseconds(2500) : milliseconds(30));
    while (Clock::now() < enough) {
      constexpr int fills = 16;  // a millisecond on a fast GPU
      commands_.begin();
      for (int i = 0; i < fills; ++i) commands_.fill(buffer_, 0);
      commands_.submitAndWait();
    }
    lastRun_ = Clock::now();
  }

 private:
  using Clock = std::chrono::steady_clock;
  gpu::Commands commands_;
  gpu::Buffer buffer_;
  Clock::time_point lastRun_;
};

/// Milliseconds of the slowest rank; 0 where there are no reports, that is, not on the root.
template <typename Seconds>
double slowest(const std::vector<RankReport>& reports, Seconds seconds) {
  double worst = 0.0;
  for (const RankReport& report : reports) worst = std::max(worst, 1e3 * seconds(report));
  return worst;
}

double frameSeconds(const RankReport& r) {
  return r.generateSeconds + r.distributeSeconds + r.compositeSeconds + r.gatherSeconds;
}

template <typename Work>
double wallMs(Work work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

/// What a data set's values take to get to the device.
struct Upload {
  double milliseconds = 0.0;
  /// Of a time step, whose frame is made while the next one's values are on their way.
  std::optional<double> stepMs;
};

/// One VDI of a data set and what making it took. Only the root has it.
struct Made {
  std::optional<Vdi> vdi;
  Spread generate;
  Spread overVolume;  // device time of generation / that of volume rendering right before it
  Spread frame;
  double searchMs = 0.0;
  double writeMs = 0.0;
  double compositeMs = 0.0;
  std::size_t storedBytes = 0;
};

struct Truth {
  Camera camera;
  double angle = 0.0;
  std::optional<Image> image;
  Spread cast;
  Spread frame;
};

/// Collective, as the generator is: every rank runs the same stages, the root collects the figures.
class Bench {
 public:
  Bench(const Options& options, const comm::Communicator& world, std::shared_ptr<gpu::Device> device)
      : options_(options),
        world_(world),
        settings_(makeSettings(options.quality)),
        reconstruction_(reconstructionFromString(options.reconstruction)),
        device_(device),
        clock_(device),
        generator_(std::move(device), comm::Communicator::world()) {}

  /// Table lines go to `table`. Empty on all ranks but the root.
  json rows(std::FILE* table) {
    table_ = table;
    if (root()) {
      fmt::print(table_,
                 "{:<22} {:<9} {:>3} {:>4} {:>5} {:>9} {:>9} {:>6} {:>9} {:>6} {:>9} {:>7} {:>7} {:>8}\n",
                 "data set", "algorithm", "N_S", "view", "angle", "DVR", "generate", "/ DVR", "render",
                 "faster", "composite", "SSIM", "PSNR", "stored");
    }
    for (const DataSet& set : dataSets(options_)) measure(set);
    return rows_;
  }

 private:
  bool root() const { return world_.rank() == 0; }

  void measure(const DataSet& set) {
    std::vector<Block> blocks;
    world_.together([&] {
      DealOptions deal = options_.deal;
      if (!set.size.empty()) deal.size = set.size;
      if (!set.type.empty()) deal.type = set.type;
      blocks = set.field.empty() ? rawBlocks(set.raw, deal, world_.rank(), world_.size())
                                 : fieldBlocks(set.field, deal, device_, world_.rank(), world_.size());
    });
    upload_ = measureUpload(blocks);
    generator_.setBlocks(std::move(blocks));
    if (root()) {
      fmt::print(table_, "{}: upload {:.1f} ms", set.name, upload_.milliseconds);
      if (upload_.stepMs) fmt::print(table_, "; a frame beside the next upload {:.1f} ms", *upload_.stepMs);
      fmt::print(table_, "\n");
    }
    for (int view = 0; view < options_.views; ++view) measureView(set, 360.0 * view / options_.views);
  }

  /// What a view of the data set that's shown is seen with.
  struct Shot {
    Camera camera;
    TransferFunction function;
  };

  Shot shotFrom(double turned) {
    Shot shot;
    world_.together([&] {
      shot.camera = makeCamera(options_.view, generator_.scene()).azimuth(turned);
      shot.function = makeTransferFunction(options_.quality, generator_.scene(), generator_.scalarRange());
    });
    return shot;
  }

  GenerateSettings settingsFor(const std::string& algorithm, std::uint32_t supersegments) const {
    GenerateSettings settings = makeSettings(options_.quality);
    settings.algorithm = algorithmFromString(algorithm);
    if (settings.algorithm == Algorithm::Bisection) {  // which knows no other
      settings.budget = Budget::List;
      settings.fill = 1.0;
    }
    settings.supersegments = supersegments;
    return settings;
  }

  Upload measureUpload(const std::vector<Block>& blocks) {
    Upload upload;
    upload.milliseconds =
        repeated(options_.repeats, [&] { return wallMs([&] { generator_.setBlocks(blocks); }); }).median;
    std::uint64_t bytes = 0;
    for (const Block& block : blocks) bytes += block.byteCount();
    std::array<std::uint64_t, 1> full{3 * bytes > device_->limits().memoryBytes ? 1U : 0U};
    world_.allReduceMax(full);
    if (full[0] != 0) return upload;  // no room for two volumes
    const Shot shot = shotFrom(0.0);
    const GenerateSettings settings =
        settingsFor(options_.algorithms.front(), options_.supersegments.front());
    upload.stepMs = repeated(options_.repeats, [&] {
                      return wallMs([&] {
                        generator_.setNextBlocks(blocks);
                        std::optional<Vdi> vdi = generator_.generate(shot.camera, shot.function, settings);
                        if (vdi) generator_.recycle(std::move(*vdi));
                        generator_.advance();
                      });
                    }).median;
    return upload;
  }

  void measureView(const DataSet& set, double turned) {
    const Shot shot = shotFrom(turned);
    std::vector<Truth> truths;
    for (const double angle : options_.angles)
      truths.push_back(volumeRendering(shot.camera.azimuth(angle), angle, shot.function));
    for (const std::string& algorithm : options_.algorithms) {
      for (const std::uint32_t supersegments : options_.supersegments) {
        settings_ = settingsFor(algorithm, supersegments);
        const Made made = make(shot);
        world_.together([&] {
          if (!root()) return;
          VdiRenderer renderer(device_);
          renderer.setVdi(*made.vdi);
          for (const Truth& truth : truths) addRow(set.name, turned, shot.function, made, renderer, truth);
        });
      }
    }
  }

  /// Of the last generation or volume rendering.
  double deviceMs() const {
    return slowest(generator_.reports(), [](const RankReport& r) { return r.generateDeviceSeconds; });
  }

  /// Without the warm-up's.
  std::vector<double> lastOf(const std::vector<double>& values) const {
    return {values.end() - options_.repeats, values.end()};
  }

  Truth volumeRendering(const Camera& camera, double angle, const TransferFunction& function) {
    Truth truth{camera, angle, {}, {}, {}};
    std::vector<double> frames;
    truth.cast = repeated(options_.repeats, [&] {
      clock_.run();
      if (truth.image) generator_.recycle(std::move(*truth.image));
      truth.image = generator_.renderVolume(camera, function, settings_);
      frames.push_back(slowest(generator_.reports(), frameSeconds));
      return deviceMs();
    });
    truth.frame = spreadOf(lastOf(frames));
    return truth;
  }

  Made make(const Shot& shot) {
    Made made;
    std::vector<double> composites;
    std::vector<double> frames;
    std::vector<double> ratios;
    std::vector<double> searches;
    std::vector<double> writes;
    made.generate = repeated(options_.repeats, [&] {
      clock_.run();
      generator_.renderVolume(shot.camera, shot.function, settings_);
      const double volumeMs = deviceMs();
      if (made.vdi) generator_.recycle(std::move(*made.vdi));
      clock_.run();
      made.vdi = generator_.generate(shot.camera, shot.function, settings_);
      composites.push_back(
          slowest(generator_.reports(), [](const RankReport& r) { return r.compositeSeconds; }));
      frames.push_back(slowest(generator_.reports(), frameSeconds));
      ratios.push_back(volumeMs > 0.0 ? deviceMs() / volumeMs : 0.0);
      searches.push_back(slowest(generator_.reports(), [](const RankReport& r) { return r.searchSeconds; }));
      writes.push_back(slowest(generator_.reports(), [](const RankReport& r) { return r.writeSeconds; }));
      return deviceMs();
    });
    made.overVolume = spreadOf(lastOf(ratios));
    made.frame = spreadOf(lastOf(frames));
    made.compositeMs = spreadOf(lastOf(composites)).median;
    made.searchMs = spreadOf(lastOf(searches)).median;
    made.writeMs = spreadOf(lastOf(writes)).median;
    world_.together([&] {
      if (root()) made.storedBytes = io::encode(*made.vdi).size();
    });
    return made;
  }

  void addRow(const std::string& name, double turned, const TransferFunction& function, const Made& made,
              VdiRenderer& renderer, const Truth& truth) {
    ImageBytes seen;
    std::vector<double> ratios;
    std::vector<double> frames;
    const Spread render = repeated(options_.repeats, [&] {
      double volumeMs = 0.0;
      if (world_.size() == 1) {
        clock_.run();
        generator_.renderVolume(truth.camera, function, settings_);
        volumeMs = deviceMs();
      }
      clock_.run();
      frames.push_back(wallMs([&] {
        seen = renderer.renderBytes(truth.camera, settings_.width, settings_.height, Alpha::Premultiplied,
                                    reconstruction_);
      }));
      ratios.push_back(volumeMs / renderer.renderMilliseconds());
      return renderer.renderMilliseconds();
    });
    const double speedup = spreadOf(lastOf(ratios)).median;
    const ImageDifference d =
        compare(io::toPicture(seen).rgb, io::toPicture(*truth.image).rgb, seen.width, seen.height, 3);
    const auto spread = [](const Spread& s) { return s.most - s.least; };
    fmt::print(table_,
               "{:<22} {:<9} {:>3} {:>4g} {:>5g} {:>9.3f} {:>9.3f} {:>6.2f} {:>9.3f} {:>6.2f} {:>9.3f} "
               "{:>7.4f} {:>7.2f} "
               "{:>8.2f}\n",
               name, toString(settings_.algorithm), settings_.supersegments, turned, truth.angle,
               truth.cast.median, made.generate.median, made.overVolume.median, render.median, speedup,
               made.compositeMs, d.ssim, d.psnrDb, static_cast<double>(made.storedBytes) / (1 << 20));
    std::fflush(table_);
    rows_.push_back({{"dataset", name},
                     {"algorithm", toString(settings_.algorithm)},
                     {"precision", toString(made.vdi->precision())},
                     {"reconstruction", toString(reconstruction_)},
                     {"supersegments", settings_.supersegments},
                     {"budget", toString(settings_.budget)},
                     {"fill", settings_.fill},
                     {"width", settings_.width},
                     {"height", settings_.height},
                     {"upload_ms", upload_.milliseconds},
                     {"step_ms", upload_.stepMs ? json(*upload_.stepMs) : json(nullptr)},
                     {"view_deg", turned},
                     {"angle_deg", truth.angle},
                     {"dvr_ms", truth.cast.median},
                     {"dvr_spread_ms", spread(truth.cast)},
                     {"dvr_frame_ms", truth.frame.median},
                     {"generate_ms", made.generate.median},
                     {"generate_spread_ms", spread(made.generate)},
                     {"generate_over_dvr", made.overVolume.median},
                     {"dvr_over_render", world_.size() == 1 ? json(speedup) : json(nullptr)},
                     {"generate_frame_ms", made.frame.median},
                     {"generate_search_ms", made.searchMs},
                     {"generate_write_ms", made.writeMs},
                     {"composite_ms", world_.size() > 1 ? json(made.compositeMs) : json(nullptr)},
                     {"render_ms", render.median},
                     {"render_frame_ms", spreadOf(lastOf(frames)).median},
                     {"render_spread_ms", spread(render)},
                     {"ssim", d.ssim},
                     {"psnr_db", std::isfinite(d.psnrDb) ? json(d.psnrDb) : json(nullptr)},
                     {"supersegment_count", made.vdi->supersegmentCount()},
                     {"stored_bytes", made.storedBytes}});
  }

  const Options& options_;
  const comm::Communicator& world_;
  GenerateSettings settings_;
  Reconstruction reconstruction_;
  std::shared_ptr<gpu::Device> device_;
  ClockRaiser clock_;
  VdiGenerator generator_;
  Upload upload_;  // of the data set that's shown
  std::FILE* table_ = nullptr;
  json rows_ = json::array();
};

std::string today() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  return fmt::format("{:04}-{:02}-{:02}", utc.tm_year + 1900, utc.tm_mon + 1, utc.tm_mday);
}

void write(const json& document, const std::string& path) {
  if (path.empty()) {
    fmt::print("{}\n", document.dump(2));
    return;
  }
  std::ofstream file(path);
  file << document.dump(2) << "\n";
  file.close();
  if (!file) throw Error(ErrorCode::Io, "can't write the file", path);
}

void measureAll(const Options& options, const comm::Communicator& world) {
  std::shared_ptr<gpu::Device> device;
  world.together([&] {
    if (options.repeats < 1) throw Error(ErrorCode::InvalidArgument, "--repeats must be at least 1");
    for (const std::string& algorithm : options.algorithms) (void)algorithmFromString(algorithm);
    device = gpu::Device::create(gpu::requestFromEnvironment(world.localRank()));
    (void)reconstructionFromString(options.reconstruction);
    (void)makeSettings(options.quality);  // before anything takes time
  });
  // The table must not get between the lines of the JSON.
  std::FILE* table = options.output.empty() ? stderr : stdout;
  if (world.rank() == 0) {
    fmt::print(table, "device: {}, ranks: {}, commit: {}; milliseconds, dB, MiB\n", device->name(),
               world.size(), buildCommit);
  }
  const json rows = Bench(options, world, device).rows(table);
  world.together([&] {
    if (world.rank() != 0) return;
    write({{"device", device->name()},
           {"commit", buildCommit},
           {"date", today()},
           {"ranks", world.size()},
           {"rows", rows}},
          options.output);
  });
}

void run(Options options, const comm::Communicator& world) {
  if (!options.comparison.empty()) {
    int regressions = 0;
    world.together([&] {
      if (world.rank() == 0)
        regressions = compareBenches(options.comparison[0], options.comparison[1], stdout);
      if (regressions > 0)
        throw Error(ErrorCode::InvalidArgument, fmt::format("{} regressions", regressions));
    });
    return;
  }
  applySuite(options);
  measureAll(options, world);
}

}  // namespace

void addBench(CLI::App& app, Job& job) {
  CLI::App* command = app.add_subcommand(
      "bench", "Time every stage on this device and compare a VDI's views with volume rendering");
  command->footer(
      "Each time is the median over the repeats, of the slowest rank. DVR and generate are device times of "
      "the\n"
      "rank's own volume rendering and of its (sub-)VDI, compact, without transfers; the columns '/ DVR' and "
      "'faster'\n"
      "are ratios to a volume rendering right before. A GPU is kept busy before each run that counts.\n"
      "JSON has whole frames too, transfers and compositing included (dvr_frame_ms, generate_frame_ms,\n"
      "render_frame_ms), the upload of the values (upload_ms), and a frame made while the next step's are "
      "on\n"
      "their way (step_ms).\n"
      "composite is what merging took under mpirun;\n"
      "render is the device's time for one view of the VDI. SSIM and PSNR compare that view with DVR; JSON "
      "has null\n"
      "for what wasn't measured and for the infinite PSNR of equal pictures.");
  const auto options = std::make_shared<Options>();
  command
      ->add_option("--fields", options->fields,
                   "procedural fields to run, by default turbulence, mixing "
                   "and coil:" +
                       fieldsHelp())
      ->type_name("NAME")
      ->group("Volume and ranks");
  command->add_option("--raw", options->raws, "JSON sidecars of raw volumes to run (docs/raw-volumes.md)")
      ->type_name("FILE")
      ->group("Volume and ranks");
  addDealOptions(*command, options->deal);
  addViewOptions(*command, options->view);
  addQualityOptions(*command, options->quality, QualityUse::Several);
  command->add_option("--algorithms", options->algorithms, "merge (the default), bisection or both")
      ->type_name("NAME");
  command->add_option("--supersegments", options->supersegments, "one or several N_S; default: 25");
  command->add_option("--views", options->views, "viewpoints of VDIs, evenly around the scene; default: 1")
      ->check(CLI::Range(1, 360));
  command->add_option("--angles", options->angles, "degrees from the VDI's viewpoint")
      ->type_name("DEG")
      ->capture_default_str();
  addReconstructionOption(*command, options->reconstruction);
  command->add_option("--repeats", options->repeats, "runs of which the median counts, after one warm-up")
      ->capture_default_str();
  command
      ->add_option(
          "--suite", options->suite,
          "data sets, sizes, viewpoints and N_S of docs/benchmarks.md: paper (needs a GPU and 32 GiB), "
          "small (a minute on a CPU); --fields picks some of it")
      ->check(CLI::IsMember({"paper", "small"}));
  command
      ->add_option(
          "--compare", options->comparison,
          "two JSON files, before and after: tells what got slower by more than 10 % and the spread, "
          "larger by more than 5 %, or less true; exit status 1 if anything did")
      ->expected(2)
      ->type_name("FILE FILE");
  command
      ->add_option("-o,--output", options->output,
                   "JSON file; default: standard output, and the table goes to standard error")
      ->type_name("FILE");
  command->callback([options, &job] {
    job = {[options](const comm::Communicator& world) { run(*options, world); }, true};
  });
}

}  // namespace vdi::apps
