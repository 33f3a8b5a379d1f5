// vdi generate: a volume to a .vdi file, under mpirun too.
#include <fmt/format.h>

#include "apps/Commands.h"
#include "apps/Source.h"
#include "vdi/io/Png.h"
#include "vdi/io/VdiFile.h"
#include "vdi/pipeline/Pipeline.h"

namespace vdi::apps {

namespace {

struct Options {
  std::string raw;  // sidecar; empty: a procedural field
  std::string field = "turbulence";
  DealOptions deal;
  ViewOptions view;
  QualityOptions quality;
  std::string output;
  std::string flat;
  std::string volume;
  double time = 0.0;
  std::uint64_t step = 0;

  bool wantsVdi() const { return volume.empty() || !output.empty() || !flat.empty(); }
};

std::vector<Block> blocksOf(const Options& options, const std::shared_ptr<gpu::Device>& device,
                            const comm::Communicator& world) {
  return options.raw.empty() ? fieldBlocks(options.field, options.deal, device, world.rank(), world.size())
                             : rawBlocks(options.raw, options.deal, world.rank(), world.size());
}

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

void writeVdiFiles(const Options& options, Vdi& vdi, const VdiGenerator& generator) {
  vdi.time = options.time;
  vdi.timeStep = options.step;
  if (!options.output.empty()) io::writeVdi(options.output, vdi);
  if (!options.flat.empty()) io::writePng(options.flat, io::toPicture(flatten(vdi)));
  fmt::print("{} x {} lists, {} supersegments, on {}\n", vdi.width, vdi.height, vdi.supersegmentCount(),
             generator.device().name());
  printReport(generator.reports());
}

/// What the root writes, the others wait for: all ranks fail when it can't.
void generate(const Options& options, const comm::Communicator& world) {
  std::shared_ptr<gpu::Device> device;
  std::vector<Block> blocks;
  GenerateSettings settings;
  world.together([&] {
    settings = makeSettings(options.quality);
    device = gpu::Device::create(gpu::requestFromEnvironment(world.localRank()));
    blocks = blocksOf(options, device, world);
  });
  VdiGenerator generator(device, comm::Communicator::world());
  generator.setBlocks(std::move(blocks));
  Camera camera;
  TransferFunction function;
  world.together([&] {
    camera = makeCamera(options.view, generator.scene());
    function = makeTransferFunction(options.quality, generator.scene(), generator.scalarRange());
  });
  if (options.wantsVdi()) {
    std::optional<Vdi> vdi = generator.generate(camera, function, settings);
    world.together([&] {
      if (vdi) writeVdiFiles(options, *vdi, generator);
    });
  }
  if (options.volume.empty()) return;
  const std::optional<Image> image = generator.renderVolume(camera, function, settings);
  world.together([&] {
    if (image) io::writePng(options.volume, io::toPicture(*image));
  });
}

}  // namespace

void addGenerate(CLI::App& app, Job& job) {
  CLI::App* command = app.add_subcommand(
      "generate", "Make a VDI of a raw volume or a procedural field; on several ranks under mpirun");
  command->footer(
      "Examples:\n"
      "  vdi generate --field coil -o coil.vdi --flat coil.png\n"
      "  mpirun -np 4 vdi generate --raw brain.json --blocks 4x4x4 --layout random -o brain.vdi");
  const auto options = std::make_shared<Options>();
  CLI::Option* raw =
      command->add_option("--raw", options->raw, "JSON sidecar of a raw volume (docs/raw-volumes.md)")
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
  command->add_option("--time", options->time, "simulation time, kept in the file")
      ->capture_default_str()
      ->group("Output");
  command->add_option("--step", options->step, "time step, kept in the file")
      ->capture_default_str()
      ->group("Output");
  command->callback([options, &job] {
    job = {[options](const comm::Communicator& world) { generate(*options, world); }, true};
  });
}

}  // namespace vdi::apps
