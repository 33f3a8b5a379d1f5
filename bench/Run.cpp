#include "bench/Run.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "bench/RankGroup.h"
#include "bench/Rival.h"
#include "vdi/core/Error.h"
#include "vdi/io/Png.h"
#include "vdi/io/VdiFile.h"
#include "vdi/pipeline/VdiGenerator.h"
#include "vdi/pipeline/VdiRenderer.h"

namespace vdi::bench {

namespace {

/// Milliseconds of the slowest rank; 0 without reports, as on all ranks but the root.
template <typename Seconds>
double slowest(const std::vector<RankReport>& reports, Seconds seconds) {
  double worst = 0.0;
  for (const RankReport& report : reports) worst = std::max(worst, 1e3 * seconds(report));
  return worst;
}

double frameSeconds(const RankReport& r) {
  return r.generateSeconds + r.distributeSeconds + r.compositeSeconds + r.gatherSeconds;
}

/// A VDI of a data set, and the figures of making it. Only the root has both.
struct Made {
  std::optional<Vdi> vdi;
  GenerationFigures figures;
};

/// The truth for a VDI's views from one viewpoint. Only the root has the picture.
struct Truth {
  Camera camera;
  double angle = 0.0;
  io::Picture picture;  // by volume rendering at the rate of --truth-rate
  DvrFigures dvr;
};

ImageDifference differenceOf(const io::Picture& a, const io::Picture& b) {
  return compare(a.rgb, b.rgb, a.width, a.height, 3);
}

/// Collective, like the generator. Each rank runs the same stages, and the root collects the
/// figures.
class Bench {
 public:
  Bench(const BenchOptions& options, const comm::Communicator& world, std::shared_ptr<gpu::Device> device)
      : options_(options),
        world_(world),
        settings_(apps::makeSettings(options.quality)),
        reconstruction_(reconstructionFromString(options.reconstruction)),
        device_(device),
        clock_(device),
        generator_(std::move(device), comm::Communicator::world(), generatorOptionsFromEnvironment(world)) {
    if (options.rival.empty()) return;
    all_.emplace(world, world.size());
    rival_.emplace(device_, all_->communicator(), all_->handle());
  }

  /// Writes table lines to `table`. Returns no rows except on the root.
  std::vector<BenchRow> rows(std::FILE* table) {
    table_ = table;
    if (root()) fmt::print(table_, "{}\n", tableHead());
    for (const DataSet& set : dataSets(options_)) measure(set);
    return std::move(rows_);
  }

 private:
  bool root() const { return world_.rank() == 0; }

  void measure(const DataSet& set) {
    std::vector<Block> blocks = blocksOf(set, options_, device_, world_);
    upload_ = measureUpload(blocks);
    generator_.setBlocks(blocks);
    if (rival_) rival_->setBlocks(blocks, generator_.scene(), options_.repeats);
    blocks.clear();
    if (root()) {
      fmt::print(table_, "{}: upload {:.1f} ms", set.name, upload_.milliseconds);
      if (upload_.stepMs) fmt::print(table_, "; a frame during the next upload {:.1f} ms", *upload_.stepMs);
      fmt::print(table_, "\n");
    }
    for (int view = 0; view < options_.views; ++view) measureView(set, 360.0 * view / options_.views);
  }

  /// The parameters of a view of the current data set.
  struct Shot {
    Camera camera;
    TransferFunction function;
  };

  Shot shotFrom(double turned) {
    Shot shot;
    world_.together([&] {
      shot.camera = apps::makeCamera(options_.view, generator_.scene()).azimuth(turned);
      shot.function =
          apps::makeTransferFunction(options_.quality, generator_.scene(), generator_.scalarRange());
    });
    return shot;
  }

  UploadTimes measureUpload(const std::vector<Block>& blocks) {
    UploadTimes upload;
    upload.milliseconds =
        repeated(options_.repeats, [&] { return wallMs([&] { generator_.setBlocks(blocks); }); }).median;
    std::uint64_t bytes = 0;
    for (const Block& block : blocks) bytes += block.byteCount();
    std::array<std::uint64_t, 1> full{3 * bytes > device_->limits().memoryBytes ? 1U : 0U};
    world_.allReduceMax(full);
    if (full[0] != 0) return upload;  // no memory for two volumes
    const Shot shot = shotFrom(0.0);
    const GenerateSettings settings =
        benchSettings(options_, options_.algorithms.front(), options_.supersegments.front());
    upload.stepMs = repeated(options_.repeats, [&] {
                      return wallMs([&] {
                        generator_.setNextBlocks(blocks);
                        generator_.generate(shot.camera, shot.function, settings);
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
    if (rival_) measureRival(shot);
    for (const std::string& algorithm : options_.algorithms) {
      for (const std::uint32_t supersegments : options_.supersegments) {
        settings_ = benchSettings(options_, algorithm, supersegments);
        const Made made = make(shot);
        world_.together([&] {
          if (!root()) return;
          VdiRenderer renderer(device_);
          renderer.setVdi(*made.vdi);
          for (const Truth& truth : truths)
            addRow(set.name, turned, made, truth, seen(truth, shot, renderer));
          fmt::print(table_, "{}", stageLines(made.figures.frames));
        });
      }
    }
  }

  void measureRival(const Shot& shot) {
    const std::optional<Image> ours = generator_.renderVolume(shot.camera, shot.function, settings_);
    rivalFigures_ = rival_->measure(clock_, {shot.camera, shot.function, settings_}, options_.repeats, ours);
    if (root()) fmt::print(table_, "{}", rivalLine(*rivalFigures_));
  }

  /// Device time of the last generation or volume rendering.
  double deviceMs() const {
    return slowest(generator_.reports(), [](const RankReport& r) { return r.generateDeviceSeconds; });
  }

  /// Leaves out the warm-up's values.
  std::vector<double> lastOf(const std::vector<double>& values) const {
    return {values.end() - options_.repeats, values.end()};
  }

  Truth volumeRendering(const Camera& camera, double angle, const TransferFunction& function) {
    Truth truth;
    truth.camera = camera;
    truth.angle = angle;
    std::vector<double> frames;
    std::optional<Image> image;
    truth.dvr.device = repeated(options_.repeats, [&] {
      clock_.run();
      image.reset();  // the next picture reuses its memory
      image = generator_.renderVolume(camera, function, settings_);
      frames.push_back(slowest(generator_.reports(), frameSeconds));
      return deviceMs();
    });
    truth.dvr.frame = spreadOf(lastOf(frames));
    GenerateSettings converged = settings_;
    converged.samplesPerVoxel = options_.truthRate;
    const std::optional<Image> best = generator_.renderVolume(camera, function, converged);
    if (!root()) return truth;
    truth.picture = io::toPicture(*best);
    truth.dvr.fromTruth = differenceOf(io::toPicture(*image), truth.picture);
    return truth;
  }

  Made make(const Shot& shot) {
    Made made;
    FrameLog log;
    FrameLog pictureLog;
    std::vector<double> frames;
    std::vector<double> ratios;
    std::vector<double> counts;
    std::vector<double> writes;
    made.figures.device = repeated(options_.repeats, [&] {
      clock_.run();
      const double pictureMs =
          readyMs(world_, [&] { generator_.renderVolume(shot.camera, shot.function, settings_); });
      pictureLog.add(pictureMs, generator_.reports());
      const double volumeMs = deviceMs();
      made.vdi.reset();
      clock_.run();
      const double wallMs =
          readyMs(world_, [&] { made.vdi = generator_.generate(shot.camera, shot.function, settings_); });
      log.add(wallMs, generator_.reports());
      frames.push_back(slowest(generator_.reports(), frameSeconds));
      ratios.push_back(volumeMs > 0.0 ? deviceMs() / volumeMs : 0.0);
      counts.push_back(slowest(generator_.reports(), [](const RankReport& r) { return r.countSeconds; }));
      writes.push_back(slowest(generator_.reports(), [](const RankReport& r) { return r.writeSeconds; }));
      return deviceMs();
    });
    made.figures.overDvr = spreadOf(lastOf(ratios));
    made.figures.frame = spreadOf(lastOf(frames));
    made.figures.countMs = spreadOf(lastOf(counts)).median;
    made.figures.writeMs = spreadOf(lastOf(writes)).median;
    made.figures.frames = log.figures(static_cast<std::size_t>(options_.repeats));
    made.figures.frames.takePictures(pictureLog.figures(static_cast<std::size_t>(options_.repeats)));
    const FrameInput input{shot.camera, shot.function, settings_};
    made.figures.frames.shown = measureShown(generator_, device_, clock_, input, options_.repeats);
    if (options_.frames > 0) {
      made.figures.frames.orbitFrames = options_.frames;
      made.figures.frames.vdisPerSecond = vdisPerSecond(generator_, clock_, input, options_.frames);
    }
    world_.together([&] {
      if (!root()) return;
      made.figures.supersegments = made.vdi->supersegmentCount();
      made.figures.storedBytes = io::encode(*made.vdi).size();
    });
    return made;
  }

  /// Measures a view on the root.
  ViewFigures seen(const Truth& truth, const Shot& shot, VdiRenderer& renderer) {
    ViewFigures figures;
    ImageBytes image;
    std::vector<double> ratios;
    std::vector<double> frames;
    figures.device = repeated(options_.repeats, [&] {
      double volumeMs = 0.0;
      if (world_.size() == 1) {
        clock_.run();
        generator_.renderVolume(truth.camera, shot.function, settings_);
        volumeMs = deviceMs();
      }
      clock_.run();
      frames.push_back(wallMs([&] {
        image = renderer.renderBytes(truth.camera, settings_.width, settings_.height, Alpha::Premultiplied,
                                     reconstruction_);
      }));
      ratios.push_back(volumeMs / renderer.renderMilliseconds());
      return renderer.renderMilliseconds();
    });
    figures.dvrOverDevice = spreadOf(lastOf(ratios)).median;
    figures.frame = spreadOf(lastOf(frames));
    figures.fromTruth = differenceOf(io::toPicture(image), truth.picture);
    return figures;
  }

  void addRow(const std::string& name, double turned, const Made& made, const Truth& truth,
              const ViewFigures& view) {
    BenchRow row;
    row.dataset = name;
    row.settings = settings_;
    row.reconstruction = reconstruction_;
    row.truthRate = options_.truthRate;
    row.viewDegrees = turned;
    row.angleDegrees = truth.angle;
    row.upload = upload_;
    row.dvr = truth.dvr;
    row.generation = made.figures;
    row.view = view;
    row.rival = rivalFigures_;
    fmt::print(table_, "{}\n", tableLine(row));
    std::fflush(table_);
    rows_.push_back(std::move(row));
  }

  const BenchOptions& options_;
  const comm::Communicator& world_;
  GenerateSettings settings_;
  Reconstruction reconstruction_;
  std::shared_ptr<gpu::Device> device_;
  ClockRaiser clock_;
  VdiGenerator generator_;
  std::optional<RankGroup> all_;  // the rival's ranks
  std::optional<IcetRival> rival_;
  std::optional<RivalFigures> rivalFigures_;  // figures of the current viewpoint
  UploadTimes upload_;                        // times of the current data set
  std::FILE* table_ = nullptr;
  std::vector<BenchRow> rows_;
};

}  // namespace

std::vector<BenchRow> runBench(const BenchOptions& options, const comm::Communicator& world,
                               const std::shared_ptr<gpu::Device>& device, std::FILE* table) {
  return Bench(options, world, device).rows(table);
}

}  // namespace vdi::bench
