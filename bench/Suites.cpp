#include "bench/Suites.h"

#include <algorithm>
#include <filesystem>

namespace vdi::bench {

namespace {

/// The paper's configurations (its section 6). The fields have the size, type and character of its data sets.
std::vector<DataSet> suiteSets(const std::string& suite) {
  if (suite == "paper") {
    return {{"kingsnake-like", "coil", "", "1024x1024x795", "u8"},
            {"rayleigh-taylor-like", "mixing", "", "1024x1024x1024", "u16"},
            {"richtmyer-meshkov-like", "interface", "", "2048x2048x1920", "u8"}};
  }
  return {{"kingsnake-like", "coil", "", "64x64x50", "u8"},
          {"rayleigh-taylor-like", "mixing", "", "64x64x64", "u16"},
          {"richtmyer-meshkov-like", "interface", "", "96x96x90", "u8"}};
}

}  // namespace

const std::vector<std::string>& suiteNames() {
  static const std::vector<std::string> names{"paper", "small", ranksSuite, viewpointsSuite, streamSuite};
  return names;
}

void applySuite(BenchOptions& options) {
  const bool paper = options.suite == "paper";
  const bool small = options.suite == "small";
  if (paper || small) {
    if (options.views == 0) options.views = paper ? 4 : 1;
    options.quality.resolution = paper ? "1920x1080" : "240x136";
  }
  if (options.algorithms.empty()) {
    options.algorithms = {"merge"};
    if (paper || small) options.algorithms.emplace_back("bisection");
  }
  if (options.views == 0) options.views = 1;
  if (options.supersegments.empty()) {
    options.supersegments = paper   ? std::vector<std::uint32_t>{20, 25, 30}
                            : small ? std::vector<std::uint32_t>{10}
                                    : std::vector<std::uint32_t>{25};
  }
  if (small) options.repeats = std::min(options.repeats, 3);
}

std::vector<DataSet> dataSets(const BenchOptions& options) {
  const bool hasSets = options.suite == "paper" || options.suite == "small";
  if (hasSets) {
    std::vector<DataSet> sets = suiteSets(options.suite);
    if (!options.fields.empty()) {
      std::erase_if(sets, [&](const DataSet& set) {
        return std::find(options.fields.begin(), options.fields.end(), set.field) == options.fields.end();
      });
    }
    return sets;
  }
  std::vector<DataSet> sets;
  for (const std::string& sidecar : options.raws)
    sets.push_back({std::filesystem::path(sidecar).stem().string(), "", sidecar, "", ""});
  std::vector<std::string> fields = options.fields;
  if (fields.empty() && options.raws.empty()) {
    fields = options.suite == ranksSuite ? std::vector<std::string>{"interface"}
             : options.suite == viewpointsSuite || options.suite == streamSuite
                 ? std::vector<std::string>{"mixing", "interface", "coil"}
                 : std::vector<std::string>{"turbulence", "mixing", "coil"};
  }
  for (const std::string& field : fields)
    sets.push_back({field, field, "", options.decomposition.size, options.decomposition.type});
  return sets;
}

GenerateSettings benchSettings(const BenchOptions& options, const std::string& algorithm,
                               std::uint32_t supersegments) {
  GenerateSettings settings = apps::makeSettings(options.quality);
  settings.algorithm = algorithmFromString(algorithm);
  if (settings.algorithm == Algorithm::Bisection) {
    settings.budget = Budget::List;
    settings.fill = 1.0;
  }
  settings.supersegments = supersegments;
  return settings;
}

std::vector<Block> blocksOf(const DataSet& set, const BenchOptions& options,
                            const std::shared_ptr<gpu::Device>& device, const comm::Communicator& world) {
  std::vector<Block> blocks;
  world.together([&] {
    apps::DecompositionOptions decomposition = options.decomposition;
    if (!set.size.empty()) decomposition.size = set.size;
    if (!set.type.empty()) decomposition.type = set.type;
    blocks = set.field.empty()
                 ? apps::rawBlocks(set.raw, decomposition, world.rank(), world.size())
                 : apps::fieldBlocks(set.field, decomposition, device, world.rank(), world.size());
  });
  return blocks;
}

}  // namespace vdi::bench
