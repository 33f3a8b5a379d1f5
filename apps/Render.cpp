// vdi render: renders a VDI from new viewpoints, as PNG.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <filesystem>
#include <set>

#include "apps/Cameras.h"
#include "apps/Commands.h"
#include "apps/OutputFiles.h"
#include "apps/Source.h"
#include "vdi/core/Viewpoint.h"
#include "vdi/io/Png.h"
#include "vdi/io/VdiFile.h"
#include "vdi/pipeline/VdiRenderer.h"

namespace vdi::apps {

namespace {

struct RenderOptions {
  std::string input;
  std::string output;
  CameraOptions camera;
  std::vector<double> azimuths{0.0};
  double elevation = 0.0;
  std::string resolution;
  std::string reconstruction = toString(defaultReconstruction);
  std::vector<double> clip;  // 6 for each plane
};

/// The path of an azimuth's picture; with several azimuths, the degrees are added to its name.
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
  const glm::ivec2 picture = vdi.pictureSize();
  const std::vector<int> size =
      options.resolution.empty() ? std::vector<int>{picture.x, picture.y} : parseSizes(options.resolution, 2);
  const Reconstruction reconstruction = reconstructionFromString(options.reconstruction);
  VdiRenderer renderer(gpu::Device::create(gpu::requestFromEnvironment(0)));
  renderer.setVdi(vdi);
  renderer.setClipPlanes(makeClipPlanes(options.clip));
  const Camera start = chosenCamera(options.camera, vdi.camera);
  std::set<ViewpointIssue> warned;
  for (const double azimuth : options.azimuths) {
    const Camera camera = turned(start, azimuth, options.elevation);
    const auto issue = viewpointIssue(vdi.bounds, vdi.view(), View(camera, size[0], size[1]));
    if (issue && warned.insert(*issue).second)
      fmt::print(stderr, "vdi: warning, at {} degrees: {}\n", azimuth, describe(*issue));
    const std::filesystem::path path = pictureOf(options, azimuth);
    io::writePng(path, io::toPicture(renderer.renderBytes(camera, size[0], size[1], Alpha::Premultiplied,
                                                          reconstruction)));
    fmt::print("{}: {:.2f} ms on the device\n", path.string(), renderer.renderMilliseconds());
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
  command->add_option("--resolution", options->resolution, "pixels; default: those of the VDI's picture")
      ->type_name("WxH");
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
  addClipOption(*command, options->clip, "Viewpoint");
  command->callback([options, &job] { job = {[options](const comm::Communicator&) { render(*options); }}; });
}

}  // namespace vdi::apps
