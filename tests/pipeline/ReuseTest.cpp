// Results in memory that earlier ones have used.
#include <cstdint>
#include <utility>
#include <vector>

#include "tests/pipeline/AgainstReference.h"
#include "vdi/comm/Communicator.h"
#include "vdi/pipeline/VdiGenerator.h"
#include "vdi/pipeline/VdiRenderer.h"

using namespace vdi;
using test::device;
using test::largestDifference;

TEST_CASE("a VDI in the memory of another one, whatever its precision and size were, is the same") {
  const auto decomposed = test::onOneRank("mixing", {24, 24, 24});
  VdiGenerator generator(device(), comm::Communicator::serial());
  generator.setBlocks(decomposed.mine);
  GenerateSettings settings = test::smallSettings(40, 30, 5);
  const auto vdiOf = [&] { return *generator.generate(test::oblique(), test::threeHues(1.0), settings); };
  const Vdi first = vdiOf();
  for (const Precision precision : {Precision::Compact, Precision::Full, Precision::Compact}) {
    settings = test::smallSettings(60, 50, 9);
    settings.precision = precision;
    vdiOf();
    settings = test::smallSettings(40, 30, 5);
    Vdi again = vdiOf();
    CHECK(again == first);
    // The VDI is the same in the memory of an equal or a smaller picture, too.
    again = {};
    again = vdiOf();
    CHECK(again == first);
    settings = test::smallSettings(12, 10, 3);
    vdiOf();
    settings = test::smallSettings(40, 30, 5);
    CHECK(vdiOf() == first);
  }
}

TEST_CASE("a picture in the memory of another one is the same") {
  const auto decomposed = test::onOneRank("mixing", {24, 24, 24});
  VdiGenerator generator(device(), comm::Communicator::serial());
  generator.setBlocks(decomposed.mine);
  const auto volumeOf = [&](int width, int height) {
    return *generator.renderVolume(test::oblique(), test::threeHues(1.0),
                                   test::smallSettings(width, height, 5));
  };
  const auto vdi = generator.generate(test::oblique(), test::threeHues(1.0), test::smallSettings(40, 30, 5));
  VdiRenderer renderer(device());
  renderer.setVdi(*vdi);
  const auto same = [](const Image& a, const Image& b) {
    return a.width == b.width && a.height == b.height && a.rgba == b.rgba && a.depth == b.depth;
  };
  const Image volume = volumeOf(40, 30);
  const Image view = renderer.render(test::oblique(), 40, 30);
  for (const auto& [width, height] : {std::pair(60, 50), std::pair(40, 30), std::pair(9, 7)}) {
    INFO(width << " x " << height);
    volumeOf(width, height);
    CHECK(same(volumeOf(40, 30), volume));
    renderer.render(test::oblique().azimuth(20.0), width, height);
    CHECK(same(renderer.render(test::oblique(), 40, 30), view));
  }
}

TEST_CASE("VDIs set before the last one's upload has ended are rendered whole", "[threads]") {
  VdiGenerator generator(device(), comm::Communicator::serial());
  const Camera camera = test::oblique();
  std::vector<Vdi> vdis;
  for (const char* field : {"mixing", "sphere", "turbulence"}) {
    const auto decomposed = test::onOneRank(field, {32, 32, 32});
    generator.setBlocks(decomposed.mine);
    GenerateSettings settings = test::smallSettings(96 + 32 * static_cast<int>(vdis.size()), 80, 10);
    settings.precision = vdis.size() == 1 ? Precision::Full : Precision::Compact;
    vdis.push_back(*generator.generate(camera, test::threeHues(1.0), settings));
  }
  VdiRenderer busy(device());
  for (const Vdi& last : vdis) {
    VdiRenderer fresh(device());
    fresh.setVdi(last);
    for (const Vdi& vdi : vdis) busy.setVdi(vdi);
    busy.setVdi(last);
    CHECK(largestDifference(busy.render(camera.azimuth(15.0), 96, 80),
                            fresh.render(camera.azimuth(15.0), 96, 80)) == 0.0F);
  }
  VdiRenderer ended(device());
  ended.setVdi(vdis.front());  // without a render: its destructor waits
  CHECK(device()->validationMessages() == "");
}

TEST_CASE("frames of the same size reuse everything", "[threads]") {
  const auto decomposed = test::onOneRank("shells", {20, 20, 20}, {2, 2, 2});
  const GenerateSettings settings = test::smallSettings();
  VdiGenerator generator(device(), comm::Communicator::serial());
  generator.setBlocks(decomposed.mine);
  const auto first = generator.generate(test::oblique(), test::threeHues(1.0), settings);
  const std::uint64_t held = device()->allocatedBytes();
  for (int i = 0; i < 3; ++i) {
    generator.setBlocks(decomposed.mine);
    const auto again = generator.generate(test::oblique(), test::threeHues(1.0), settings);
    CHECK(*again == *first);
    CHECK(device()->allocatedBytes() == held);
  }
}
