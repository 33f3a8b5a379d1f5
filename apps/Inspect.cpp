// vdi render, compare and info: what's done with files that are there.
#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>

#include "apps/Cameras.h"
#include "apps/Commands.h"
#include "apps/OutputFiles.h"
#include "apps/Source.h"
#include "vdi/core/Error.h"
#include "vdi/core/ImageMetrics.h"
#include "vdi/core/Viewpoint.h"
#include "vdi/io/Png.h"
#include "vdi/io/VdiFile.h"
#include "vdi/pipeline/Pipeline.h"

namespace vdi::apps {

namespace {

struct RenderOptions {
  std::string input;
  std::string output;
  CameraOptions camera;
  std::vector<double> azimuths{0.0};
  double elevation = 0.0;
  std::string resolution;
  std::string reconstruction = "smooth";
};

/// The picture of one of the azimuths: with several their degrees are added to its name.
std::filesystem::path pictureOf(const RenderOptions& options, double azimuth) {
  if (options.azimuths.size() == 1) return options.output;
  return withSuffix(options.output, fmt::format("{:g}deg", azimuth));
}

void render(const RenderOptions& options) {
  std::vector<NamedFile> outputs;
  for (const double azimuth : options.azimuths)
    outputs.push_back({fmt::format("the picture of {} degrees", azimuth), pictureOf(options, azimuth)});
  requireOutputs(outputs, {{"the VDI", options.input}, {"--camera", options.camera.file}});
  const Vdi vdi = io::readVdi(options.input);
  const std::vector<int> size = options.resolution.empty() ? std::vector<int>{vdi.width, vdi.height}
                                                           : parseSizes(options.resolution, 2);
  const Reconstruction reconstruction = reconstructionFromString(options.reconstruction);
  VdiRenderer renderer(gpu::Device::create(gpu::requestFromEnvironment(0)));
  renderer.setVdi(vdi);
  const Camera start = chosenCamera(options.camera, vdi.camera);
  std::set<ViewpointIssue> warned;
  for (const double azimuth : options.azimuths) {
    const Camera camera = turned(start, azimuth, options.elevation);
    const auto issue = viewpointIssue(vdi.bounds, vdi.camera, View(camera, size[0], size[1]));
    if (issue && warned.insert(*issue).second)
      fmt::print(stderr, "vdi: warning, at {} degrees: {}\n", azimuth, describe(*issue));
    const std::filesystem::path path = pictureOf(options, azimuth);
    io::writePng(path, io::toPicture(renderer.renderBytes(camera, size[0], size[1], Alpha::Premultiplied,
                                                          reconstruction)));
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
    fmt::print("  supersegments    {} ({:.2f} a list), {} precision\n", info.supersegmentCount,
               static_cast<double>(info.supersegmentCount) / (static_cast<double>(v.width) * v.height),
               toString(v.precision()));
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

void addRender(CLI::App& app, Job& job) {
  CLI::App* command = app.add_subcommand("render", "Show a VDI from new viewpoints, as PNG");
  command->footer(
      "Example:\n"
      "  vdi render coil.vdi -o coil.png --azimuth 0 5 20 50\n"
      "writes coil_0deg.png, coil_5deg.png, coil_20deg.png and coil_50deg.png.");
  const auto options = std::make_shared<RenderOptions>();
  command->add_option("input", options->input, "the .vdi file")->type_name("")->required();
  command
      ->add_option("-o,--output", options->output,
                   "PNG; with several azimuths their degrees are added to its name")
      ->type_name("FILE")
      ->required();
  command->add_option("--resolution", options->resolution, "pixels; default: the VDI's")->type_name("WxH");
  addCameraOptions(*command, options->camera, "the one that the VDI was made for");
  command
      ->add_option("--azimuth", options->azimuths,
                   "degrees to turn the camera about its focal point, around its view-up as set (vtkCamera's "
                   "Azimuth); several make several pictures")
      ->type_name("DEG")
      ->capture_default_str()
      ->group("Viewpoint");
  command->add_option("--elevation", options->elevation, "degrees to raise it after that")
      ->capture_default_str()
      ->group("Viewpoint");
  addReconstructionOption(*command, options->reconstruction);
  command->callback([options, &job] { job = {[options](const comm::Communicator&) { render(*options); }}; });
}

void addCompare(CLI::App& app, Job& job) {
  CLI::App* command =
      app.add_subcommand("compare", "Tell how alike two PNGs are: SSIM, PSNR, mean and largest error");
  command->footer("JSON has null for the infinite PSNR of equal pictures.");
  const auto options = std::make_shared<CompareOptions>();
  command->add_option("a", options->a, "PNG")->type_name("")->required();
  command->add_option("b", options->b, "PNG")->type_name("")->required();
  command->add_flag("--json", options->json, "print JSON");
  command->callback(
      [options, &job] { job = {[options](const comm::Communicator&) { comparePictures(*options); }}; });
}

void addInfo(CLI::App& app, Job& job) {
  CLI::App* command = app.add_subcommand("info", "Describe .vdi files or this machine's devices");
  const auto options = std::make_shared<InfoOptions>();
  command->add_option("files", options->files, ".vdi files")->type_name("");
  command->add_flag("--devices", options->devices, "list the Vulkan devices and whether each can be used");
  command->callback([options, &job] {
    if (options->files.empty() && !options->devices) throw CLI::RequiredError("A .vdi file or --devices");
    job = {[options](const comm::Communicator&) { printInfo(*options); }};
  });
}

}  // namespace vdi::apps
