// vdi generate: makes a .vdi file from a volume, also under mpirun.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <exception>
#include <filesystem>
#include <future>

#include "apps/Commands.h"
#include "apps/Help.h"
#include "apps/OutputFiles.h"
#include "apps/RawVolume.h"
#include "apps/Say.h"
#include "apps/Source.h"
#include "vdi/core/Error.h"
#include "vdi/core/Flatten.h"
#include "vdi/core/SamplingRate.h"
#include "vdi/io/Png.h"
#include "vdi/io/VdiFile.h"
#include "vdi/pipeline/VdiGenerator.h"

namespace vdi::apps {

namespace {

struct GenerateOptions {
  std::vector<std::string> raws;  // sidecars of time steps; empty: a procedural field
  std::string field = "turbulence";
  DecompositionOptions decomposition;
  ViewOptions view;
  QualityOptions quality;
  std::string output;
  std::string flat;
  std::string volume;
  double time = 0.0;
  double interval = 1.0;
  std::uint64_t step = 0;

  bool wantsVdi() const { return volume.empty() || !output.empty() || !flat.empty(); }
  std::size_t steps() const { return std::max<std::size_t>(raws.size(), 1); }
  std::uint64_t number(std::size_t index) const { return step + index; }
  double timeOf(std::size_t index) const { return time + static_cast<double>(index) * interval; }
  /// The path of the index-th step. With several steps, picture.png becomes picture_0007.png for
  /// step 7.
  std::filesystem::path numbered(const std::filesystem::path& path, std::size_t index) const {
    return steps() == 1 ? path : withSuffix(path, fmt::format("{:04}", number(index)));
  }
};

void printReport(const std::vector<RankReport>& reports) {
  fmt::print(
      "rank  blocks  upload s  generate s  distribute s  composite s  gather s  output s   sent MiB  "
      "written MiB  device MiB  host MiB\n");
  const auto mib = [](std::uint64_t bytes) { return static_cast<double>(bytes) / (1 << 20); };
  for (std::size_t i = 0; i < reports.size(); ++i) {
    const RankReport& r = reports[i];
    fmt::print(
        "{:4}  {:6}  {:8.3f}  {:10.3f}  {:12.3f}  {:11.3f}  {:8.3f}  {:8.3f}  {:9.2f}  {:11.2f}  {:10.1f}  "
        "{:8.1f}\n",
        i, r.blocks, r.uploadSeconds, r.generateSeconds, r.distributeSeconds, r.compositeSeconds,
        r.gatherSeconds, r.outputSeconds, mib(r.bytesSent), mib(r.bytesWritten), mib(r.deviceBytes),
        mib(r.hostPeakBytes));
  }
}

/// The parameters that all time steps share.
struct Shot {
  Camera camera;
  TransferFunction function;
  GenerateSettings settings;
  ScalarArray array;
};

void printOutcome(const GenerateSettings& settings, std::uint64_t supersegments,
                  const VdiGenerator& generator) {
  fmt::print("{} x {} lists, {} supersegments, on {}\n", settings.width, settings.height, supersegments,
             generator.device().name());
  if (!generator.reports().empty())
    fmt::print("{:g} samples per voxel\n", generator.reports().front().samplesPerVoxel);
  printReport(generator.reports());
}

/// Writes the VDI, if it is wanted, and a picture of it. The root has gathered the whole VDI for that.
void writeVdiFiles(const GenerateOptions& options, std::size_t index, const Shot& shot, Vdi& vdi) {
  vdi.coloring->array = shot.array;
  vdi.time = options.timeOf(index);
  vdi.timeStep = options.number(index);
  if (!options.output.empty()) io::writeVdi(options.numbered(options.output, index), vdi);
  io::writePng(options.numbered(options.flat, index), io::toPicture(flatten(vdi)));
}

/// The other ranks wait for the root to write. If it fails, all ranks fail.
void shoot(const GenerateOptions& options, std::size_t index, const Shot& shot, VdiGenerator& generator,
           const comm::Communicator& world) {
  if (options.wantsVdi() && options.flat.empty() && !options.output.empty()) {
    const WrittenVdi written =
        generator.write(options.numbered(options.output, index), shot.camera, shot.function, shot.settings,
                        {options.timeOf(index), options.number(index), shot.array});
    if (world.rank() == 0) printOutcome(shot.settings, written.supersegments, generator);
  } else if (options.wantsVdi()) {
    std::optional<Vdi> vdi = generator.generate(shot.camera, shot.function, shot.settings);
    world.together([&] {
      if (!vdi) return;
      if (!options.flat.empty()) writeVdiFiles(options, index, shot, *vdi);
      printOutcome(shot.settings, vdi->supersegmentCount(), generator);
    });
  }
  if (options.volume.empty()) return;
  std::optional<Image> image = generator.renderVolume(shot.camera, shot.function, shot.settings);
  world.together([&] {
    if (!image) return;
    io::writePng(options.numbered(options.volume, index), io::toPicture(*image));
  });
}

/// Checks the options before the work starts. Throws Error.
void requireSound(const GenerateOptions& options) {
  const std::size_t last = options.steps() - 1;
  if (options.number(last) < last) {
    throw Error(ErrorCode::InvalidArgument, "the number of the last time step exceeds 2^64 - 1", "--step");
  }
  if (!std::isfinite(options.timeOf(0)) || !std::isfinite(options.timeOf(last))) {
    throw Error(ErrorCode::InvalidArgument, "the time must be finite", "--time, --interval");
  }
}

/// Throws Error unless a VDI holds this blend mode.
void requireHeld(const Blending& blending) {
  if (blending.mode == BlendMode::Composite) return;
  throw Error(ErrorCode::InvalidArgument,
              "a VDI holds composite blending only; for a picture of this blend mode use --dvr, without -o "
              "and --flat",
              fmt::format("--blend {}", toString(blending.mode)));
}

/// Throws Error if an output cannot be written, or would overwrite an input.
void requireOutputsOf(const GenerateOptions& options) {
  std::vector<NamedFile> inputs{{"--camera", options.view.camera.file},
                                {"--transfer-function", options.quality.transferFunction}};
  for (const std::string& sidecar : options.raws) {
    inputs.push_back({"--raw", sidecar});
    try {
      inputs.push_back({"the raw volume", readSidecar(sidecar).data});
    } catch (const Error&) {  // this step's turn will report it
    }
  }
  std::vector<NamedFile> outputs;
  const auto add = [&](const char* option, const std::string& path) {
    for (std::size_t index = 0; index < options.steps() && !path.empty(); ++index)
      outputs.push_back({option, options.numbered(path, index)});
  };
  add("-o", options.output);
  add("--flat", options.flat);
  add("--dvr", options.volume);
  requireOutputs(outputs, inputs);
}

/// Makes the VDIs of all readable time steps. All functions are collective.
class Series {
 public:
  Series(const GenerateOptions& options, const comm::Communicator& world, std::shared_ptr<gpu::Device> device)
      : options_(options),
        world_(world),
        device_(std::move(device)),
        generator_(device_, comm::Communicator::world(), generatorOptionsFromEnvironment(world)) {}

  /// Writes all readable steps, then throws the error of the first unreadable one. The very first
  /// step must be readable, because it determines camera and transfer function.
  void make(const GenerateSettings& settings) {
    Shot shot;
    shot.settings = settings;
    startReading(0);
    generator_.setBlocks(finishReading());
    world_.together([&] {
      shot.array = options_.raws.empty() ? fieldArray(options_.field, options_.decomposition)
                                         : rawArray(options_.raws.front());
      shot.camera = makeCamera(options_.view, generator_.scene());
      shot.function = makeTransferFunction(options_.quality, generator_.scene(), generator_.scalarRange());
      if (world_.rank() != 0) return;
      noteRange(shot.function);
      if (const std::string loss = describeLoss(shot.function); !loss.empty()) say("warning: " + loss);
    });
    // While one step's frame is made, the next step travels to the device, and the step after that
    // is read.
    startReading(1);
    for (std::size_t index = 0; index < options_.steps();) {
      std::size_t next = index + 1;
      while (next < options_.steps() && !setNext(next)) ++next;
      shoot(options_, index, shot, generator_, world_);
      if (next < options_.steps()) generator_.advance();
      index = next;
    }
    if (firstBad_) std::rethrow_exception(firstBad_);
  }

 private:
  /// Says that the colours' automatic range is much wider than the first step's values.
  void noteRange(const TransferFunction& function) const {
    const ScalarRange& range = generator_.scalarRange();
    const bool isAutomatic = function.colors.front().x == range.min && function.colors.back().x == range.max;
    const std::optional<ScalarRange> part = isAutomatic ? generator_.crowdedPart() : std::nullopt;
    if (part) say(describeCrowded(range, *part) + " (--transfer-function FILE, --missing)");
  }
  std::vector<Block> read(std::size_t index) const {
    return options_.raws.empty()
               ? fieldBlocks(options_.field, options_.decomposition, device_, world_.rank(), world_.size())
               : rawBlocks(options_.raws[index], options_.decomposition, world_.rank(), world_.size());
  }
  void startReading(std::size_t index) {
    if (index >= options_.steps()) return;
    reading_ = std::async(std::launch::async | std::launch::deferred, [this, index] { return read(index); });
  }
  std::vector<Block> finishReading() {
    std::vector<Block> blocks;
    world_.together([&] { blocks = reading_.get(); });
    return blocks;
  }
  /// Returns false if the step is unreadable. Starts reading the next step in either case.
  bool setNext(std::size_t index) {
    std::exception_ptr bad;
    try {
      generator_.setNextBlocks(finishReading());
    } catch (const Error& error) {
      const std::string what = fmt::format("time step {}: {}", options_.number(index), error.what());
      bad = std::make_exception_ptr(Error(error.code(), what));
    } catch (...) {  // the read error on this rank; Error on the others
      bad = std::current_exception();
    }
    if (!firstBad_) firstBad_ = bad;
    startReading(index + 1);
    return !bad;
  }

  const GenerateOptions& options_;
  const comm::Communicator& world_;
  std::shared_ptr<gpu::Device> device_;
  VdiGenerator generator_;
  std::exception_ptr firstBad_;
  std::future<std::vector<Block>> reading_;  // its destructor waits, so it comes last
};

void generate(const GenerateOptions& options, const comm::Communicator& world) {
  GenerateSettings settings;
  std::shared_ptr<gpu::Device> device;
  world.together([&] {
    settings = makeSettings(options.quality);
    if (options.wantsVdi()) requireHeld(settings.blending);
    requireSound(options);
    if (world.rank() == 0) requireOutputsOf(options);
    device = gpu::Device::create(gpu::requestFromEnvironment(world.localRank()));
  });
  Series(options, world, std::move(device)).make(settings);
}

}  // namespace

void addGenerate(CLI::App& app, Job& job) {
  CLI::App* command = app.add_subcommand(
      "generate", "Make a VDI of a raw volume or a procedural field, also on several ranks under mpirun");
  command->footer(
      "Examples:\n"
      "  vdi generate --field coil -o coil.vdi --flat coil.png\n"
      "  mpirun -np 4 vdi generate --raw brain.json --blocks 4x4x4 --layout random -o brain.vdi\n"
      "  vdi generate --raw step*.json -o steps.vdi\n"
      "The last one writes steps_0000.vdi, steps_0001.vdi and so on, which ParaView opens as a series. All\n"
      "steps have the same viewpoint and transfer function. If these depend on the volume, the first step\n"
      "decides.");
  const auto options = std::make_shared<GenerateOptions>();
  CLI::Option* raw =
      command
          ->add_option("--raw", options->raws,
                       "JSON sidecars of raw volumes (docs/raw-volumes.md); several sidecars are time steps, "
                       "and their output files get numbers")
          ->type_name("FILE")
          ->group("Volume and ranks");
  command->add_option("--field", options->field, "procedural field:" + fieldsHelp())
      ->type_name("NAME")
      ->capture_default_str()
      ->excludes(raw)
      ->group("Volume and ranks");
  addDecompositionOptions(*command, options->decomposition);
  raw->excludes("--size")->excludes("--type");
  addViewOptions(*command, options->view);
  addQualityOptions(*command, options->quality);
  const auto addFile = [&](const char* name, std::string& file, const char* description) {
    command->add_option(name, file, description)->check(requireFileName)->type_name("FILE")->group("Output");
  };
  addFile("-o,--output", options->output, "the .vdi file to write");
  addFile("--flat", options->flat,
          "PNG of the VDI from its own viewpoint; the first rank gathers the whole VDI");
  addFile("--dvr", options->volume, "PNG of direct volume rendering from that viewpoint; allows any --blend");
  command->add_option("--time", options->time, "simulation time of the first step, stored in the file")
      ->capture_default_str()
      ->group("Output");
  command->add_option("--interval", options->interval, "simulation time between steps")
      ->capture_default_str()
      ->group("Output");
  command->add_option("--step", options->step, "number of the first time step, stored in the file")
      ->check(requireWholeNumber)
      ->capture_default_str()
      ->group("Output");
  command->callback([options, &job] {
    job = {[options](const comm::Communicator& world) { generate(*options, world); }, true};
  });
}

}  // namespace vdi::apps
