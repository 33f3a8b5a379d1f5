// vdi compare and vdi info: examine existing files.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "apps/Commands.h"
#include "apps/Say.h"
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
  std::string what = fmt::format("{} of {}", printable(array.name), array.cells ? "cells" : "points");
  if (array.components > 1)
    what += array.component == phase ? ", its phase"
            : array.component < 0    ? ", its magnitude"
                                     : fmt::format(", component {} of {}", array.component, array.components);
  return what;
}

std::string fromTo(double from, double to) {
  const auto [low, high] = numbersApart(from, to);
  return fmt::format("from {} to {}", low, high);
}

/// Two points, with the digits that tell their coordinates apart.
std::pair<std::string, std::string> pointsApart(const glm::dvec3& a, const glm::dvec3& b) {
  std::pair<std::string, std::string> texts;
  for (int axis = 0; axis < 3; ++axis) {
    const auto [one, other] = numbersApart(a[axis], b[axis]);
    const char* const before = axis == 0 ? "" : ", ";
    texts.first += before + one;
    texts.second += before + other;
  }
  return texts;
}

void printColoring(const Coloring& coloring) {
  const auto& [array, range, function] = coloring;
  fmt::print("  array            {}", shownOf(array));
  if (range.min <= range.max) fmt::print(", {}", fromTo(range.min, range.max));
  fmt::print("\n  colours          {} nodes {}\n", function.colors.size(),
             fromTo(function.colors.front().x, function.colors.back().x));
  fmt::print("  opacity          {} nodes {}, unit distance {:g}\n", function.opacities.size(),
             fromTo(function.opacities.front().x, function.opacities.back().x), function.unitDistance);
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
    fmt::print("{}\n  version          {}\n  lists            {} x {}, at most {} supersegments each\n",
               printable(file), info.version, v.width, v.height, v.budget);
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
    const auto [position, focalPoint] = pointsApart(v.camera.position, v.camera.focalPoint);
    fmt::print("  camera           at ({}), to ({}), up ({:g}, {:g}, {:g}), {}\n", position, focalPoint,
               v.camera.viewUp.x, v.camera.viewUp.y, v.camera.viewUp.z,
               v.camera.parallelProjection ? fmt::format("parallel, scale {:g}", v.camera.parallelScale)
                                           : fmt::format("perspective, {:g} degrees", v.camera.viewAngle));
    const auto [low, high] = pointsApart(v.bounds.lo, v.bounds.hi);
    fmt::print("  scene            ({}) to ({}), sample step {:g}\n", low, high, v.sampleStep);
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
