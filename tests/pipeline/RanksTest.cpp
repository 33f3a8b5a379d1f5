// N ranks compared with one: the decomposition must not be visible.
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <thread>

#include "tests/Catch.h"
#include "tests/Devices.h"
#include "tests/Scenes.h"
#include "tests/Thrown.h"
#include "tests/pipeline/PictureDifference.h"
#include "vdi/comm/Funnel.h"
#include "vdi/core/ComponentValues.h"
#include "vdi/core/Error.h"
#include "vdi/core/Flatten.h"
#include "vdi/pipeline/VdiGenerator.h"
#include "vdi/pipeline/VdiRenderer.h"

using namespace vdi;
using synthetic::Joint;
using synthetic::Layout;
using test::device;
using test::thrownBy;

namespace {

bool anythingSeen(const Image& image) {
  std::size_t seen = 0;
  for (const glm::vec4& pixel : image.rgba) seen += pixel.a > 0.1F ? 1 : 0;
  return seen > image.rgba.size() / 20;
}

struct Case {
  const char* name;
  Layout layout;
  Joint joint;
  ScalarType type;
  glm::ivec3 blocks;
  bool parallel;
  bool isShaded = false;  // in the test of shading
};

const Case cases[] = {
    {"slabs", Layout::Slabs, Joint::SharedPoints, ScalarType::F32, {1, 1, 8}, false, true},
    {"bricks", Layout::Bricks, Joint::SharedPoints, ScalarType::U8, {3, 2, 2}, false},
    {"interleaved, cells", Layout::Interleaved, Joint::Cells, ScalarType::U16, {4, 4, 4}, false},
    {"checkerboard, parallel", Layout::Checkerboard, Joint::SharedPoints, ScalarType::F32, {5, 5, 5}, true},
    {"random, gaps", Layout::Random, Joint::Gap, ScalarType::F32, {4, 3, 5}, false},
    {"random, cells, parallel", Layout::Random, Joint::Cells, ScalarType::F64, {3, 3, 3}, true, true},
    {"one rank holds all", Layout::OnOneRank, Joint::SharedPoints, ScalarType::I16, {2, 2, 2}, false},
};

}  // namespace

TEST_CASE("the flat image and DVR of N ranks equal the DVR of one") {
  const comm::Communicator world = comm::Communicator::world();
  const bool root = world.rank() == 0;
  // All cases share these generators: shapes, types and cameras change as they do for a user.
  VdiGenerator one(device(), comm::Communicator::serial());
  VdiGenerator many(device(), comm::Communicator::world());
  VdiRenderer renderer(device());
  for (const Case& c : cases) {
    INFO(c.name);
    // A field with structure up to the domain's faces, so that a lost or repeated sample is visible.
    const glm::ivec3 size{34, 30, 37};
    const auto decomposed = test::dealt(world, "turbulence", size, c.blocks, c.layout, c.joint, c.type);
    const auto whole = test::onOneRank("turbulence", size, {1, 1, 1}, c.type, c.joint);
    const TransferFunction function = test::threeHues(test::topOf(c.type) * 0.8);
    const GenerateSettings settings = test::smallSettings();
    const Camera camera = test::oblique(c.parallel);

    std::optional<Image> truth;
    if (root) {
      one.setBlocks(whole.mine);
      truth = one.renderVolume(camera, function, settings);
      REQUIRE(anythingSeen(*truth));
    }

    many.setBlocks(decomposed.mine);
    auto volume = many.renderVolume(camera, function, settings);
    if (root) CHECK(test::largestDifference(*volume, *truth) < 1.0F);
    volume.reset();  // the next one reuses its memory
    volume = many.renderVolume(camera, function, settings);
    if (root) CHECK(test::largestDifference(*volume, *truth) < 1.0F);
    for (const Algorithm algorithm : {Algorithm::Merge, Algorithm::Bisection}) {
      INFO(toString(algorithm));
      GenerateSettings own = settings;
      own.algorithm = algorithm;
      const auto vdi = many.generate(camera, function, own);
      CHECK(vdi.has_value() == root);
      if (!root) continue;
      CHECK_NOTHROW(validate(*vdi));
      CHECK(test::largestDifference(flatten(*vdi), *truth) < 1.0F);
      renderer.setVdi(*vdi);
      CHECK(test::largestDifference(renderer.render(camera, settings.width, settings.height), *truth) < 1.0F);
      CHECK(many.reports().size() == static_cast<std::size_t>(world.size()));
    }
  }
}

TEST_CASE("an automatic sampling rate: the one that the function needs, and the picture of one rank") {
  const comm::Communicator world = comm::Communicator::world();
  VdiGenerator one(device(), comm::Communicator::serial());
  VdiGenerator many(device(), comm::Communicator::world());
  const glm::ivec3 size{26, 24, 25};
  const auto whole = test::onOneRank("turbulence", size);
  const auto dealt = test::dealt(world, "turbulence", size, {3, 2, 4}, Layout::Random, Joint::Gap);
  one.setBlocks(whole.mine);
  many.setBlocks(dealt.mine);
  // In other units the same function is steeper: it passes through its hues many times.
  TransferFunction steep = test::threeHues(1.0);
  steep.colors.clear();
  for (int i = 0; i <= 24; ++i)
    steep.colors.push_back({i / 24.0, glm::dvec3(i % 3 == 0, i % 3 == 1, i % 3 == 2)});
  GenerateSettings settings = test::smallSettings();
  const auto rates = [&](const TransferFunction& function) {
    settings.samplesPerVoxel = automaticRate;
    const std::optional<Image> expected = one.renderVolume(test::oblique(), function, settings);
    const double rate = one.reports().front().samplesPerVoxel;
    const std::optional<Image> together = many.renderVolume(test::oblique(), function, settings);
    std::optional<Vdi> vdi = many.generate(test::oblique(), function, settings);
    if (world.rank() == 0) {
      CHECK(many.reports().front().samplesPerVoxel == rate);
      CHECK(anythingSeen(*expected));
      CHECK(test::largestDifference(*expected, *together) < 2.0F);
      CHECK(test::largestDifference(*expected, flatten(*vdi)) < 2.0F);
    }
    // The picture equals that at the explicit rate.
    settings.samplesPerVoxel = rate;
    const std::optional<Image> numbered = one.renderVolume(test::oblique(), function, settings);
    CHECK(test::largestDifference(*expected, *numbered) == 0.0F);
    return rate;
  };
  CHECK(rates(steep) > 1.0);
  CHECK(rates(test::threeHues(1.0, 0.5)) == 1.0);
}

TEST_CASE("shaded, also nearest: the picture and VDI of N ranks are those of one") {
  const comm::Communicator world = comm::Communicator::world();
  const bool root = world.rank() == 0;
  VdiGenerator one(device(), comm::Communicator::serial());
  VdiGenerator many(device(), comm::Communicator::world());
  for (const Case& c : cases) {
    if (!c.isShaded) continue;
    const auto decomposed =
        test::dealt(world, "turbulence", {34, 30, 37}, c.blocks, c.layout, c.joint, c.type);
    many.setBlocks(decomposed.mine);
    const auto whole = test::onOneRank("turbulence", {34, 30, 37}, {1, 1, 1}, c.type, c.joint);
    if (root) one.setBlocks(whole.mine);
    const TransferFunction function = test::threeHues(test::topOf(c.type) * 0.8);
    const Camera camera = test::oblique(c.parallel);
    // Together, ParaView's lights make colours brighter than a supersegment can be; at 0.85 they do not. The
    // ball is cut open.
    for (const auto& [diffuse, interpolation] :
         {std::pair(1.0, Interpolation::Linear), std::pair(0.85, Interpolation::Linear),
          std::pair(0.85, Interpolation::Nearest)}) {
      INFO(c.name << ", diffuse " << diffuse << ", " << toString(interpolation));
      GenerateSettings settings = test::smallSettings();
      if (diffuse < 1.0) {
        settings.region.box = Box{{0.1, 0.0, 0.15}, {0.93, 0.8, 0.9}};
        settings.region.planes = {{{0.5, 0.5, 0.6}, {0.3, -0.4, -1.0}}};
      }
      settings.shading.on = true;
      settings.shading.diffuse = diffuse;
      settings.interpolation = interpolation;
      const auto volume = many.renderVolume(camera, function, settings);
      const auto vdi = many.generate(camera, function, settings);
      if (!root) continue;
      const auto truth = one.renderVolume(camera, function, settings);
      REQUIRE(anythingSeen(*truth));
      // Nearest samples are cut at voxels' faces, whose places blocks round differently.
      const float bound = interpolation == Interpolation::Nearest ? 1.5F : 1.0F;
      CHECK(test::largestDifference(*volume, *truth) < bound);
      const auto alone = one.generate(camera, function, settings);
      // Colours clipped at 1 are rounded once more on each side.
      CHECK(test::largestDifference(flatten(*vdi), flatten(*alone)) < (diffuse < 1.0 ? 2.0F : 2.5F));
      if (diffuse < 1.0) CHECK(test::largestDifference(flatten(*vdi), *truth) < 1.5F);
    }
  }
}

TEST_CASE("missing values: holes in the picture, and N ranks make that of one") {
  const comm::Communicator world = comm::Communicator::world();
  VdiGenerator one(device(), comm::Communicator::serial());
  VdiGenerator many(device(), comm::Communicator::world());
  const TransferFunction function = test::threeHues(0.8 * test::topOf(ScalarType::U8));
  for (const Joint joint : {Joint::SharedPoints, Joint::Cells}) {
    auto decomposed =
        test::dealt(world, "turbulence", {34, 30, 37}, {3, 3, 2}, Layout::Random, joint, ScalarType::U8);
    auto whole = test::onOneRank("turbulence", {34, 30, 37}, {1, 1, 1}, ScalarType::U8, joint);
    one.setBlocks(whole.mine);
    const auto complete = one.renderVolume(test::oblique(false), function, test::smallSettings());
    for (std::vector<Block>* blocks : {&decomposed.mine, &whole.mine}) {
      for (Block& block : *blocks) leaveOutMissing(block, std::vector<double>{47.0, 55.0, 300.0});
    }
    many.setBlocks(decomposed.mine);
    one.setBlocks(whole.mine);
    const auto volume = many.renderVolume(test::oblique(false), function, test::smallSettings());
    const auto vdi = many.generate(test::oblique(false), function, test::smallSettings());
    if (world.rank() != 0) continue;
    const auto truth = one.renderVolume(test::oblique(false), function, test::smallSettings());
    REQUIRE(anythingSeen(*truth));
    CHECK(test::largestDifference(*truth, *complete) > 20.0F);
    CHECK(test::largestDifference(*volume, *truth) < 1.0F);
    CHECK(test::largestDifference(flatten(*vdi), *truth) < 1.5F);
  }
}

TEST_CASE("colours of other values than opacities: the picture and VDI of N ranks are those of one") {
  const comm::Communicator world = comm::Communicator::world();
  const char* const fields[] = {"shells", "turbulence", "shells"};
  for (const std::size_t colors : {std::size_t{1}, std::size_t{3}}) {
    INFO(colors << " colours");
    const glm::ivec3 size{34, 30, 37};
    const auto coloredBlocks = [&](auto blocksOf) {
      std::vector<Block> blocks = blocksOf("turbulence").mine;
      for (std::size_t c = 0; c < colors; ++c) {
        const test::Decomposed values = blocksOf(fields[c]);
        for (std::size_t i = 0; i < blocks.size(); ++i) {
          blocks[i].colors.push_back(values.mine[i]);
          blocks[i].colors.back().displayed = {0.1, 0.4 + 0.2 * static_cast<double>(c)};
        }
      }
      return blocks;
    };
    VdiGenerator many(device(), comm::Communicator::world());
    many.setBlocks(coloredBlocks([&](const char* field) {
      return test::dealt(world, field, size, {3, 2, 4}, Layout::Random, Joint::Gap, ScalarType::F32);
    }));
    const GenerateSettings settings = test::smallSettings();
    const auto volume = many.renderVolume(test::oblique(), test::threeHues(0.8), settings);
    const auto vdi = many.generate(test::oblique(), test::threeHues(0.8), settings);
    if (world.rank() != 0) continue;
    VdiGenerator one(device(), comm::Communicator::serial());
    one.setBlocks(coloredBlocks([&](const char* field) { return test::onOneRank(field, size); }));
    const auto truth = one.renderVolume(test::oblique(), test::threeHues(0.8), settings);
    REQUIRE(anythingSeen(*truth));
    CHECK(many.coloredRange() == one.coloredRange());
    CHECK(test::largestDifference(*volume, *truth) < 1.0F);
    CHECK(test::largestDifference(flatten(*vdi), *truth) < 1.0F);
  }
}

TEST_CASE("a margin on N ranks: the lists of one rank, and its picture") {
  const comm::Communicator world = comm::Communicator::world();
  const bool root = world.rank() == 0;
  VdiGenerator one(device(), comm::Communicator::serial());
  VdiGenerator many(device(), comm::Communicator::world());
  const auto decomposed = test::dealt(world, "turbulence", {34, 30, 37}, {2, 2, 2}, Layout::Interleaved);
  const auto whole = test::onOneRank("turbulence", {34, 30, 37});
  Camera camera = test::oblique();
  camera.viewAngle /= 3.0;
  GenerateSettings settings = test::smallSettings(32, 24);
  settings.margin = 0.5;
  many.setBlocks(decomposed.mine);
  std::optional<Vdi> vdi = many.generate(camera, test::threeHues(0.8), settings);
  VdiRenderer renderer(device());
  many.show(root ? &renderer : nullptr, camera, test::threeHues(0.8), settings);
  if (root) {
    const Image shown = renderer.render(camera, settings.width, settings.height);
    CHECK(test::largestDifference(shown, flatten(*vdi)) < 1.0F);
    one.setBlocks(whole.mine);
    Vdi alone = *one.generate(camera, test::threeHues(0.8), settings);
    CHECK(vdi->margin == glm::ivec2(16, 12));
    CHECK(vdi->margin == alone.margin);
    const Image picture = *one.renderVolume(camera, test::threeHues(0.8), settings);
    CHECK(test::largestDifference(flatten(*vdi), picture) < 1.0F);
    vdi->margin = alone.margin = glm::ivec2(0);  // then all lists belong to the picture
    CHECK(test::largestDifference(flatten(*vdi), flatten(alone)) < 1.5F);
  }
  settings.margin = world.rank() == 1 ? 0.25 : 0.5;
  if (world.size() > 1) CHECK_THROWS_AS(many.generate(camera, test::threeHues(0.8), settings), Error);
  settings.margin = 0.5;
  CHECK_THROWS_AS(many.show(nullptr, camera, test::threeHues(0.8), settings), Error);
}

TEST_CASE(
    "a total budget over all ranks: the picture of one, as many supersegments as equally, unequal lists") {
  const comm::Communicator world = comm::Communicator::world();
  const auto decomposed = test::dealt(world, "turbulence", {34, 30, 37}, {3, 3, 3}, Layout::Random);
  VdiGenerator generator(device(), comm::Communicator::world());
  generator.setBlocks(decomposed.mine);
  GenerateSettings settings = test::smallSettings(61, 45, 5);
  const auto truth = generator.renderVolume(test::oblique(), test::threeHues(0.8), settings);
  const auto equal = generator.generate(test::oblique(), test::threeHues(0.8), settings);
  for (const double fill : {1.0, 0.6}) {
    settings.budget = Budget::Total;
    settings.fill = fill;
    const auto vdi = generator.generate(test::oblique(), test::threeHues(0.8), settings);
    if (world.rank() != 0) continue;
    CHECK_NOTHROW(validate(*vdi));
    CHECK(test::largestDifference(flatten(*vdi), *truth) < 1.0F);
    const auto count = static_cast<double>(vdi->supersegmentCount());
    CHECK(count / static_cast<double>(equal->supersegmentCount()) == Approx(fill).epsilon(0.05));
  }
}

namespace {

/// The first VDI and picture, which all others must equal bit for bit.
class FirstMade {
 public:
  /// Checks on the root; other ranks have nothing to check.
  void check(const std::optional<Vdi>& vdi, const std::optional<Image>& image) {
    if (!vdi) return;
    if (!vdi_) vdi_ = *vdi;
    if (!image_) image_ = *image;
    CHECK(*vdi == *vdi_);
    CHECK(image->rgba == image_->rgba);
    CHECK(image->depth == image_->depth);
  }

 private:
  std::optional<Vdi> vdi_;
  std::optional<Image> image_;
};

}  // namespace

TEST_CASE("ways between ranks: shared memory, messages, both, staging memory: the same VDI and picture",
          "[long]") {
  const comm::Communicator world = comm::Communicator::world();
  const auto decomposed = test::dealt(world, "turbulence", {34, 30, 37}, {4, 3, 4}, Layout::Random,
                                      Joint::SharedPoints, ScalarType::U8);
  const GenerateSettings settings = test::smallSettings(61, 45, 6);
  const TransferFunction function = test::threeHues(80.0);
  gpu::DeviceRequest request = gpu::requestFromEnvironment(0);
  request.importsHostMemory = false;
  const auto copying = gpu::Device::create(request);
  FirstMade first;
  using Way = std::pair<comm::Transport, const char*>;
  for (const auto& [transport, ranksPerHost] :
       {Way{comm::Transport::Shared, "0"}, Way{comm::Transport::Mpi, "0"},
        Way{comm::Transport::Shared, "2"}}) {
    for (const auto& own : {device(), copying}) {
      INFO((transport == comm::Transport::Shared ? "shared" : "mpi")
           << ", ranks a host: " << ranksPerHost << (own == copying ? ", without imported memory" : ""));
      setenv("VDI_RANKS_PER_HOST", ranksPerHost, 1);
      VdiGenerator generator(own, comm::Communicator::world(), {.transport = transport});
      unsetenv("VDI_RANKS_PER_HOST");
      generator.setBlocks(decomposed.mine);
      // In two of the ways, a second frame reuses the first one's memory.
      const bool again = *ranksPerHost == '0' && (transport == comm::Transport::Mpi) == (own == copying);
      for (int frame = 0; frame < (again ? 2 : 1); ++frame) {
        const auto vdi = generator.generate(test::oblique(), function, settings);
        const auto image = generator.renderVolume(test::oblique(), function, settings);
        first.check(vdi, image);
      }
    }
  }
}

TEST_CASE("rank 0's environment says how all ranks work, and what makes no sense is refused on all") {
  const comm::Communicator world = comm::Communicator::world();
  const auto optionsWith = [&](const char* name, const char* value) {
    if (world.rank() == 0) setenv(name, value, 1);  // mpirun may not pass it on to other ranks
    const auto unset = [&] { unsetenv(name); };
    try {
      const GeneratorOptions options = generatorOptionsFromEnvironment(world);
      unset();
      return options;
    } catch (...) {
      unset();
      throw;
    }
  };
  CHECK(optionsWith("VDI_BANDS", "").bands == 0);
  CHECK(optionsWith("VDI_BANDS", "3").bands == 3);
  CHECK(optionsWith("VDI_TRANSPORT", "mpi").transport == comm::Transport::Mpi);
  for (const char* const bands : {"0", "-1", "3x", "many", "99999999999"})
    CHECK_THROWS_AS(optionsWith("VDI_BANDS", bands), Error);
  CHECK_THROWS_AS(optionsWith("VDI_TRANSPORT", "pigeon"), Error);
}

TEST_CASE("lists of more than 255 supersegments: both ways, and the picture of one rank") {
  const comm::Communicator world = comm::Communicator::world();
  const auto decomposed = test::dealt(world, "turbulence", {34, 30, 37}, {4, 3, 4}, Layout::Random,
                                      Joint::SharedPoints, ScalarType::U8);
  constexpr std::uint32_t budget = 1024;  // enough to make each sample a supersegment
  GenerateSettings settings = test::smallSettings(9, 7, budget);
  settings.samplesPerVoxel = 32.0;
  const TransferFunction function = test::threeHues(80.0);
  FirstMade made;
  for (const comm::Transport transport : {comm::Transport::Shared, comm::Transport::Mpi}) {
    INFO((transport == comm::Transport::Shared ? "shared" : "mpi"));
    VdiGenerator generator(device(), comm::Communicator::world(), {.transport = transport});
    generator.setBlocks(decomposed.mine);
    const auto vdi = generator.generate(test::oblique(), function, settings);
    if (vdi) {
      std::uint32_t longest = 0;
      const auto& offsets = vdi->offsets();
      for (std::size_t i = 0; i + 1 < offsets.size(); ++i)
        longest = std::max(longest, offsets[i + 1] - offsets[i]);
      // Up to three ranks, some rank's own count exceeds a byte; with more, only the whole list's does.
      CHECK(longest > 255 * static_cast<std::uint32_t>(std::min(world.size(), 3)));
      CHECK(longest <= budget);
    }
    made.check(vdi, generator.renderVolume(test::oblique(), function, settings));
  }
}

TEST_CASE("4096 blocks dealt at random: lists of many runs, and the picture of one rank") {
  const comm::Communicator world = comm::Communicator::world();
  const auto decomposed = test::dealt(world, "turbulence", {49, 49, 49}, {16, 16, 16}, Layout::Random);
  const GenerateSettings settings = test::smallSettings(56, 44, 5);
  VdiGenerator many(device(), comm::Communicator::world());
  many.setBlocks(decomposed.mine);
  const auto volume = many.renderVolume(test::oblique(), test::threeHues(0.8), settings);
  const auto vdi = many.generate(test::oblique(), test::threeHues(0.8), settings);
  if (world.rank() != 0) return;
  const auto whole = test::onOneRank("turbulence", {49, 49, 49});
  VdiGenerator one(device(), comm::Communicator::serial());
  one.setBlocks(whole.mine);
  const auto truth = one.renderVolume(test::oblique(), test::threeHues(0.8), settings);
  REQUIRE(anythingSeen(*truth));
  CHECK(test::largestDifference(*volume, *truth) < 1.0F);
  CHECK_NOTHROW(validate(*vdi));
  CHECK(test::largestDifference(flatten(*vdi), *truth) < 1.0F);
}

TEST_CASE("all ranks together send little more than one rank makes") {
  const comm::Communicator world = comm::Communicator::world();
  const auto subSupersegments = [&](int ranks) {
    const auto decomposed =
        test::decompose("turbulence", {40, 40, 40}, {5, 5, 5}, Layout::Random, Joint::SharedPoints,
                        ScalarType::F32, ranks == 1 ? 0 : world.rank(), ranks);
    VdiGenerator generator(device(), ranks == 1 ? comm::Communicator::serial() : comm::Communicator::world());
    generator.setBlocks(decomposed.mine);
    generator.generate(test::oblique(), test::threeHues(0.8), test::smallSettings(96, 72, 12));
    double sum = 0.0;
    for (const RankReport& report : generator.reports()) sum += static_cast<double>(report.subSupersegments);
    return sum;
  };
  const double together = subSupersegments(world.size());
  if (world.rank() == 0) CHECK(together < 1.7 * subSupersegments(1));
}

TEST_CASE("a large picture in bands, most of which are empty: the picture of one rank") {
  const comm::Communicator world = comm::Communicator::world();
  const auto parts = test::dealt(world, "shells", {16, 16, 16}, {2, 2, 2}, Layout::Interleaved, Joint::Cells);
  const GenerateSettings settings = test::smallSettings(640, 360, 5);
  Camera camera = test::oblique(true);
  camera.parallelScale *= 6.0;  // the upper and lower bands have many lists, all empty
  VdiGenerator many(device(), comm::Communicator::world());
  many.setBlocks(parts.mine);
  const auto vdi = many.generate(camera, test::threeHues(0.8), settings);
  const auto volume = many.renderVolume(camera, test::threeHues(0.8), settings);
  if (world.rank() != 0) return;
  const auto whole = test::onOneRank("shells", {16, 16, 16}, {1, 1, 1}, ScalarType::F32, Joint::Cells);
  VdiGenerator one(device(), comm::Communicator::serial());
  one.setBlocks(whole.mine);
  const auto truth = one.renderVolume(camera, test::threeHues(0.8), settings);
  CHECK(vdi->supersegmentCount() > 100);
  CHECK(test::largestDifference(flatten(*vdi), *truth) < 1.0F);
  CHECK(test::largestDifference(*volume, *truth) < 1.0F);
}

TEST_CASE("tiny pictures: more ranks than rows and pixels") {
  const comm::Communicator world = comm::Communicator::world();
  const auto decomposed = test::dealt(world, "shells", {12, 12, 12}, {2, 2, 2}, Layout::Interleaved);
  VdiGenerator generator(device(), comm::Communicator::world());
  generator.setBlocks(decomposed.mine);
  for (const auto& [width, height] : {std::pair(1, 1), std::pair(3, 1), std::pair(1, 2)}) {
    for (const std::uint32_t supersegments : {1U, 7U}) {
      for (const Budget budget : {Budget::List, Budget::Total}) {
        GenerateSettings settings = test::smallSettings(width, height, supersegments);
        settings.budget = budget;
        const auto vdi = generator.generate(test::oblique(), test::threeHues(1.0), settings);
        if (world.rank() == 0) CHECK_NOTHROW(validate(*vdi));
      }
    }
  }
}

TEST_CASE("a failing rank leaves the others running, and the next frame works") {
  const comm::Communicator world = comm::Communicator::world();
  const auto decomposed = test::dealt(world, "shells", {12, 12, 12}, {2, 2, 2}, Layout::Interleaved);
  VdiGenerator generator(device(), comm::Communicator::world());
  auto broken = decomposed.mine;
  if (world.rank() == world.size() - 1) {
    broken.emplace_back();  // neither data nor dims
  }
  CHECK_THROWS_AS(generator.setBlocks(broken), Error);
  CHECK_NOTHROW(generator.setBlocks(decomposed.mine));
  GenerateSettings settings = test::smallSettings(16, 12);
  if (world.rank() == 0) settings.supersegments = 0;
  CHECK_THROWS_AS(generator.generate(test::oblique(), test::threeHues(1.0), settings), Error);
  CHECK_NOTHROW(generator.generate(test::oblique(), test::threeHues(1.0), test::smallSettings(16, 12)));
}

TEST_CASE("frames that overlap are those that are made alone") {
  const comm::Communicator world = comm::Communicator::world();
  const auto decomposedOf = [&](const char* field) {
    return test::dealt(world, field, {30, 34, 27}, {3, 2, 3}, Layout::Random);
  };
  const auto first = decomposedOf("turbulence");
  const auto second = decomposedOf("shells");
  /// A frame's inputs. Viewpoint, function, size, supersegments and blocks change, as in a session.
  struct Wanted {
    const test::Decomposed* blocks;
    double azimuth;
    double opacity;
    GenerateSettings settings;
  };
  GenerateSettings total = test::smallSettings(31, 23, 4);
  total.budget = Budget::Total;
  GenerateSettings full = test::smallSettings(30, 20);
  full.precision = Precision::Full;
  GenerateSettings searched = test::smallSettings(30, 20);
  searched.algorithm = Algorithm::Bisection;
  const std::vector<Wanted> wanted{{&first, 0, 0.8, test::smallSettings(40, 30)},
                                   {&first, 40, 0.8, test::smallSettings(40, 30)},
                                   {&first, 40, 0.2, test::smallSettings(40, 30)},
                                   {&second, 80, 0.2, test::smallSettings(40, 30)},
                                   {&second, 80, 0.9, test::smallSettings(50, 40, 3)},
                                   {&first, 10, 0.9, total},
                                   {&first, 20, 0.9, total},
                                   {&second, 20, 0.5, full},
                                   {&second, 25, 0.5, searched},
                                   {&second, 29, 0.5, searched}};
  VdiGenerator generator(device(), comm::Communicator::world());
  const auto show = [&](VdiGenerator& shown, std::size_t i) {
    if (i == 0 || wanted[i].blocks != wanted[i - 1].blocks) shown.setBlocks(wanted[i].blocks->mine);
  };
  const auto start = [&](std::size_t i) {
    show(generator, i);
    return generator.start(test::oblique().azimuth(wanted[i].azimuth), test::threeHues(wanted[i].opacity),
                           wanted[i].settings);
  };
  std::vector<std::optional<Vdi>> alone;
  VdiGenerator other(device(), comm::Communicator::world());
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    show(other, i);
    alone.push_back(other.generate(test::oblique().azimuth(wanted[i].azimuth),
                                   test::threeHues(wanted[i].opacity), wanted[i].settings));
  }
  std::optional<VdiFrame> last = start(0);
  for (std::size_t i = 1; i <= wanted.size(); ++i) {
    INFO("frame " << i - 1);
    std::optional<VdiFrame> next;
    if (i < wanted.size()) next = start(i);
    const auto vdi = generator.finish(std::move(*last));
    last = std::move(next);
    REQUIRE(vdi.has_value() == (world.rank() == 0));
    if (vdi) CHECK(*vdi == *alone[i - 1]);
    CHECK(generator.reports().size() == (vdi ? static_cast<std::size_t>(world.size()) : 0));
  }
}

TEST_CASE("frames that are never finished, and frames under way when a rank fails") {
  const comm::Communicator world = comm::Communicator::world();
  const auto decomposed = test::dealt(world, "turbulence", {24, 24, 24}, {2, 2, 2}, Layout::Random);
  const TransferFunction function = test::threeHues(0.8);
  const GenerateSettings settings = test::smallSettings();
  VdiGenerator generator(device(), comm::Communicator::world());
  generator.setBlocks(decomposed.mine);
  const auto expected = generator.generate(test::oblique(), function, settings);
  for (int i = 0; i < 5; ++i) generator.start(test::oblique().azimuth(10 * i), function, settings);
  VdiFrame first = generator.start(test::oblique(), function, settings);
  generator.start(test::oblique().azimuth(7), function, settings);
  generator.start(test::oblique().azimuth(8), function, settings);
  const auto late = generator.finish(std::move(first));  // completed when the third one took its place
  if (late) CHECK(*late == *expected);
  // A refused call leaves the frame under way intact; a cancelled one does not.
  VdiFrame kept = generator.start(test::oblique(), function, settings);
  GenerateSettings wrong = settings;
  if (world.rank() == 0) wrong.supersegments = 0;
  CHECK_THROWS_AS(generator.start(test::oblique(), function, wrong), Error);
  const auto vdi = generator.finish(std::move(kept));
  if (vdi) CHECK(*vdi == *expected);
  VdiFrame lost = generator.start(test::oblique(), function, settings);
  CHECK(thrownBy([&] {
          generator.start(test::oblique(), function, settings,
                          [&](double) { return world.rank() != world.size() - 1; });
        }).code == ErrorCode::Cancelled);
  CHECK(thrownBy([&] { generator.finish(std::move(lost)); }).code == ErrorCode::Cancelled);
  const auto after = generator.generate(test::oblique(), function, settings);
  if (after) CHECK(*after == *expected);
  // A handle may outlive its generator.
  std::optional<VdiFrame> orphan;
  {
    VdiGenerator gone(device(), comm::Communicator::world());
    gone.setBlocks(decomposed.mine);
    orphan = gone.start(test::oblique(), function, settings);
  }
  const auto error = thrownBy([&] { generator.finish(std::move(*orphan)); });
  CHECK(error.code == ErrorCode::InvalidArgument);
  CHECK(error.text.find("the frame's generator no longer exists") != std::string::npos);
}

TEST_CASE("a generator refuses the frames of another, under way or complete") {
  const comm::Communicator world = comm::Communicator::world();
  const auto decomposed = test::dealt(world, "turbulence", {24, 24, 24}, {2, 2, 2}, Layout::Random);
  const TransferFunction function = test::threeHues(0.8);
  const GenerateSettings settings = test::smallSettings();
  VdiGenerator owner(device(), comm::Communicator::world());
  VdiGenerator other(device(), comm::Communicator::world());
  owner.setBlocks(decomposed.mine);
  other.setBlocks(decomposed.mine);
  const auto expected = owner.generate(test::oblique(), function, settings);
  const auto start = [&] { return owner.start(test::oblique(), function, settings); };
  const auto refuses = [&](VdiFrame frame) {
    const auto error = thrownBy([&] { other.finish(std::move(frame)); });
    CHECK(error.code == ErrorCode::InvalidArgument);
    CHECK(error.text.find("another generator started this frame") != std::string::npos);
  };
  refuses(start());
  VdiFrame complete = start();
  start();
  VdiFrame last = start();  // completes the first one
  refuses(std::move(complete));
  const auto vdi = owner.finish(std::move(last));
  if (vdi) CHECK(*vdi == *expected);
}

TEST_CASE("a frame cancelled late leaves nothing in the next one's memory") {
  const comm::Communicator world = comm::Communicator::world();
  const auto decomposed = test::dealt(world, "turbulence", {24, 24, 24}, {2, 2, 2}, Layout::Random);
  gpu::DeviceRequest request = gpu::requestFromEnvironment(0);
  request.importsHostMemory = false;  // staged data must also arrive
  const auto copying = gpu::Device::create(request);
  const TransferFunction function = test::threeHues(80.0);
  const GenerateSettings settings = test::smallSettings(61, 45, 6);
  Camera beside = test::oblique();
  beside.viewAngle *= 1.3;
  FirstMade made;
  for (const bool stopped : {false, true, true}) {
    VdiGenerator generator(copying, comm::Communicator::world(), {.bands = 4});
    generator.setBlocks(decomposed.mine);
    const auto late = [&](double done) { return done < 0.6 || world.rank() != 1; };
    if (stopped && world.size() > 1) {
      CHECK(thrownBy([&] { generator.generate(beside, function, settings, late); }).code ==
            ErrorCode::Cancelled);
      CHECK(thrownBy([&] { generator.renderVolume(beside, function, settings, late); }).code ==
            ErrorCode::Cancelled);
    }
    const auto vdi = generator.generate(test::oblique(), function, settings);
    made.check(vdi, generator.renderVolume(test::oblique(), function, settings));
  }
}

TEST_CASE("a frame of threads that may not call MPI: the same, also after one that was stopped") {
  const comm::Communicator world = comm::Communicator::world();
  const auto decomposed = test::dealt(world, "turbulence", {24, 24, 24}, {2, 2, 2}, Layout::Random);
  const TransferFunction function = test::threeHues(80.0);
  const GenerateSettings settings = test::smallSettings(61, 45, 6);
  VdiGenerator generator(device(), comm::Communicator::world());
  generator.setBlocks(decomposed.mine);
  const auto expected = generator.generate(test::oblique(), function, settings);
  for (const bool stopped : {false, true, false}) {
    comm::Funnel funnel;
    std::atomic<bool> done{false};
    std::optional<ErrorCode> code;
    std::optional<Vdi> vdi;
    std::jthread thread([&] {
      const comm::Funnel::Entry entry(funnel);
      const auto generate = [&] {
        vdi = generator.generate(test::oblique(), function, settings,
                                 [&](double share) { return !stopped || share < 0.5 || world.rank() != 0; });
      };
      code = thrownBy(generate).code;
      done = true;
    });
    while (!done) funnel.serve(std::chrono::milliseconds(5));
    thread.join();
    CHECK(code == (stopped ? std::optional(ErrorCode::Cancelled) : std::nullopt));
    CHECK(vdi.has_value() == (!stopped && world.rank() == 0));
    if (vdi) CHECK(*vdi == *expected);
  }
}

TEST_CASE("the next step, while this one is shown: all ranks advance, or none does") {
  const comm::Communicator world = comm::Communicator::world();
  const auto decomposedOf = [&](const char* field) {
    return test::dealt(world, field, {34, 30, 37}, {3, 2, 3}, Layout::Random, Joint::Gap);
  };
  const auto first = decomposedOf("turbulence");
  const auto second = decomposedOf("shells");
  const GenerateSettings settings = test::smallSettings();
  const TransferFunction function = test::threeHues(0.8);
  VdiGenerator fresh(device(), comm::Communicator::world());
  const auto truthOf = [&](const test::Decomposed& decomposed) {
    fresh.setBlocks(decomposed.mine);
    return fresh.renderVolume(test::oblique(), function, settings);
  };
  const auto firstTruth = truthOf(first);
  const auto secondTruth = truthOf(second);
  VdiGenerator generator(device(), comm::Communicator::world());
  const auto requireShown = [&](const std::optional<Image>& truth) {
    const auto vdi = generator.generate(test::oblique(), function, settings);
    if (vdi) CHECK(test::largestDifference(flatten(*vdi), *truth) < 1.0F);
  };
  generator.setBlocks(first.mine);
  generator.setNextBlocks(second.mine);
  requireShown(firstTruth);
  auto broken = second.mine;
  if (world.rank() == world.size() - 1) broken.emplace_back();
  CHECK_THROWS_AS(generator.setNextBlocks(broken), Error);
  CHECK_THROWS_AS(generator.advance(), Error);
  requireShown(firstTruth);
  generator.setNextBlocks(second.mine);
  generator.advance();
  requireShown(secondTruth);
}

TEST_CASE("parameters that differ between ranks are refused on every rank, by name") {
  const comm::Communicator world = comm::Communicator::world();
  const auto decomposed = test::dealt(world, "shells", {12, 12, 12}, {2, 2, 2}, Layout::Interleaved);
  VdiGenerator generator(device(), comm::Communicator::world());
  generator.setBlocks(decomposed.mine);
  const GenerateSettings settings = test::smallSettings(16, 12);
  Camera camera = test::oblique();
  if (world.rank() == 1) camera.viewAngle += 1e-9;
  using test::ContainsSubstring;
  CHECK_THROWS_WITH(generator.generate(camera, test::threeHues(1.0), settings),
                    ContainsSubstring("different values: camera view angle"));
  TransferFunction function = test::threeHues(1.0);
  if (world.rank() == 1) function.unitDistance *= 2.0;
  CHECK_THROWS_WITH(generator.generate(test::oblique(), function, settings),
                    ContainsSubstring("different values: scalar opacity unit distance"));
  GenerateSettings other = test::smallSettings(world.rank() == 1 ? 15 : 16, 12);
  if (world.rank() == 1) other.fill = 0.5;
  CHECK_THROWS_WITH(generator.generate(test::oblique(), test::threeHues(1.0), other),
                    ContainsSubstring("different values: width, fill"));
  // If one rank is told to stop, all stop.
  CHECK(thrownBy([&] {
          generator.generate(test::oblique(), test::threeHues(1.0), settings,
                             [&](double) { return world.rank() != 1; });
        }).code == ErrorCode::Cancelled);
  CHECK_NOTHROW(generator.generate(test::oblique(), test::threeHues(1.0), settings));
}
