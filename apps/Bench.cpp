// vdi bench: how long each stage takes and how true the result is.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
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

struct Options {
  SourceOptions source;
  QualityOptions quality;
  std::vector<std::string> fieldNames{"turbulence", "mixing", "coil"};
  std::vector<double> angles{0.0, 5.0, 10.0, 20.0, 30.0, 40.0, 50.0};
  int repeats = 5;
  std::string output;
};

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

/// Median of the milliseconds that `measure` returns, after one run that doesn't count.
template <typename Measure>
double medianOf(int repeats, Measure measure) {
  measure();
  std::vector<double> times;
  for (int i = 0; i < repeats; ++i) times.push_back(measure());
  return median(times);
}

class Bench {
 public:
  Bench(const Options& options, std::shared_ptr<gpu::Device> device)
      : options_(options),
        settings_(makeSettings(options.quality)),
        device_(device),
        renderer_(device),
        generator_(std::move(device), comm::Communicator::serial()) {}

  nlohmann::json rows() {
    nlohmann::json rows = nlohmann::json::array();
    for (const std::string& name : options_.fieldNames) {
      for (nlohmann::json& row : rowsOf(name)) rows.push_back(std::move(row));
    }
    return rows;
  }

 private:
  std::vector<nlohmann::json> rowsOf(const std::string& name) {
    SourceOptions source = options_.source;
    source.field = name;
    generator_.setBlocks(makeBlocks(source, 0, 1));
    const Camera camera = makeCamera({}, generator_.scene());
    const TransferFunction function = makeTransferFunction("", generator_.scene(), generator_.scalarRange());
    std::optional<Vdi> vdi;
    const double generateMs = medianOf(options_.repeats, [&] {
      vdi = generator_.generate(camera, function, settings_);
      return generator_.reports().front().generateSeconds * 1e3;
    });
    const double compositeMs = compositeTime(*vdi);
    const std::size_t stored = io::encode(*vdi).size();
    renderer_.setVdi(*vdi);
    std::vector<nlohmann::json> rows;
    for (const double angle : options_.angles) {
      const Camera other = angle == 0.0 ? camera : camera.azimuth(angle);
      std::optional<Image> truth;
      const double volumeMs = medianOf(options_.repeats, [&] {
        truth = generator_.renderVolume(other, function, settings_);
        return generator_.reports().front().generateSeconds * 1e3;
      });
      Image seen;
      const double renderMs = medianOf(options_.repeats, [&] {
        seen = renderer_.render(other, settings_.width, settings_.height);
        return renderer_.renderMilliseconds();
      });
      const ImageDifference d =
          compare(io::toPicture(seen).rgb, io::toPicture(*truth).rgb, seen.width, seen.height, 3);
      rows.push_back(
          {{"dataset", name},
           {"algorithm", toString(settings_.algorithm)},
           {"supersegments", settings_.supersegments},
           {"width", settings_.width},
           {"height", settings_.height},
           {"angle_deg", angle},
           {"dvr_ms", volumeMs},
           {"generate_ms", generateMs},
           {"composite_ms", compositeMs},
           {"render_ms", renderMs},
           {"ssim", d.ssim},
           {"psnr_db", std::isfinite(d.psnrDb) ? nlohmann::json(d.psnrDb) : nlohmann::json(nullptr)},
           {"stored_bytes", stored}});
      fmt::print(
          "{:<14} {:>5.0f} deg  DVR {:9.2f} ms  generate {:9.2f} ms  composite {:8.2f} ms  render {:8.2f} ms "
          " SSIM {:.4f}\n",
          name, angle, volumeMs, generateMs, compositeMs, renderMs, d.ssim);
    }
    return rows;
  }

  /// The owner's work for four ranks that each hold every fourth supersegment.
  double compositeTime(const Vdi& vdi) {
    constexpr std::size_t ranks = 4;
    std::vector<SupersegmentLists> parts(ranks);
    for (std::size_t list = 0; list < vdi.lists.listCount(); ++list) {
      const auto segments = vdi.lists.list(list);
      for (std::size_t i = 0; i < segments.size(); ++i) parts[i % ranks].segments.push_back(segments[i]);
      for (SupersegmentLists& part : parts)
        part.offsets.push_back(static_cast<std::uint32_t>(part.segments.size()));
    }
    detail::Compositor compositor(device_);
    return medianOf(options_.repeats, [&] {
      const auto start = std::chrono::steady_clock::now();
      compositor.composite(parts, settings_.supersegments, vdi.sampleStep);
      return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    });
  }

  const Options& options_;
  GenerateSettings settings_;
  std::shared_ptr<gpu::Device> device_;
  VdiRenderer renderer_;
  VdiGenerator generator_;
};

std::string today() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  return fmt::format("{:04}-{:02}-{:02}", utc.tm_year + 1900, utc.tm_mon + 1, utc.tm_mday);
}

void run(const Options& options) {
  if (options.repeats < 1) throw Error(ErrorCode::InvalidArgument, "at least one repeat is needed");
  const auto device = gpu::Device::create(gpu::requestFromEnvironment(0));
  fmt::print("device: {}, commit: {}\n", device->name(), buildCommit);
  const nlohmann::json document{{"device", device->name()},
                                {"commit", buildCommit},
                                {"date", today()},
                                {"rows", Bench(options, device).rows()}};
  if (options.output.empty()) {
    fmt::print("{}\n", document.dump(2));
    return;
  }
  std::ofstream file(options.output);
  file << document.dump(2) << "\n";
  if (!file) throw Error(ErrorCode::Io, "can't write the file", options.output);
}

}  // namespace

void addBench(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "bench", "Time every stage on this device and compare a VDI's views with volume rendering");
  const auto options = std::make_shared<Options>();
  command->add_option("--fields", options->fieldNames, "procedural fields to run")->capture_default_str();
  command->add_option("--size", options->source.size, "values per axis")->capture_default_str();
  command->add_option("--type", options->source.type, "scalar type")->capture_default_str();
  command->add_option("--blocks", options->source.blocks, "blocks per axis")->capture_default_str();
  command->add_option("--angles", options->angles, "degrees from the VDI's viewpoint")->capture_default_str();
  command->add_option("--repeats", options->repeats, "runs of which the median counts, after one warm-up")
      ->capture_default_str();
  command->add_option("-o,--output", options->output, "JSON file; default: standard output");
  addQualityOptions(*command, options->quality);
  command->callback([options] { run(*options); });
}

}  // namespace vdi::apps
