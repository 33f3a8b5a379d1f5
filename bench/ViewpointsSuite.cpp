#include "bench/ViewpointsSuite.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <cstdint>
#include <future>
#include <numbers>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <utility>

#include "apps/Cameras.h"
#include "apps/Source.h"
#include "bench/Frames.h"
#include "bench/Timing.h"
#include "vdi/core/Error.h"
#include "vdi/core/ImageMetrics.h"
#include "vdi/core/SettingsTable.h"
#include "vdi/io/Png.h"
#include "vdi/io/VdiFile.h"
#include "vdi/pipeline/VdiGenerator.h"
#include "vdi/pipeline/VdiRenderer.h"

namespace vdi::bench {

namespace {

using nlohmann::json;

/// DVR of this opacity counts as visible. Fainter material may vanish by rounding to 8 bits.
constexpr std::uint8_t visible = 2;

glm::dvec3 fromFocal(const Camera& camera) {
  return camera.position - camera.focalPoint;
}

/// The camera, moved to the unit vector `direction` from the focal point at its former distance.
Camera seenFrom(const Camera& camera, const glm::dvec3& direction) {
  Camera moved = camera;
  moved.position = camera.focalPoint + glm::length(fromFocal(camera)) * direction;
  return moved;
}

/// Zooms as the mouse wheel does. In perspective it moves the camera closer.
Camera zoomed(const Camera& camera, double zoom) {
  Camera nearer = camera;
  nearer.position = camera.focalPoint + fromFocal(camera) / zoom;
  nearer.parallelScale /= zoom;
  return nearer;
}

bool isInside(const Box& box, const glm::dvec3& point) {
  return glm::all(glm::lessThan(box.lo, point)) && glm::all(glm::lessThan(point, box.hi));
}

/// Returns `count` viewpoints at the camera's distance, evenly distributed over the sphere and
/// outside `bounds`. They are the same on every machine.
std::vector<Camera> randomCameras(const Camera& camera, const Box& bounds, int count, std::uint32_t seed) {
  std::mt19937_64 random(seed);  // the standard defines its numbers, unlike those of distributions
  const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  std::vector<Camera> cameras;
  constexpr int attempts = 1000;
  for (int attempt = 0; attempt < attempts * count && static_cast<int>(cameras.size()) < count; ++attempt) {
    const double z = 2.0 * unit() - 1.0;
    const double around = 2.0 * std::numbers::pi * unit();
    const double radius = std::sqrt(1.0 - z * z);
    const Camera other = seenFrom(camera, {radius * std::cos(around), radius * std::sin(around), z});
    if (!isInside(bounds, other.position)) cameras.push_back(other);
  }
  if (cameras.empty()) {
    throw Error(ErrorCode::InvalidArgument, "all viewpoints are inside the scene at this zoom", "--zooms");
  }
  return cameras;
}

std::vector<Camera> turnedCameras(const Camera& camera, double degrees) {
  return {apps::turned(camera, degrees, 0.0), apps::turned(camera, -degrees, 0.0),
          apps::turned(camera, 0.0, degrees), apps::turned(camera, 0.0, -degrees)};
}

/// The reference for a view.
struct ViewTruth {
  Camera camera;
  io::Picture picture;                // by volume rendering at the rate of --truth-rate
  std::vector<std::uint8_t> opacity;  // [height][width], row 0 at the bottom
};

double ssimOf(const ViewTruth& truth, const glm::ivec2& size, std::span<const glm::u8vec4> pixels) {
  const io::Picture picture = io::toPicture(ImageBytes{size.x, size.y, pixels, {}});
  return compare(picture.rgb, truth.picture.rgb, size.x, size.y, 3).ssim;
}

double missingOf(const ViewTruth& truth, std::span<const glm::u8vec4> pixels) {
  std::size_t missing = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i)
    missing += truth.opacity[i] >= visible && pixels[i].a == 0 ? 1U : 0U;
  return static_cast<double>(missing) / static_cast<double>(pixels.size());
}

/// One kind of viewpoints, all around or turned a little, with their references.
struct Views {
  std::string name;
  std::vector<ViewTruth> truths;
};

/// Figures over all viewpoints of a kind.
struct Trueness {
  std::vector<double> ssims;
  std::vector<double> missing;  // share of the picture that is visible in DVR but not in the VDI
};

/// Settings of the VDIs. Throws Error.
std::vector<GenerateSettings> allSettings(const BenchOptions& options) {
  std::vector<std::string> resolutions = options.listResolutions;
  if (resolutions.empty()) resolutions = {options.quality.resolution};
  std::vector<GenerateSettings> all;
  for (const std::string& resolution : resolutions) {
    for (const std::uint32_t supersegments : options.supersegments) {
      for (const double margin : options.margins) {
        BenchOptions own = options;
        own.quality.resolution = resolution;
        own.quality.settings.margin = margin;
        all.push_back(benchSettings(own, options.algorithms.front(), supersegments));
        validate(all.back());
      }
    }
  }
  return all;
}

class ViewpointSuite {
 public:
  ViewpointSuite(const BenchOptions& options, const comm::Communicator& world,
                 const std::shared_ptr<gpu::Device>& device, std::FILE* table)
      : options_(options),
        world_(world),
        device_(device),
        reconstruction_(reconstructionFromString(options.reconstruction)),
        generator_(device, comm::Communicator::world(), generatorOptionsFromEnvironment(world)),
        table_(table) {}

  std::vector<json> rows() {
    if (root()) {
      fmt::print(table_, "{:<16} {:>4} {:<9} {:<9} {:>3} {:>6} {:>8} {:>8} {:>8} {:>9} {:>9} {:>8} {:>9}\n",
                 "data set", "zoom", "views", "lists", "N_S", "margin", "SSIM min", "median", "mean",
                 "missing %", "mean %", "MiB", "frame ms");
    }
    for (const DataSet& set : dataSets(options_)) {
      setBlocks(set);
      for (const double zoom : options_.zooms) measureZoom(set.name, zoom);
    }
    return std::move(rows_);
  }

 private:
  /// A VDI. Only the root has its renderer.
  struct Made {
    std::unique_ptr<VdiRenderer> renderer;
    std::size_t supersegments = 0;
    std::size_t storedBytes = 0;
    double milliseconds = 0.0;
  };

  bool root() const { return world_.rank() == 0; }

  void setBlocks(const DataSet& set) {
    generator_.setBlocks(blocksOf(set, options_, device_, world_));
    world_.together([&] {
      function_ = apps::makeTransferFunction(options_.quality, generator_.scene(), generator_.scalarRange());
    });
  }

  ViewTruth truthOf(const Camera& camera) {
    GenerateSettings converged = apps::makeSettings(options_.quality);
    converged.samplesPerVoxel = options_.truthRate;
    converged.terminationOpacity = pictureTermination;
    const std::optional<Image> image = generator_.renderVolume(camera, function_, converged);
    ViewTruth truth;
    truth.camera = camera;
    if (!image) return truth;
    truth.picture = io::toPicture(*image);
    truth.opacity.reserve(image->pixelCount());
    for (const glm::vec4& pixel : image->rgba) truth.opacity.push_back(toByte(pixel.a));
    return truth;
  }

  Views viewsOf(const std::string& name, const std::vector<Camera>& cameras) {
    Views views{name, {}};
    for (const Camera& camera : cameras) views.truths.push_back(truthOf(camera));
    return views;
  }

  void measureZoom(const std::string& name, double zoom) {
    Camera camera;
    std::vector<Camera> around;
    world_.together([&] {
      camera = zoomed(apps::makeCamera(options_.view, generator_.scene()), zoom);
      around =
          randomCameras(camera, generator_.scene().bounds, options_.viewpoints, options_.decomposition.seed);
    });
    const std::vector<Views> kinds{
        viewsOf("sphere", around),
        viewsOf(fmt::format("turned {:g}", options_.turn), turnedCameras(camera, options_.turn))};
    for (const GenerateSettings& settings : allSettings(options_)) {
      const Made made = make(camera, settings);
      world_.together([&] {
        if (!root()) return;
        for (const Views& views : kinds) addRow(name, zoom, settings, made, views);
      });
    }
  }

  Made make(const Camera& camera, const GenerateSettings& settings) {
    Made made;
    std::optional<Vdi> vdi;
    made.milliseconds = readyMs(world_, [&] { vdi = generator_.generate(camera, function_, settings); });
    world_.together([&] {
      if (!vdi) return;
      made.supersegments = vdi->supersegmentCount();
      made.storedBytes = io::encode(*vdi).size();
      made.renderer = std::make_unique<VdiRenderer>(device_);
      made.renderer->setVdi(*vdi);
    });
    return made;
  }

  /// The device renders the next view while the host compares one, because an idle GPU lowers its
  /// clock.
  Trueness truenessOf(const Made& made, const Views& views) {
    Trueness trueness;
    std::future<std::pair<double, double>> last;
    const auto note = [&] {
      if (!last.valid()) return;
      const auto [ssim, missing] = last.get();
      trueness.ssims.push_back(ssim);
      trueness.missing.push_back(missing);
    };
    for (const ViewTruth& truth : views.truths) {
      const glm::ivec2 size{truth.picture.width, truth.picture.height};
      const ImageBytes seen =
          made.renderer->renderBytes(truth.camera, size.x, size.y, Alpha::Premultiplied, reconstruction_);
      std::vector<glm::u8vec4> pixels(seen.rgba.begin(), seen.rgba.end());
      note();
      last = std::async(std::launch::async, [&truth, size, pixels = std::move(pixels)] {
        return std::pair(ssimOf(truth, size, pixels), missingOf(truth, pixels));
      });
    }
    note();
    return trueness;
  }

  void addRow(const std::string& name, double zoom, const GenerateSettings& settings, const Made& made,
              const Views& views) {
    const Trueness trueness = truenessOf(made, views);
    const auto meanOf = [](const std::vector<double>& values) {
      double sum = 0.0;
      for (const double value : values) sum += value;
      return sum / static_cast<double>(values.size());
    };
    const Spread ssim = spreadOf(trueness.ssims);
    const Spread missing = spreadOf(trueness.missing);
    fmt::print(table_,
               "{:<16} {:>4g} {:<9} {:<9} {:>3} {:>6g} {:>8.4f} {:>8.4f} {:>8.4f} {:>9.3f} {:>9.3f} {:>8.3f} "
               "{:>9.1f}\n",
               name, zoom, views.name, fmt::format("{}x{}", settings.width, settings.height),
               settings.supersegments, settings.margin, ssim.minimum, ssim.median, meanOf(trueness.ssims),
               100.0 * missing.maximum, 100.0 * meanOf(trueness.missing),
               static_cast<double>(made.storedBytes) / (1 << 20), made.milliseconds);
    std::fflush(table_);
    json row{{"dataset", name},
             {"zoom", zoom},
             {"views", views.name},
             {"viewpoints", views.truths.size()},
             {"truth_rate", options_.truthRate},
             {"reconstruction", toString(reconstruction_)},
             {"ssim", ssim.minimum},
             {"ssim_median", ssim.median},
             {"ssim_mean", meanOf(trueness.ssims)},
             {"missing_most", missing.maximum},
             {"missing_mean", meanOf(trueness.missing)},
             {"supersegment_count", made.supersegments},
             {"stored_bytes", made.storedBytes},
             {"frame_ms", made.milliseconds}};
    addSettings(row, settings);
    rows_.push_back(std::move(row));
  }

  const BenchOptions& options_;
  const comm::Communicator& world_;
  std::shared_ptr<gpu::Device> device_;
  Reconstruction reconstruction_;
  VdiGenerator generator_;
  TransferFunction function_;  // for the current data set
  std::FILE* table_;
  std::vector<json> rows_;
};

}  // namespace

void requireSoundViewpoints(const BenchOptions& options) {
  for (const double zoom : options.zooms) {
    if (!(zoom > 0.0) || !std::isfinite(zoom))
      throw Error(ErrorCode::InvalidArgument, fmt::format("zooms must be > 0, not {}", zoom), "--zooms");
  }
  if (!std::isfinite(options.turn)) throw Error(ErrorCode::InvalidArgument, "must be finite", "--turn");
  (void)allSettings(options);
}

std::vector<json> runViewpoints(const BenchOptions& options, const comm::Communicator& world,
                                const std::shared_ptr<gpu::Device>& device, std::FILE* table) {
  return ViewpointSuite(options, world, device, table).rows();
}

}  // namespace vdi::bench
