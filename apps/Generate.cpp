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
  SourceOptions source;
  ViewOptions view;
  QualityOptions quality;
  std::string transferFunction;
  std::string output;
  std::string flat;
  std::string volume;
  double time = 0.0;
  std::uint64_t step = 0;
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

void generate(const Options& options, const comm::Communicator& world) {
  std::shared_ptr<gpu::Device> device;
  std::vector<Block> blocks;
  GenerateSettings settings;
  world.together([&] {
    settings = makeSettings(options.quality);
    device = gpu::Device::create(gpu::requestFromEnvironment(world.localRank()));
    blocks = makeBlocks(options.source, world.rank(), world.size());
  });
  VdiGenerator generator(device, comm::Communicator::world());
  generator.setBlocks(std::move(blocks));
  Camera camera;
  TransferFunction function;
  world.together([&] {
    camera = makeCamera(options.view, generator.scene());
    function = makeTransferFunction(options.transferFunction, generator.scene(), generator.scalarRange());
  });
  std::optional<Vdi> vdi = generator.generate(camera, function, settings);
  world.together([&] {
    if (!vdi) return;
    vdi->time = options.time;
    vdi->timeStep = options.step;
    if (!options.output.empty()) io::writeVdi(options.output, *vdi);
    if (!options.flat.empty()) io::writePng(options.flat, io::toPicture(flatten(*vdi)));
    fmt::print("{} x {} lists, {} supersegments, on {}\n", vdi->width, vdi->height,
               vdi->lists.segments.size(), generator.device().name());
    printReport(generator.reports());
  });
  if (options.volume.empty()) return;
  const std::optional<Image> image = generator.renderVolume(camera, function, settings);
  world.together([&] {
    if (image) io::writePng(options.volume, io::toPicture(*image));
  });
}

}  // namespace

void addGenerate(CLI::App& app, const comm::Communicator& world) {
  CLI::App* command =
      app.add_subcommand("generate", "Make a VDI of a raw volume or a procedural field; also under mpirun");
  const auto options = std::make_shared<Options>();
  addSourceOptions(*command, options->source);
  addViewOptions(*command, options->view);
  addQualityOptions(*command, options->quality);
  command->add_option("--transfer-function", options->transferFunction,
                      "JSON file (docs/raw-volumes.md); default: three hues");
  command->add_option("-o,--output", options->output, "the .vdi file to write");
  command->add_option("--flat", options->flat, "PNG of the VDI seen from its own viewpoint");
  command->add_option("--dvr", options->volume, "PNG of plain volume rendering from there");
  command->add_option("--time", options->time, "simulation time, kept in the file")->capture_default_str();
  command->add_option("--step", options->step, "time step, kept in the file")->capture_default_str();
  command->callback([options, &world] { generate(*options, world); });
}

}  // namespace vdi::apps
