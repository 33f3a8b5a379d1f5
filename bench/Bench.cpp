// vdi bench: measures the time of each stage and the accuracy of the result.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <cmath>
#include <ctime>
#include <nlohmann/json.hpp>
#include <span>
#include <stdexcept>

#include "BuildCommit.h"
#include "apps/Commands.h"
#include "apps/Help.h"
#include "apps/OutputFiles.h"
#include "apps/RawVolume.h"
#include "bench/Bench.h"
#include "bench/Compare.h"
#include "bench/IcetCompositor.h"
#include "bench/RanksSuite.h"
#include "bench/Run.h"
#include "bench/StreamSuite.h"
#include "bench/Suites.h"
#include "bench/ViewpointsSuite.h"
#include "vdi/core/Error.h"
#include "vdi/core/SettingsTable.h"
#include "vdi/io/Files.h"
#include "vdi/synthetic/Fields.h"

namespace vdi::bench {

namespace {

using nlohmann::json;

std::string today() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  return fmt::format("{:04}-{:02}-{:02}", utc.tm_year + 1900, utc.tm_mon + 1, utc.tm_mday);
}

/// Checks the options before the work starts. Throws Error.
void requireSound(const BenchOptions& options, int ranks) {
  if (options.repeats < 1) throw Error(ErrorCode::InvalidArgument, "--repeats must be at least 1");
  if (!options.rival.empty() && !IcetCompositor::available()) {
    throw Error(ErrorCode::InvalidArgument,
                "this vdi was built without IceT, which needs Debian's paraview-dev and VDI_BUILD_PARAVIEW",
                "--rival");
  }
  if (options.suite == ranksSuite) requireSoundRanks(options, ranks);
  if (options.suite == viewpointsSuite) requireSoundViewpoints(options);
  if (options.suite == streamSuite) requireSoundStream(options);
  for (const DataSet& set : dataSets(options)) {
    if (set.field.empty()) {
      (void)apps::readSidecar(set.raw);
    } else {
      (void)synthetic::fieldIndex(set.field);
    }
  }
  for (const double angle : options.angles) {
    if (!std::isfinite(angle)) throw Error(ErrorCode::InvalidArgument, "angles must be finite", "--angles");
  }
  (void)reconstructionFromString(options.reconstruction);
  for (const std::string& algorithm : options.algorithms) {
    for (const std::uint32_t supersegments : options.supersegments)
      validate(benchSettings(options, algorithm, supersegments));
  }
  apps::QualityOptions quality = options.quality;
  quality.settings.samplesPerVoxel = options.truthRate;
  try {
    (void)apps::makeSettings(quality);
  } catch (const Error& error) {
    throw Error(error.code(), error.what(), "--truth-rate");
  }
}

void measureAll(const BenchOptions& options, const comm::Communicator& world) {
  std::shared_ptr<gpu::Device> device;
  world.together([&] {
    if (world.rank() == 0 && !options.output.empty()) {
      std::vector<apps::NamedFile> inputs{{"--camera", options.view.camera.file},
                                          {"--transfer-function", options.quality.transferFunction}};
      for (const std::string& raw : options.raws) inputs.push_back({"--raw", raw});
      apps::requireOutputs({{"-o", options.output}}, inputs);
    }
    requireSound(options, world.size());
    device = gpu::Device::create(gpu::requestFromEnvironment(world.localRank()));
  });
  // The table must not mix with the JSON's lines.
  std::FILE* table = options.output.empty() ? stderr : stdout;
  if (world.rank() == 0) {
    fmt::print(table, "device: {}, ranks: {}, commit: {}; milliseconds, dB, MiB\n", device->name(),
               world.size(), buildCommit);
  }
  std::vector<json> rows;
  if (options.suite == ranksSuite) {
    rows = runRanks(options, world, device, table);
  } else if (options.suite == viewpointsSuite) {
    rows = runViewpoints(options, world, device, table);
  } else if (options.suite == streamSuite) {
    rows = runStream(options, world, device, table);
  } else {
    for (const BenchRow& row : runBench(options, world, device, table)) rows.push_back(toJson(row));
  }
  world.together([&] {
    if (world.rank() != 0) return;
    json document{{"device", device->name()},
                  {"commit", buildCommit},
                  {"date", today()},
                  {"ranks", world.size()},
                  {"rows", rows}};
    // A data set's name may be that of a file, with any bytes.
    const std::string text = document.dump(2, ' ', false, json::error_handler_t::replace) + "\n";
    if (options.output.empty()) {
      fmt::print("{}", text);
    } else {
      io::writeAtomically(options.output, std::as_bytes(std::span(text)));
    }
  });
}

const char* const footer =
    R"(Each time is the slowest rank's, as the median over the repeats. DVR and generate are device times,
without transfers, of a rank's own volume rendering and of its (sub-)VDI, compact. The columns '/ DVR' and
'faster' are ratios to a volume rendering just before. The bench keeps a GPU busy before each measured run.
composite is the time for merging under mpirun; render is the device's time for one view of the VDI. SSIM and
PSNR compare that view with the truth: DVR at --truth-rate samples per voxel. DVR SSIM compares DVR at the
VDI's own --sampling-rate with the truth.
With several ranks, the stages of each VDI follow its views: wall and device time of the slowest rank, the
mean, and the whole frame.
The table of suite viewpoints has the least, median and mean SSIM over two kinds of viewpoints: random ones at
the VDI's distance all around the focal point ('sphere'), and four that are turned from it to each side
('turned'). 'missing' is the share of the picture, at worst and on average, where volume rendering shows
material and the VDI shows none.
The table of suite stream has the frames per second that a viewer decoded and drew, --turn degrees from their
viewpoint, and their age at that moment. The age counts from the beginning of the VDI's generation ('live':
made and published as the extractor VDIStream does) or from the file's appearance ('folder': followed as vdi
serve does). Server and viewer share this machine and its device; --rates limit the bytes between them. 'view'
is the viewer's time for a level, 'encode' the server's for all levels. 'crowd' is the time to make and publish
a VDI with eight viewers, divided by the time without viewers. One of the eight takes nothing, one vanishes.
The table of suite ranks has the wall time of the slowest rank for each stage, and whole frames. 'faster' and
'more' compare the frame and VDIs/s with those of one rank with the same layout. DVR is volume_rendering_ms.
The JSON has these fields in addition:
  frame_ms, volume_rendering_ms  a whole VDI and a whole picture: wall time on the root's host, from all ranks
                                 being ready to the result
  shown_ms                       a VDI and its picture, likewise; on one rank its lists stay on the device
  vdis_per_second                successive VDIs on an orbit (--frames), by wall time on the root's host
  generate_ms, distribute_ms, composite_ms, gather_ms
                                 device time of the first, wall time of the others; slowest rank
  stages, picture_stages         all stages of a VDI and of a picture by volume rendering: wall_ms and
                                 device_ms, slowest rank and mean
  sub_supersegments, bytes_sent  of all ranks, in one frame
  dvr_frame_ms, generate_frame_ms, render_frame_ms
                                 sums of the slowest rank's stages, including transfers
  upload_ms, step_ms             the upload of the values, and a frame made while the next step's values are
                                 uploaded
  rival_icet_ms                  with --rival icet: a whole picture, by wall time on the root's host. Each rank
                                 casts the whole scene's samples that lie in its own blocks into a picture of
                                 floats (rival_render_ms, with download). IceT blends these in order of
                                 visibility and collects them (rival_composite_ms). Compare it with
                                 volume_rendering_ms, and with frame_ms, which makes more than a picture
  rival_redistribute_ms          if planes don't separate the ranks' blocks: the time to move the values to one
                                 box per rank, once per time step, with ghost layers and without upload. null:
                                 not needed
  rival_bytes_sent, rival_redistributed_bytes
                                 of all ranks: bytes in one picture, as IceT counts them; moved values, without
                                 ghost layers
  rival_max_difference           of a channel of its picture from renderVolume's, in 1/255
  null                           not measured, or the infinite PSNR of equal pictures)";

void run(BenchOptions options, const comm::Communicator& world) {
  if (!options.comparison.empty()) {
    int regressions = 0;
    world.together([&] {
      if (world.rank() == 0)
        regressions = compareBenches(options.comparison[0], options.comparison[1], stdout);
      if (regressions > 0) throw std::runtime_error(fmt::format("{} regressions", regressions));
    });
    return;
  }
  applySuite(options);
  measureAll(options, world);
}

void addInputOptions(CLI::App& command, BenchOptions& options) {
  command
      .add_option("--fields", options.fields,
                  "procedural fields to run, by default turbulence, mixing "
                  "and coil:" +
                      apps::fieldsHelp())
      ->type_name("NAME")
      ->group("Volume and ranks");
  command.add_option("--raw", options.raws, "JSON sidecars of raw volumes to run (docs/raw-volumes.md)")
      ->type_name("FILE")
      ->group("Volume and ranks");
  apps::addDecompositionOptions(command, options.decomposition);
  apps::addViewOptions(command, options.view);
  options.quality.settings.samplesPerVoxel = 1.0;  // one rate for comparable times
  apps::addQualityOptions(command, options.quality, apps::QualityUse::Several);
}

void addMeasuringOptions(CLI::App& command, BenchOptions& options) {
  command.add_option("--algorithms", options.algorithms, "merge (the default), bisection or both")
      ->type_name("NAME");
  command.add_option("--supersegments", options.supersegments,
                     "numbers of supersegments per list (N_S); default: 25");
  command
      .add_option("--views", options.views, "number of VDIs' viewpoints, evenly around the scene; default: 1")
      ->check(CLI::Range(1, 360));
  command.add_option("--angles", options.angles, "degrees from the VDI's viewpoint")
      ->type_name("DEG")
      ->capture_default_str();
  apps::addReconstructionOption(command, options.reconstruction);
  command.add_option("--repeats", options.repeats, "measured runs after one warm-up; their median counts")
      ->capture_default_str();
  command
      .add_option("--frames", options.frames,
                  "VDIs made on an orbit of 20 viewpoints, for vdis_per_second; 0: none")
      ->check(CLI::Range(0, 1000000))
      ->capture_default_str();
  command
      .add_option("--truth-rate", options.truthRate,
                  "samples per voxel of the volume rendering that serves as the truth, 1/64 to 64")
      ->capture_default_str();
}

void addSuiteOptions(CLI::App& command, BenchOptions& options) {
  command
      .add_option(
          "--suite", options.suite,
          "paper and small: data sets, sizes, viewpoints and N_S of docs/benchmarks.md, from which "
          "--fields selects; paper needs a GPU and 32 GiB, small takes a minute on a CPU. The others use the "
          "volume and picture of the options. ranks: whole frames on fewer and more of mpirun's ranks; "
          "viewpoints: the accuracy of VDIs from all around; stream: how many VDIs a viewer gets, and "
          "their age")
      ->check(CLI::IsMember(suiteNames()));
  command
      .add_option(
          "--rival", options.rival,
          "icet: in addition, volume rendering of the same volume, with the same camera and devices, "
          "composited by IceT. Requires mpirun, even for one rank, and twice the volume's memory. See below")
      ->check(CLI::IsMember({"icet"}));
}

void addRanksOptions(CLI::App& command, BenchOptions& options) {
  const char* const ranksGroup = "Suite ranks";
  command
      .add_option("--scaling", options.scalings,
                  "strong: all ranks share --size; weak: each rank has --size-per-rank")
      ->check(CLI::IsMember({"strong", "weak"}))
      ->capture_default_str()
      ->group(ranksGroup);
  command
      .add_option("--layouts", options.layouts,
                  "layouts to run, instead of --layout. Slabs have one block per rank; other layouts cut "
                  "the fixed volume into --blocks, and the growing one into blocks of the same size")
      ->type_name("LAYOUT")
      ->capture_default_str()
      ->group(ranksGroup);
  command
      .add_option("--rank-counts", options.rankCounts,
                  "numbers of mpirun's ranks to use; default: 1, 2, 4 and so on, and all")
      ->type_name("N")
      ->group(ranksGroup);
  command
      .add_option("--size-per-rank", options.sizePerRank,
                  "values per axis of each rank in weak scaling; default: half of --size on each axis, so "
                  "that 8 ranks together hold the fixed volume")
      ->type_name("XxYxZ")
      ->group(ranksGroup);
}

void addViewpointsOptions(CLI::App& command, BenchOptions& options) {
  const char* const viewpointsGroup = "Suite viewpoints";
  command
      .add_option("--viewpoints", options.viewpoints, "number of random viewpoints, which --seed determines")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str()
      ->group(viewpointsGroup);
  command
      .add_option("--turn", options.turn,
                  "degrees by which the other four viewpoints are turned; in suite stream, the viewer's")
      ->capture_default_str()
      ->group(viewpointsGroup);
  command
      .add_option(
          "--zooms", options.zooms,
          "factors by which all viewpoints zoom in from the view's camera; 4 shows a quarter of the width")
      ->capture_default_str()
      ->group(viewpointsGroup);
  command.add_option("--margins", options.margins, "margins to run, instead of --margin")
      ->capture_default_str()
      ->group(viewpointsGroup);
  command
      .add_option("--list-resolutions", options.listResolutions,
                  "resolutions of VDIs to run; default: --resolution, which is that of the views")
      ->type_name("WxH")
      ->group(viewpointsGroup);
}

void addStreamOptions(CLI::App& command, BenchOptions& options) {
  const char* const streamGroup = "Suite stream";
  command.add_option("--rates", options.rates, "limits for the viewer per second, such as 1Gbit or 12MB")
      ->type_name("RATE")
      ->capture_default_str()
      ->group(streamGroup);
  command.add_option("--period", options.period, "milliseconds between two of the --frames")
      ->capture_default_str()
      ->group(streamGroup);
}

void addOutputOptions(CLI::App& command, BenchOptions& options) {
  command
      .add_option(
          "--compare", options.comparison,
          "two JSON files, before and after: lists the figures that became slower by more than both "
          "10 % and the spread, larger by more than 5 %, or less accurate; exit status 1 if there are any")
      ->expected(2)
      ->type_name("FILE FILE");
  command
      .add_option("-o,--output", options.output,
                  "JSON file; default: standard output, with the table on standard error")
      ->check(apps::requireFileName)
      ->type_name("FILE");
}

}  // namespace

void addBench(CLI::App& app, apps::Job& job) {
  CLI::App* command = app.add_subcommand(
      "bench", "Time each stage on this device, and compare a VDI's views with volume rendering");
  command->footer(footer);
  const auto options = std::make_shared<BenchOptions>();
  addInputOptions(*command, *options);
  addMeasuringOptions(*command, *options);
  addSuiteOptions(*command, *options);
  addRanksOptions(*command, *options);
  addViewpointsOptions(*command, *options);
  addStreamOptions(*command, *options);
  addOutputOptions(*command, *options);
  command->callback([options, &job] {
    job = {[options](const comm::Communicator& world) { run(*options, world); }, true};
  });
}

}  // namespace vdi::bench
