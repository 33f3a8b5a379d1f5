// vdi compare and vdi info: examine existing files.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/Commands.h"
#include "vdi/core/ComponentValues.h"
#include "vdi/core/Error.h"
#include "vdi/core/ImageMetrics.h"
#include "vdi/gpu/Device.h"
#include "vdi/io/Png.h"
#include "vdi/io/VdiFile.h"

namespace vdi::apps {

namespace {

struct CompareOptions {
  std::string a;
  std::string b;
  bool json = false;
};

void comparePictures(const CompareOptions& options) {
  const io::Picture a = io::readPng(options.a);
  const io::Picture b = io::readPng(options.b);
  if (a.width != b.width || a.height != b.height) {
    throw Error(ErrorCode::InvalidArgument, fmt::format("the pictures have {} x {} and {} x {} pixels",
                                                        a.width, a.height, b.width, b.height));
  }
  const ImageDifference d = compare(a.rgb, b.rgb, a.width, a.height, 3);
  const double ofObject = objectSsim(a.rgb, b.rgb, a.width, a.height, 3);
  const PictureBox box = objectBox(a.rgb, b.rgb, a.width, a.height, 3);
  if (options.json) {
    const nlohmann::json out{
        {"ssim", d.ssim},
        {"object_ssim", ofObject},
        {"object_box", {box.x, box.y, box.width, box.height}},
        {"psnr_db", std::isfinite(d.psnrDb) ? nlohmann::json(d.psnrDb) : nlohmann::json(nullptr)},
        {"mean_error", d.meanError},
        {"max_error", d.maxError},
        {"wrong_share", d.wrongShare}};
    fmt::print("{}\n", out.dump());
    return;
  }
  fmt::print(
      "SSIM         {:.5f}\nSSIM, object {:.5f} in {} x {} pixels from ({}, {})\nPSNR         {:.2f} "
      "dB\nmean error   {:.4f} / 255\nlargest error {} / 255\n"
      "pixels off by more than 16 / 255: {:.3f} %\n",
      d.ssim, ofObject, box.width, box.height, box.x, box.y, d.psnrDb, d.meanError, d.maxError,
      100.0 * d.wrongShare);
}

std::string shownOf(const ScalarArray& array) {
  if (array.name.empty()) return "an array without a name";
  std::string what = fmt::format("{} of {}", array.name, array.cells ? "cells" : "points");
  if (array.components > 1)
    what += array.component == phase ? ", its phase"
            : array.component < 0    ? ", its magnitude"
                                     : fmt::format(", component {} of {}", array.component, array.components);
  return what;
}

void printColoring(const Coloring& coloring) {
  const auto& [array, range, function] = coloring;
  fmt::print("  array            {}", shownOf(array));
  if (range.min <= range.max) fmt::print(", from {:g} to {:g}", range.min, range.max);
  fmt::print("\n  colours          {} nodes from {:g} to {:g}\n", function.colors.size(),
             function.colors.front().x, function.colors.back().x);
  fmt::print("  opacity          {} nodes from {:g} to {:g}, unit distance {:g}\n", function.opacities.size(),
             function.opacities.front().x, function.opacities.back().x, function.unitDistance);
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
    if (v.margin != glm::ivec2(0)) {
      fmt::print(
          "  picture          {} x {}, and a margin of {} lists on either side and {} above and below\n",
          v.pictureSize().x, v.pictureSize().y, v.margin.x, v.margin.y);
    }
    fmt::print("  supersegments    {} ({:.2f} per list), {} precision\n", info.supersegmentCount,
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
    if (v.coloring) printColoring(*v.coloring);
  }
}

}  // namespace

void addCompare(CLI::App& app, Job& job) {
  CLI::App* command =
      app.add_subcommand("compare", "Measure the similarity of two PNGs: SSIM, PSNR, mean and largest error");
  command->footer(
      "The object's SSIM covers the part of the picture where either PNG differs from its background. The\n"
      "background is the most frequent colour along the edge. In JSON, the infinite PSNR of equal\n"
      "pictures is null.");
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
  command->add_flag("--devices", options->devices, "list the Vulkan devices, and whether each is usable");
  command->callback([options, &job] {
    if (options->files.empty() && !options->devices) throw CLI::RequiredError("A .vdi file or --devices");
    job = {[options](const comm::Communicator&) { printInfo(*options); }};
  });
}

}  // namespace vdi::apps
