// vdi render, compare and info: what's done with files that are there.
#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "apps/Commands.h"
#include "apps/RawVolume.h"
#include "apps/Source.h"
#include "vdi/core/Error.h"
#include "vdi/core/ImageMetrics.h"
#include "vdi/io/Png.h"
#include "vdi/io/VdiFile.h"
#include "vdi/pipeline/Pipeline.h"

namespace vdi::apps {

namespace {

struct RenderOptions {
  std::string input;
  std::string output;
  std::string camera;
  std::vector<double> azimuths{0.0};
  std::string resolution;
};

/// picture.png at 20 degrees: picture_20deg.png, when there are several.
std::filesystem::path nameFor(const std::string& output, double azimuth, bool several) {
  if (!several) return output;
  const std::filesystem::path path(output);
  return path.parent_path() /
         fmt::format("{}_{:g}deg{}", path.stem().string(), azimuth, path.extension().string());
}

void render(const RenderOptions& options) {
  const Vdi vdi = io::readVdi(options.input);
  const std::vector<int> size = options.resolution.empty() ? std::vector<int>{vdi.width, vdi.height}
                                                           : parseSizes(options.resolution, 2);
  VdiRenderer renderer(gpu::Device::create(gpu::requestFromEnvironment(0)));
  renderer.setVdi(vdi);
  for (const double azimuth : options.azimuths) {
    Camera camera = options.camera.empty() ? vdi.camera : readCamera(options.camera);
    if (azimuth != 0.0) camera = camera.azimuth(azimuth);
    const std::filesystem::path path = nameFor(options.output, azimuth, options.azimuths.size() > 1);
    io::writePng(path, io::toPicture(renderer.render(camera, size[0], size[1])));
    fmt::print("{}: {:.2f} ms on the device\n", path.string(), renderer.renderMilliseconds());
  }
}

struct CompareOptions {
  std::string a;
  std::string b;
  bool json = false;
};

void comparePictures(const CompareOptions& options) {
  const io::Picture a = io::readPng(options.a);
  const io::Picture b = io::readPng(options.b);
  if (a.width != b.width || a.height != b.height) {
    throw Error(ErrorCode::InvalidArgument, fmt::format("the pictures are of {} x {} and {} x {} pixels",
                                                        a.width, a.height, b.width, b.height));
  }
  const ImageDifference d = compare(a.rgb, b.rgb, a.width, a.height, 3);
  if (options.json) {
    const nlohmann::json out{
        {"ssim", d.ssim},
        {"psnr_db", std::isfinite(d.psnrDb) ? nlohmann::json(d.psnrDb) : nlohmann::json(nullptr)},
        {"mean_error", d.meanError},
        {"max_error", d.maxError},
        {"wrong_share", d.wrongShare}};
    fmt::print("{}\n", out.dump());
    return;
  }
  fmt::print(
      "SSIM         {:.5f}\nPSNR         {:.2f} dB\nmean error   {:.4f} / 255\nlargest error {} / 255\n"
      "pixels off by more than 16 / 255: {:.3f} %\n",
      d.ssim, d.psnrDb, d.meanError, d.maxError, 100.0 * d.wrongShare);
}

struct InfoOptions {
  std::vector<std::string> files;
  bool devices = false;
};

void printInfo(const InfoOptions& options) {
  if (options.devices) fmt::print("{}", gpu::Device::describeAll());
  for (const std::string& file : options.files) {
    const io::VdiFileInfo info = io::readVdiInfo(file);
    const Vdi& v = info.header;
    fmt::print("{}\n  version          {}\n  lists            {} x {}, at most {} supersegments each\n", file,
               info.version, v.width, v.height, v.budget);
    fmt::print("  supersegments    {} ({:.2f} a list)\n", info.supersegmentCount,
               static_cast<double>(info.supersegmentCount) / (static_cast<double>(v.width) * v.height));
    fmt::print("  stored           {:.2f} MiB of {:.2f} MiB\n",
               static_cast<double>(info.storedBytes) / 1048576.0,
               static_cast<double>(info.expandedBytes) / 1048576.0);
    fmt::print("  time             {} (step {})\n", v.time, v.timeStep);
    fmt::print("  camera           at ({:g}, {:g}, {:g}), to ({:g}, {:g}, {:g}), up ({:g}, {:g}, {:g}), {}\n",
               v.camera.position.x, v.camera.position.y, v.camera.position.z, v.camera.focalPoint.x,
               v.camera.focalPoint.y, v.camera.focalPoint.z, v.camera.viewUp.x, v.camera.viewUp.y,
               v.camera.viewUp.z,
               v.camera.parallelProjection ? fmt::format("parallel, scale {:g}", v.camera.parallelScale)
                                           : fmt::format("perspective, {:g} degrees", v.camera.viewAngle));
    fmt::print("  scene            ({:g}, {:g}, {:g}) to ({:g}, {:g}, {:g}), sample step {:g}\n",
               v.bounds.lo.x, v.bounds.lo.y, v.bounds.lo.z, v.bounds.hi.x, v.bounds.hi.y, v.bounds.hi.z,
               v.sampleStep);
  }
}

}  // namespace

void addRender(CLI::App& app) {
  CLI::App* command = app.add_subcommand("render", "Show a VDI from a viewpoint, as PNG");
  const auto options = std::make_shared<RenderOptions>();
  command->add_option("input", options->input, "the .vdi file")->required();
  command
      ->add_option("-o,--output", options->output,
                   "PNG; with several angles their degrees are added to its name")
      ->required();
  command
      ->add_option("--azimuth", options->azimuths,
                   "degrees to turn the camera about its focal point; several make several pictures")
      ->capture_default_str();
  command->add_option("--camera", options->camera,
                      "JSON file; default: the camera that the VDI was made for");
  command->add_option("--resolution", options->resolution, "WIDTHxHEIGHT; default: the VDI's");
  command->callback([options] { render(*options); });
}

void addCompare(CLI::App& app) {
  CLI::App* command = app.add_subcommand("compare", "Tell how alike two PNGs are");
  const auto options = std::make_shared<CompareOptions>();
  command->add_option("a", options->a, "PNG")->required();
  command->add_option("b", options->b, "PNG")->required();
  command->add_flag("--json", options->json, "print JSON");
  command->callback([options] { comparePictures(*options); });
}

void addInfo(CLI::App& app) {
  CLI::App* command = app.add_subcommand("info", "Describe .vdi files or this machine's devices");
  const auto options = std::make_shared<InfoOptions>();
  command->add_option("files", options->files, ".vdi files");
  command->add_flag("--devices", options->devices, "list the Vulkan devices and whether each can be used");
  command->callback([options] {
    if (options->files.empty() && !options->devices) throw CLI::RequiredError("a .vdi file or --devices");
    printInfo(*options);
  });
}

}  // namespace vdi::apps
