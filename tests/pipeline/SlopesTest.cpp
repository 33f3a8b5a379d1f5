// Slopes of a VDI's faces: the device compared with the reference.
#include <algorithm>
#include <cstdlib>

#include "tests/Catch.h"
#include "tests/Devices.h"
#include "tests/Scenes.h"
#include "vdi/gpu/Commands.h"
#include "vdi/pipeline/VdiGenerator.h"
#include "vdi/pipeline/VdiLoader.h"
#include "vdi/reference/Slopes.h"

using namespace vdi;
using reference::Slopes;

TEST_CASE("slopes of faces: the device's are the reference's", "[pictures]") {
  const bool parallel = GENERATE(false, true);
  const auto decomposed = test::onOneRank("shells", {30, 26, 28});
  VdiGenerator generator(test::device(), comm::Communicator::serial());
  generator.setBlocks(decomposed.mine);
  GenerateSettings settings = test::smallSettings(61, 43, 8);
  settings.precision = GENERATE(Precision::Compact, Precision::Full);
  const auto vdi = generator.generate(test::oblique(parallel), test::threeHues(1.0), settings);
  detail::LoadedVdi loaded;
  detail::VdiLoader loader(test::device());
  loader.load(*vdi, loaded, detail::VdiLoader::Kind::DuringRenders);
  const std::uint64_t bytes = vdi->supersegmentCount() * sizeof(Slopes);
  gpu::Buffer readback(test::device(), bytes, gpu::MemoryKind::Readback);
  gpu::Commands commands(test::device());
  gpu::ExpandPass expand(test::device());
  commands.begin();
  detail::recordLeaning(commands, expand, test::device(), loaded);
  commands.copy(loaded.slopes, 0, readback, 0, bytes);
  commands.submitAndWait();
  const auto seen = readback.mappedAs<Slopes>().first(vdi->supersegmentCount());
  const shared::DepthRange depths = loaded.depths();
  const std::vector<Slopes> expected = reference::slopesOf(
      vdi->expandedLists(), vdi->view(), reference::slopeUnitOf(vdi->view(), depths.nearest, depths.farthest),
      reference::listBoxOf(*vdi, depths.farthest));
  std::size_t leaning = 0;
  std::size_t different = 0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const int change = std::max(
        {std::abs(seen[i].frontX - expected[i].frontX), std::abs(seen[i].frontY - expected[i].frontY),
         std::abs(seen[i].backX - expected[i].backX), std::abs(seen[i].backY - expected[i].backY)});
    different += change > 1 ? 1 : 0;
    leaning += expected[i] == Slopes{} ? 0 : 1;
  }
  INFO("parallel " << parallel << ", " << toString(settings.precision));
  CHECK(leaning > expected.size() / 10);
  CHECK(different <= expected.size() / 1000);
}
