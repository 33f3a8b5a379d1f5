#include "bench/RanksSuite.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <exception>
#include <map>
#include <optional>

#include "apps/RawVolume.h"
#include "bench/Frames.h"
#include "bench/RankGroup.h"
#include "bench/Rival.h"
#include "vdi/core/Error.h"
#include "vdi/pipeline/VdiGenerator.h"

namespace vdi::bench {

using nlohmann::json;

namespace {

glm::ivec3 sizesOf(const std::string& text) {
  const std::vector<int> sizes = apps::parseSizes(text, 3);
  return {sizes[0], sizes[1], sizes[2]};
}

std::string textOf(const glm::ivec3& sizes) {
  return fmt::format("{}x{}x{}", sizes.x, sizes.y, sizes.z);
}

/// The requested counts, or 1, 2, 4 ... and all ranks, ascending.
std::vector<int> rankCounts(const BenchOptions& options, int ranks) {
  std::vector<int> counts = options.rankCounts;
  if (!counts.empty()) {
    std::sort(counts.begin(), counts.end());
    counts.erase(std::unique(counts.begin(), counts.end()), counts.end());
    return counts;
  }
  for (int count = 1; count < ranks; count *= 2) counts.push_back(count);
  counts.push_back(ranks);
  return counts;
}

/// The size of one rank's volume in weak scaling.
glm::ivec3 sizePerRank(const BenchOptions& options) {
  if (!options.sizePerRank.empty()) return sizesOf(options.sizePerRank);
  return glm::max(sizesOf(options.decomposition.size) / 2, glm::ivec3(2));
}

/// The setup of one row.
struct Setup {
  DataSet set;
  std::string scaling;  // "strong" or "weak"
  std::string layout;
  int ranks = 1;
  glm::ivec3 size{0};
  glm::ivec3 blocks{1};
};

/// In weak scaling, blocks are as large as those of the fixed volume, with at least one for each
/// rank.
Setup setupOf(const BenchOptions& options, const DataSet& set, const std::string& scaling,
              const std::string& layout, int ranks) {
  Setup setup{set, scaling, layout, ranks};
  const glm::ivec3 fixed =
      set.field.empty() ? apps::readSidecar(set.raw).lattice.size : sizesOf(options.decomposition.size);
  setup.size = fixed;
  setup.blocks = sizesOf(options.decomposition.blocks);
  if (scaling == "weak") {
    const glm::ivec3 own = sizePerRank(options);
    const glm::ivec3 growth = growthFor(ranks, own);
    setup.size = own * growth;
    const glm::dvec3 ratio = glm::dvec3(own) / glm::dvec3(fixed);
    setup.blocks = glm::max(glm::ivec3(glm::round(glm::dvec3(setup.blocks) * ratio)), glm::ivec3(1)) * growth;
  }
  if (layout == "slabs") setup.blocks = {1, 1, ranks};
  return setup;
}

std::string tableHead() {
  return fmt::format(
      "{:<12} {:<7} {:<12} {:>5} {:>3} {:>9} {:>9} {:>10} {:>9} {:>9} {:>9} {:>6} {:>8} {:>6} "
      "{:>9} {:>9} {:>8}",
      "data set", "scaling", "layout", "ranks", "N_S", "generate", "(device)", "distribute", "composite",
      "gather", "frame", "faster", "VDIs/s", "more", "DVR", "sent", "M subs");
}

/// The figures of one rank for a volume, layout and settings. Rows of other rank counts have ratios
/// to these.
struct OneRank {
  double frameMs = 0.0;
  std::optional<double> vdisPerSecond;
};

class RankSuite {
 public:
  RankSuite(const BenchOptions& options, const comm::Communicator& world, std::shared_ptr<gpu::Device> device,
            std::FILE* table)
      : options_(options), world_(world), device_(std::move(device)), clock_(device_), table_(table) {}

  /// The outermost loop makes a generator for each rank count, because shaders take seconds to
  /// compile on a CPU.
  std::vector<json> rows() {
    if (world_.rank() == 0) fmt::print(table_, "{}\n", tableHead());
    for (const int ranks : rankCounts(options_, world_.size())) {
      const RankGroup group(world_, ranks);
      std::exception_ptr error;
      if (group.member()) {
        try {
          measureOn(group);
        } catch (...) {
          error = std::current_exception();
        }
      }
      waitForAll();
      world_.agree(error);
    }
    return std::move(rows_);
  }

 private:
  void measureOn(const RankGroup& group) {
    const comm::Communicator communicator = group.communicator();
    VdiGenerator generator(device_, group.communicator(), generatorOptionsFromEnvironment(communicator));
    std::optional<IcetRival> rival;
    if (!options_.rival.empty()) rival.emplace(device_, group.communicator(), group.handle());
    for (const DataSet& set : dataSets(options_)) {
      for (const std::string& scaling : options_.scalings) {
        if (scaling == "weak" && set.field.empty()) continue;  // a file cannot grow
        for (const std::string& layout : options_.layouts) {
          generator.setBlocks({});  // frees memory
          if (rival) rival->dropBlocks();
          measure(setupOf(options_, set, scaling, layout, generator.communicator().size()), generator,
                  rival ? &*rival : nullptr);
        }
      }
    }
  }

  /// `rival` is null if none was requested.
  void measure(const Setup& setup, VdiGenerator& generator, IcetRival* rival) {
    const comm::Communicator& comm = generator.communicator();
    std::vector<Block> blocks;
    comm.together([&] {
      apps::DecompositionOptions decomposition = options_.decomposition;
      decomposition.size = textOf(setup.size);
      decomposition.blocks = textOf(setup.blocks);
      decomposition.layout = setup.layout;
      blocks = setup.set.field.empty()
                   ? apps::rawBlocks(setup.set.raw, decomposition, comm.rank(), comm.size())
                   : apps::fieldBlocks(setup.set.field, decomposition, device_, comm.rank(), comm.size());
    });
    const double uploadMs = readyMs(comm, [&] { generator.setBlocks(blocks); });
    FrameInput input;
    comm.together([&] {
      input.camera = apps::makeCamera(options_.view, generator.scene());
      input.function =
          apps::makeTransferFunction(options_.quality, generator.scene(), generator.scalarRange());
    });
    std::optional<RivalFigures> rivalFigures;
    if (rival != nullptr) {
      input.settings = apps::makeSettings(options_.quality);
      rival->setBlocks(blocks, generator.scene(), options_.repeats);
      const std::optional<Image> ours = generator.renderVolume(input.camera, input.function, input.settings);
      rivalFigures = rival->measure(clock_, input, options_.repeats, ours);
    }
    blocks.clear();
    for (const std::string& algorithm : options_.algorithms) {
      for (const std::uint32_t supersegments : options_.supersegments) {
        input.settings = benchSettings(options_, algorithm, supersegments);
        const FrameFigures figures =
            measureFrames(generator, device_, clock_, input, options_.repeats, options_.frames);
        if (comm.rank() == 0) addRow(setup, input.settings, uploadMs, figures, rivalFigures);
      }
    }
  }

  void addRow(const Setup& setup, const GenerateSettings& settings, double uploadMs,
              const FrameFigures& figures, const std::optional<RivalFigures>& rival) {
    const std::string key = fmt::format("{}, {}, {}, {}, {}", setup.set.name, setup.scaling, setup.layout,
                                        toString(settings.algorithm), settings.supersegments);
    if (setup.ranks == 1) oneRank_[key] = {figures.wall.median, figures.vdisPerSecond};
    const auto one = oneRank_.find(key);
    std::optional<double> faster;
    std::optional<double> more;
    if (one != oneRank_.end()) {
      faster = one->second.frameMs / figures.wall.median;
      if (figures.vdisPerSecond) more = *figures.vdisPerSecond / *one->second.vdisPerSecond;
    }
    const StageTimes& generate = figures.stage(FrameStage::Generate);
    const auto wall = [&](FrameStage stage) { return figures.stage(stage).wall.slowest; };
    const auto orDash = [](const std::optional<double>& value) {
      return value ? fmt::format("{:.2f}", *value) : std::string("-");
    };
    fmt::print(table_,
               "{:<12} {:<7} {:<12} {:>5} {:>3} {:>9.3f} {:>9.3f} {:>10.3f} {:>9.3f} {:>9.3f} {:>9.3f} {:>6} "
               "{:>8} {:>6} {:>9.3f} {:>9.2f} {:>8.3f}\n",
               setup.set.name, setup.scaling, setup.layout, setup.ranks, settings.supersegments,
               generate.wall.slowest, generate.device->slowest, wall(FrameStage::Distribute),
               wall(FrameStage::Composite), wall(FrameStage::Gather), figures.wall.median, orDash(faster),
               orDash(figures.vdisPerSecond), orDash(more), figures.volumeRendering.median,
               static_cast<double>(figures.bytesSent) / (1 << 20),
               1e-6 * static_cast<double>(figures.subSupersegments));
    if (rival) fmt::print(table_, "{}", rivalLine(*rival));
    std::fflush(table_);
    json row{{"dataset", setup.set.name},
             {"scaling", setup.scaling},
             {"layout", setup.layout},
             {"size", {setup.size.x, setup.size.y, setup.size.z}},
             {"copies", options_.decomposition.copies},
             {"blocks", {setup.blocks.x, setup.blocks.y, setup.blocks.z}},
             {"upload_ms", uploadMs},
             {"generate_ms", generate.device->slowest},
             {"frame_speedup", faster ? json(*faster) : json(nullptr)},
             {"vdis_speedup", more ? json(*more) : json(nullptr)}};
    addSettings(row, settings);
    addFigures(row, figures);
    if (rival) addRival(row, *rival);
    rows_.push_back(std::move(row));
  }

  const BenchOptions& options_;
  const comm::Communicator& world_;
  std::shared_ptr<gpu::Device> device_;
  ClockRaiser clock_;
  std::FILE* table_;
  std::map<std::string, OneRank> oneRank_;  // by all properties except the ranks
  std::vector<json> rows_;
};

}  // namespace

glm::ivec3 growthFor(int ranks, const glm::ivec3& sizePerRank) {
  std::vector<int> primes;
  for (int prime = 2; ranks > 1; ++prime) {
    for (; ranks % prime == 0; ranks /= prime) primes.push_back(prime);
  }
  glm::ivec3 growth{1};
  for (auto prime = primes.rbegin(); prime != primes.rend(); ++prime) {
    int shortest = 2;
    for (const int axis : {1, 0}) {
      if (sizePerRank[axis] * growth[axis] < sizePerRank[shortest] * growth[shortest]) shortest = axis;
    }
    growth[shortest] *= *prime;
  }
  return growth;
}

void requireSoundRanks(const BenchOptions& options, int ranks) {
  (void)sizesOf(options.decomposition.size);
  (void)sizesOf(options.decomposition.blocks);
  if (!options.sizePerRank.empty()) (void)sizesOf(options.sizePerRank);
  for (const std::string& layout : options.layouts) (void)synthetic::layoutFromString(layout);
  for (const int count : options.rankCounts) {
    if (count < 1 || count > ranks) {
      throw Error(ErrorCode::InvalidArgument,
                  fmt::format("can't measure {} ranks, because only {} were started", count, ranks),
                  "--rank-counts");
    }
  }
}

std::vector<json> runRanks(const BenchOptions& options, const comm::Communicator& world,
                           const std::shared_ptr<gpu::Device>& device, std::FILE* table) {
  return RankSuite(options, world, device, table).rows();
}

}  // namespace vdi::bench
