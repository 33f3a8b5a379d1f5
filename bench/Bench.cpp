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

/// Checks everything that is known before the work starts. Throws Error.
void requireSound(const BenchOptions& options, int ranks) {
  if (options.repeats < 1) throw Error(ErrorCode::InvalidArgument, "--repeats must be at least 1");
  if (!options.rival.empty() && !IcetCompositor::available()) {
    throw Error(ErrorCode::InvalidArgument,
                "this vdi was built without IceT: it takes Debian's paraview-dev and VDI_BUILD_PARAVIEW",
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
  // The table must not mix with the lines of the JSON.
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
    // A data set may have a file's name, which may contain any bytes.
    const std::string text = document.dump(2, ' ', false, json::error_handler_t::replace) + "\n";
    if (options.output.empty()) {
      fmt::print("{}", text);
    } else {
      io::writeAtomically(options.output, std::as_bytes(std::span(text)));
    }
  });
}

const char* const footer =
    R"(Each time is the median over the repeats, of the slowest rank. DVR and generate are device times of the
rank's own volume rendering and of its (sub-)VDI, compact, without transfers; the columns '/ DVR' and 'faster'
are ratios to a volume rendering right before. A GPU is kept busy before each run that counts.
composite is what merging took under mpirun; render is the device's time for one view of the VDI. SSIM and
PSNR compare that view with the truth: DVR at --truth-rate samples per voxel. DVR SSIM compares DVR at the
VDI's own --sampling-rate with it.
Below each VDI's views are its stages on several ranks, wall and device time of the slowest rank and the mean,
and the whole frame.
The table of suite viewpoints has least, median and mean SSIM over random viewpoints at the VDI's distance all
around the focal point ('sphere'), and over four turned from it to each side ('turned'). 'missing' is the share
of the picture, at worst and on average, where volume rendering shows something and the VDI nothing. A set is
of several VDIs: 'nearest' shows the one whose viewpoint is nearest by angle, 'blend' the two nearest. MiB and
ms are those of the whole set.
The table of suite stream has frames that a viewer decoded and drew (--turn degrees from their viewpoint) a
second, and their age then, from the beginning of the VDI's generation ('live': made and published as the
extractor VDIStream does) or from the file's appearance ('folder': followed as vdi serve does). Server and
viewer share this machine and its device; --rates limit the bytes between them. 'view' is what the viewer took
for a level.
The table of suite ranks has the wall clock of the slowest rank for each stage, and whole frames; 'faster' and
'more' compare the frame and VDIs/s with one rank's of the same layout, DVR is volume_rendering_ms.
JSON has, beside what the table has:
  frame_ms, volume_rendering_ms  a whole VDI and a whole picture: wall on the root's host, all ranks ready to
                                 result there
  shown_ms                       a VDI and its picture, likewise: on one rank its lists stay on the device
  vdis_per_second                VDIs one behind the other on an orbit (--frames), wall on the root's host
  generate_ms, distribute_ms, composite_ms, gather_ms
                                 device time of the first, wall of the others; slowest rank
  stages, picture_stages         all of them, of a VDI and of a picture by volume rendering: wall_ms and
                                 device_ms, slowest rank and mean
  sub_supersegments, bytes_sent  of all ranks, in one frame
  dvr_frame_ms, generate_frame_ms, render_frame_ms
                                 sums of the slowest rank's stages, transfers included
  upload_ms, step_ms             the upload of the values, and a frame made while the next step's are on their
                                 way
  rival_icet_ms                  with --rival icet: a whole picture, wall on the root's host. Each rank casts
                                 the samples of the whole scene that lie in its own blocks into a picture of
                                 floats (rival_render_ms, with download); IceT blends these in order of
                                 visibility and collects them (rival_composite_ms). To be compared with
                                 volume_rendering_ms, and with frame_ms, which makes more than a picture
  rival_redistribute_ms          if planes don't separate the ranks' blocks: the time to move the values to one
                                 box a rank, ghost layers included, upload excluded. Once a time step. null: not
                                 needed
  rival_bytes_sent, rival_redistributed_bytes
                                 of all ranks: in one picture, as IceT counts it; values that were moved,
                                 without ghost layers
  rival_max_difference           of a channel of its picture from renderVolume's, in 1/255
  null                           what wasn't measured, and the infinite PSNR of equal pictures)";

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
  options.quality.settings.samplesPerVoxel = 1.0;  // times refer to one rate, whatever the transfer function
  apps::addQualityOptions(command, options.quality, apps::QualityUse::Several);
}

void addMeasuringOptions(CLI::App& command, BenchOptions& options) {
  command.add_option("--algorithms", options.algorithms, "merge (the default), bisection or both")
      ->type_name("NAME");
  command.add_option("--supersegments", options.supersegments, "one or several N_S; default: 25");
  command.add_option("--views", options.views, "viewpoints of VDIs, evenly around the scene; default: 1")
      ->check(CLI::Range(1, 360));
  command.add_option("--angles", options.angles, "degrees from the VDI's viewpoint")
      ->type_name("DEG")
      ->capture_default_str();
  apps::addReconstructionOption(command, options.reconstruction);
  command.add_option("--repeats", options.repeats, "runs of which the median counts, after one warm-up")
      ->capture_default_str();
  command
      .add_option("--frames", options.frames,
                  "VDIs made on an orbit of 20 viewpoints, for vdis_per_second; 0: none")
      ->check(CLI::Range(0, 1000000))
      ->capture_default_str();
  command
      .add_option("--truth-rate", options.truthRate,
                  "samples per voxel of the volume rendering that pictures are compared with, 1/64 to 64")
      ->capture_default_str();
}

void addSuiteOptions(CLI::App& command, BenchOptions& options) {
  command
      .add_option(
          "--suite", options.suite,
          "data sets, sizes, viewpoints and N_S of docs/benchmarks.md: paper (needs a GPU and 32 GiB), "
          "small (a minute on a CPU); --fields picks some of it; ranks: whole frames on fewer and more of "
          "mpirun's ranks, of the volume and picture that the options say; viewpoints: how true VDIs "
          "of these are from all around; or stream: how many of them a viewer gets, and how old")
      ->check(CLI::IsMember(suiteNames()));
  command
      .add_option(
          "--rival", options.rival,
          "icet: beside the VDI, volume rendering of the same volume, camera and devices, composited by "
          "IceT; under mpirun, on one rank too. Takes the volume's memory twice. See below")
      ->check(CLI::IsMember({"icet"}));
}

void addRanksOptions(CLI::App& command, BenchOptions& options) {
  const char* const ranksGroup = "Suite ranks";
  command
      .add_option("--scaling", options.scalings,
                  "strong: --size is shared by all ranks; weak: each rank has --size-per-rank")
      ->check(CLI::IsMember({"strong", "weak"}))
      ->capture_default_str()
      ->group(ranksGroup);
  command
      .add_option("--layouts", options.layouts,
                  "layouts to run, instead of --layout. Slabs are one block a rank; others cut the fixed "
                  "volume into --blocks and a growing one into blocks of that size")
      ->type_name("LAYOUT")
      ->capture_default_str()
      ->group(ranksGroup);
  command
      .add_option("--rank-counts", options.rankCounts,
                  "how many of mpirun's ranks to run on; default: 1, 2, 4 and so on, and all")
      ->type_name("N")
      ->group(ranksGroup);
  command
      .add_option("--size-per-rank", options.sizePerRank,
                  "values per axis that each rank has in weak scaling; default: half of --size on each axis, "
                  "so that 8 ranks have the fixed volume")
      ->type_name("XxYxZ")
      ->group(ranksGroup);
}

void addViewpointsOptions(CLI::App& command, BenchOptions& options) {
  const char* const viewpointsGroup = "Suite viewpoints";
  command.add_option("--viewpoints", options.viewpoints, "random viewpoints; --seed says which")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str()
      ->group(viewpointsGroup);
  command
      .add_option("--turn", options.turn,
                  "degrees that the other four viewpoints are turned by; in suite stream, the viewer's view")
      ->capture_default_str()
      ->group(viewpointsGroup);
  command
      .add_option(
          "--zooms", options.zooms,
          "by how much nearer than the view's camera all viewpoints are; 4: a quarter of the width is "
          "seen")
      ->capture_default_str()
      ->group(viewpointsGroup);
  command.add_option("--margins", options.margins, "one or several, instead of --margin")
      ->capture_default_str()
      ->group(viewpointsGroup);
  command
      .add_option(
          "--list-resolutions", options.listResolutions,
          "of the VDIs' pictures, one or several; the views are of --resolution, as VDIs are by default")
      ->type_name("WxH")
      ->group(viewpointsGroup);
  command
      .add_option("--sets", options.sets,
                  "VDIs in a set: 1, 2 (front and back), 4 (a tetrahedron) or 6 (front, back and sides)")
      ->capture_default_str()
      ->group(viewpointsGroup);
}

void addStreamOptions(CLI::App& command, BenchOptions& options) {
  const char* const streamGroup = "Suite stream";
  command.add_option("--rates", options.rates, "limits for the viewer, such as 1Gbit or 12MB a second")
      ->type_name("RATE")
      ->capture_default_str()
      ->group(streamGroup);
  command.add_option("--period", options.period, "milliseconds between two frames; there are --frames")
      ->capture_default_str()
      ->group(streamGroup);
}

void addOutputOptions(CLI::App& command, BenchOptions& options) {
  command
      .add_option("--compare", options.comparison,
                  "two JSON files, before and after: tells what got slower by more than 10 % and the spread, "
                  "larger by more than 5 %, or less true; exit status 1 if anything did")
      ->expected(2)
      ->type_name("FILE FILE");
  command
      .add_option("-o,--output", options.output,
                  "JSON file; default: standard output, and the table goes to standard error")
      ->check(apps::requireFileName)
      ->type_name("FILE");
}

}  // namespace

void addBench(CLI::App& app, apps::Job& job) {
  CLI::App* command = app.add_subcommand(
      "bench", "Time every stage on this device and compare a VDI's views with volume rendering");
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
