// vdi bench: how long each stage takes and how true the result is.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "BuildCommit.h"
#include "apps/Commands.h"
#include "apps/Source.h"
#include "vdi/core/Error.h"
#include "vdi/core/ImageMetrics.h"
#include "vdi/io/Png.h"
#include "vdi/io/VdiFile.h"
#include "vdi/pipeline/Compositor.h"
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
  int repeats = 5;
  std::string output;
};

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? values[half] : 0.5 * (values[half - 1] + values[half]);
}

/// Median of the milliseconds that `measure` returns, after one run that doesn't count.
template <typename Measure>
double medianOf(int repeats, Measure measure) {
  measure();
  std::vector<double> times(static_cast<std::size_t>(repeats));
  for (double& time : times) time = measure();
  return median(times);
}

/// Milliseconds of the slowest rank; 0 where there are no reports, that is, not on the root.
template <typename Seconds>
double slowest(const std::vector<RankReport>& reports, Seconds seconds) {
  double worst = 0.0;
  for (const RankReport& report : reports) worst = std::max(worst, 1e3 * seconds(report));
  return worst;
}

/// One VDI of a data set and what making it took. Only the root has it.
struct Made {
  std::optional<Vdi> vdi;
  double generateMs = 0.0;
  double compositeMs = 0.0;
  std::size_t storedBytes = 0;
};

/// Collective, as the generator is: every rank runs the same stages, the root collects the figures.
class Bench {
 public:
  Bench(const Options& options, const comm::Communicator& world, std::shared_ptr<gpu::Device> device)
      : options_(options),
        world_(world),
        settings_(makeSettings(options.quality)),
        device_(device),
        generator_(std::move(device), comm::Communicator::world()) {}

  /// Table lines go to `table`. Empty on all ranks but the root.
  json rows(std::FILE* table) {
    table_ = table;
    json rows = json::array();
    for (const std::string& sidecar : options_.raws) {
      measure(std::filesystem::path(sidecar).stem().string(), rows,
              [&] { return rawBlocks(sidecar, options_.deal, world_.rank(), world_.size()); });
    }
    std::vector<std::string> fields = options_.fields;
    if (fields.empty() && options_.raws.empty()) fields = {"turbulence", "mixing", "coil"};
    for (const std::string& field : fields) {
      measure(field, rows, [&] { return fieldBlocks(field, options_.deal, world_.rank(), world_.size()); });
    }
    return rows;
  }

 private:
  bool root() const { return world_.rank() == 0; }

  template <typename MakeBlocks>
  void measure(const std::string& name, json& rows, MakeBlocks makeBlocks) {
    std::vector<Block> blocks;
    world_.together([&] { blocks = makeBlocks(); });
    generator_.setBlocks(std::move(blocks));
    Camera camera;
    TransferFunction function;
    world_.together([&] {
      camera = makeCamera(options_.view, generator_.scene());
      function = makeTransferFunction(options_.quality, generator_.scene(), generator_.scalarRange());
    });
    const Made made = make(camera, function);
    std::optional<VdiRenderer> renderer;
    world_.together([&] {
      if (!root()) return;
      renderer.emplace(device_);
      renderer->setVdi(*made.vdi);
    });
    for (const double angle : options_.angles) {
      const Camera other = angle == 0.0 ? camera : camera.azimuth(angle);
      std::optional<Image> truth;
      const double volumeMs = medianOf(options_.repeats, [&] {
        truth = generator_.renderVolume(other, function, settings_);
        return slowest(generator_.reports(), [](const RankReport& r) {
          return r.generateSeconds + r.distributeSeconds + r.compositeSeconds + r.gatherSeconds;
        });
      });
      world_.together([&] {
        if (root()) rows.push_back(row(name, angle, made, volumeMs, *renderer, other, *truth));
      });
    }
  }

  Made make(const Camera& camera, const TransferFunction& function) {
    Made made;
    std::vector<double> compositeTimes;
    made.generateMs = medianOf(options_.repeats, [&] {
      made.vdi = generator_.generate(camera, function, settings_);
      compositeTimes.push_back(
          slowest(generator_.reports(), [](const RankReport& r) { return r.compositeSeconds; }));
      return slowest(generator_.reports(), [](const RankReport& r) { return r.generateSeconds; });
    });
    compositeTimes.erase(compositeTimes.begin());  // the warm-up's
    made.compositeMs = world_.size() > 1 ? median(compositeTimes) : ownerTime(camera, function);
    world_.together([&] {
      if (root()) made.storedBytes = io::encode(*made.vdi).size();
    });
    return made;
  }

  /// On one rank nothing is composited. What an owner of the whole picture would do for four ranks: merge
  /// four times as many supersegments, dealt to the ranks in turn, into the budget.
  double ownerTime(const Camera& camera, const TransferFunction& function) {
    constexpr std::uint32_t ranks = 4;
    GenerateSettings finer = settings_;
    finer.supersegments = std::min(settings_.supersegments * ranks, 1024U);
    const std::optional<Vdi> vdi = generator_.generate(camera, function, finer);
    std::vector<SupersegmentLists> parts(ranks);
    for (std::size_t list = 0; list < vdi->lists.listCount(); ++list) {
      const auto segments = vdi->lists.list(list);
      for (std::size_t i = 0; i < segments.size(); ++i) parts[i % ranks].segments.push_back(segments[i]);
      for (SupersegmentLists& part : parts)
        part.offsets.push_back(static_cast<std::uint32_t>(part.segments.size()));
    }
    detail::Compositor compositor(device_);
    return medianOf(options_.repeats, [&] {
      const auto start = std::chrono::steady_clock::now();
      compositor.composite(parts, settings_.supersegments, vdi->sampleStep, settings_.algorithm);
      return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    });
  }

  json row(const std::string& name, double angle, const Made& made, double volumeMs, VdiRenderer& renderer,
           const Camera& camera, const Image& truth) {
    Image seen;
    const double renderMs = medianOf(options_.repeats, [&] {
      seen = renderer.render(camera, settings_.width, settings_.height);
      return renderer.renderMilliseconds();
    });
    const ImageDifference d =
        compare(io::toPicture(seen).rgb, io::toPicture(truth).rgb, seen.width, seen.height, 3);
    fmt::print(table_,
               "{:<14} {:>5g} deg  DVR {:9.2f} ms  generate {:9.2f} ms  composite {:8.2f} ms  "
               "render {:8.2f} ms  SSIM {:.4f}  PSNR {:6.2f} dB\n",
               name, angle, volumeMs, made.generateMs, made.compositeMs, renderMs, d.ssim, d.psnrDb);
    std::fflush(table_);
    return {{"dataset", name},
            {"algorithm", toString(settings_.algorithm)},
            {"supersegments", settings_.supersegments},
            {"width", settings_.width},
            {"height", settings_.height},
            {"angle_deg", angle},
            {"dvr_ms", volumeMs},
            {"generate_ms", made.generateMs},
            {"composite_ms", made.compositeMs},
            {"render_ms", renderMs},
            {"ssim", d.ssim},
            {"psnr_db", std::isfinite(d.psnrDb) ? json(d.psnrDb) : json(nullptr)},
            {"stored_bytes", made.storedBytes}};
  }

  const Options& options_;
  const comm::Communicator& world_;
  GenerateSettings settings_;
  std::shared_ptr<gpu::Device> device_;
  VdiGenerator generator_;
  std::FILE* table_ = nullptr;
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

void run(const Options& options, const comm::Communicator& world) {
  std::shared_ptr<gpu::Device> device;
  world.together([&] {
    if (options.repeats < 1) throw Error(ErrorCode::InvalidArgument, "--repeats must be at least 1");
    device = gpu::Device::create(gpu::requestFromEnvironment(world.localRank()));
    (void)makeSettings(options.quality);  // before anything takes time
  });
  // The table must not get between the lines of the JSON.
  std::FILE* table = options.output.empty() ? stderr : stdout;
  if (world.rank() == 0) {
    fmt::print(table, "device: {}, ranks: {}, commit: {}\n", device->name(), world.size(), buildCommit);
  }
  const json rows = Bench(options, world, device).rows(table);
  world.together([&] {
    if (world.rank() != 0) return;
    write({{"device", device->name()}, {"commit", buildCommit}, {"date", today()}, {"rows", rows}},
          options.output);
  });
}

}  // namespace

void addBench(CLI::App& app, Job& job) {
  CLI::App* command = app.add_subcommand(
      "bench", "Time every stage on this device and compare a VDI's views with volume rendering");
  command->footer(
      "Each time is the median over the repeats, of the slowest rank. DVR is a whole frame of volume\n"
      "rendering, its picture on the host; generate is the sub-VDI of a rank, on the host; composite is the\n"
      "merging of what the ranks generated: under mpirun as it happens, on one rank for four that hold a\n"
      "quarter each; render is the device's time for one view of the VDI. SSIM and PSNR compare that view\n"
      "with DVR; JSON has null for the infinite PSNR of equal pictures.");
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
  addQualityOptions(*command, options->quality);
  command->add_option("--angles", options->angles, "degrees from the VDI's viewpoint")
      ->type_name("DEG")
      ->capture_default_str();
  command->add_option("--repeats", options->repeats, "runs of which the median counts, after one warm-up")
      ->capture_default_str();
  command
      ->add_option("-o,--output", options->output,
                   "JSON file; default: standard output, and the table goes to standard error")
      ->type_name("FILE");
  command->callback([options, &job] {
    job = {[options](const comm::Communicator& world) { run(*options, world); }, true};
  });
}

}  // namespace vdi::apps
