// vdi generate: a volume to a .vdi file, under mpirun too.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <future>

#include "apps/Commands.h"
#include "apps/Source.h"
#include "vdi/io/Png.h"
#include "vdi/io/VdiFile.h"
#include "vdi/pipeline/Pipeline.h"

namespace vdi::apps {

namespace {

struct Options {
  std::vector<std::string> raws;  // sidecars, of time steps; none: a procedural field
  std::string field = "turbulence";
  DealOptions deal;
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
  /// Of the index-th step: picture.png of step 7 is picture_0007.png, when there are several.
  std::filesystem::path numbered(const std::filesystem::path& path, std::size_t index) const {
    return steps() == 1 ? path : withSuffix(path, fmt::format("{:04}", step + index));
  }
};

void printReport(const std::vector<RankReport>& reports) {
  fmt::print(
      "rank  blocks  upload s  generate s  distribute s  composite s  gather s   sent MiB  device MiB\n");
  for (std::size_t i = 0; i < reports.size(); ++i) {
    const RankReport& r = reports[i];
    fmt::print("{:4}  {:6}  {:8.3f}  {:10.3f}  {:12.3f}  {:11.3f}  {:8.3f}  {:9.2f}  {:10.1f}\n", i, r.blocks,
               r.uploadSeconds, r.generateSeconds, r.distributeSeconds, r.compositeSeconds, r.gatherSeconds,
               static_cast<double>(r.bytesSent) / 1048576.0, static_cast<double>(r.deviceBytes) / 1048576.0);
  }
}

/// What's the same in all time steps.
struct Shot {
  Camera camera;
  TransferFunction function;
  GenerateSettings settings;
};

void writeVdiFiles(const Options& options, std::size_t index, Vdi& vdi, const VdiGenerator& generator) {
  vdi.time = options.time + static_cast<double>(index) * options.interval;
  vdi.timeStep = options.step + index;
  if (!options.output.empty()) io::writeVdi(options.numbered(options.output, index), vdi);
  if (!options.flat.empty()) io::writePng(options.numbered(options.flat, index), io::toPicture(flatten(vdi)));
  fmt::print("{} x {} lists, {} supersegments, on {}\n", vdi.width, vdi.height, vdi.supersegmentCount(),
             generator.device().name());
  printReport(generator.reports());
}

/// What the root writes, the others wait for: all ranks fail when it can't.
void shoot(const Options& options, std::size_t index, const Shot& shot, VdiGenerator& generator,
           const comm::Communicator& world) {
  if (options.wantsVdi()) {
    std::optional<Vdi> vdi = generator.generate(shot.camera, shot.function, shot.settings);
    world.together([&] {
      if (!vdi) return;
      writeVdiFiles(options, index, *vdi, generator);
      generator.recycle(std::move(*vdi));
    });
  }
  if (options.volume.empty()) return;
  std::optional<Image> image = generator.renderVolume(shot.camera, shot.function, shot.settings);
  world.together([&] {
    if (!image) return;
    io::writePng(options.numbered(options.volume, index), io::toPicture(*image));
    generator.recycle(std::move(*image));
  });
}

void generate(const Options& options, const comm::Communicator& world) {
  Shot shot;
  std::shared_ptr<gpu::Device> device;
  std::vector<Block> first;
  const auto read = [&](std::size_t index) {
    return rawBlocks(options.raws[index], options.deal, world.rank(), world.size());
  };
  world.together([&] {
    shot.settings = makeSettings(options.quality);
    device = gpu::Device::create(gpu::requestFromEnvironment(world.localRank()));
    first = options.raws.empty()
                ? fieldBlocks(options.field, options.deal, device, world.rank(), world.size())
                : read(0);
  });
  VdiGenerator generator(device, comm::Communicator::world());
  generator.setBlocks(std::move(first));
  world.together([&] {
    shot.camera = makeCamera(options.view, generator.scene());
    shot.function = makeTransferFunction(options.quality, generator.scene(), generator.scalarRange());
  });
  // While a step's frame is made, the next one's values get to the device, and those behind it are read.
  std::future<std::vector<Block>> reading;
  const auto startReading = [&](std::size_t index) {
    if (index < options.steps())
      reading = std::async(std::launch::async | std::launch::deferred, read, index);
  };
  startReading(1);
  for (std::size_t index = 0; index < options.steps(); ++index) {
    const bool more = index + 1 < options.steps();
    if (more) {
      std::vector<Block> next;
      world.together([&] { next = reading.get(); });
      generator.setNextBlocks(std::move(next));
      startReading(index + 2);
    }
    shoot(options, index, shot, generator, world);
    if (more) generator.advance();
  }
}

}  // namespace

void addGenerate(CLI::App& app, Job& job) {
  CLI::App* command = app.add_subcommand(
      "generate", "Make a VDI of a raw volume or a procedural field; on several ranks under mpirun");
  command->footer(
      "Examples:\n"
      "  vdi generate --field coil -o coil.vdi --flat coil.png\n"
      "  mpirun -np 4 vdi generate --raw brain.json --blocks 4x4x4 --layout random -o brain.vdi\n"
      "  vdi generate --raw step*.json -o steps.vdi\n"
      "The last one writes steps_0000.vdi, steps_0001.vdi and so on, which ParaView opens as a series. All "
      "steps\n"
      "have the same viewpoint and transfer function; where these depend on the volume, on the first one.");
  const auto options = std::make_shared<Options>();
  CLI::Option* raw =
      command
          ->add_option("--raw", options->raws,
                       "JSON sidecars of raw volumes (docs/raw-volumes.md); several are time steps, whose "
                       "output files get numbers")
          ->type_name("FILE")
          ->group("Volume and ranks");
  command->add_option("--field", options->field, "procedural field:" + fieldsHelp())
      ->type_name("NAME")
      ->capture_default_str()
      ->excludes(raw)
      ->group("Volume and ranks");
  addDealOptions(*command, options->deal);
  raw->excludes("--size")->excludes("--type");
  addViewOptions(*command, options->view);
  addQualityOptions(*command, options->quality);
  const auto addFile = [&](const char* name, std::string& file, const char* description) {
    command->add_option(name, file, description)->type_name("FILE")->group("Output");
  };
  addFile("-o,--output", options->output, "the .vdi file to write");
  addFile("--flat", options->flat, "PNG of the VDI seen from its own viewpoint");
  addFile("--dvr", options->volume, "PNG of plain volume rendering from there");
  command->add_option("--time", options->time, "simulation time of the first step, kept in the file")
      ->capture_default_str()
      ->group("Output");
  command->add_option("--interval", options->interval, "simulation time from step to step")
      ->capture_default_str()
      ->group("Output");
  command->add_option("--step", options->step, "number of the first time step, kept in the file")
      ->capture_default_str()
      ->group("Output");
  command->callback([options, &job] {
    job = {[options](const comm::Communicator& world) { generate(*options, world); }, true};
  });
}

}  // namespace vdi::apps
