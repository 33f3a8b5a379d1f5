// Blend modes other than composite: the picture of several ranks is that of one.
#include "tests/Catch.h"
#include "tests/Devices.h"
#include "tests/OpticalScenes.h"
#include "tests/Scenes.h"
#include "vdi/pipeline/VdiGenerator.h"

using namespace vdi;
using synthetic::Layout;

TEST_CASE("blending: several ranks with scattered blocks") {
  const comm::Communicator world = comm::Communicator::world();
  VdiGenerator generator(test::device(), comm::Communicator::world());
  VdiGenerator alone(test::device(), comm::Communicator::serial());
  TransferFunction function = test::threeHues(1.0);
  function.opacities = {{0.0, 0.8}, {0.5, 0.2}, {1.0, 0.9}};
  for (const Layout layout : {Layout::Random, Layout::Interleaved}) {
    const bool shaded = layout == Layout::Random;
    const auto scattered = test::dealt(world, "turbulence", {34, 30, 28}, {4, 3, 3}, layout);
    const auto whole = test::onOneRank("turbulence", {34, 30, 28});
    generator.setBlocks(scattered.mine);
    alone.setBlocks(whole.mine);
    for (const Blending& blending : {Blending{BlendMode::Maximum, {}}, Blending{BlendMode::Minimum, {}},
                                     Blending{BlendMode::Isosurface, {0.35, 0.5, 0.65}}}) {
      INFO(toString(blending.mode));
      GenerateSettings settings = test::smallSettings(61, 47);
      settings.blending = blending;
      settings.shading.on = shaded;
      const Camera camera = test::oblique(!shaded);
      const auto together = generator.renderVolume(camera, function, settings);
      CHECK(together.has_value() == (world.rank() == 0));
      if (!together) continue;
      const auto expected = alone.renderVolume(camera, function, settings);
      REQUIRE(test::mostOpaque(*expected) > 0.5F);
      const test::Off off = test::offBetween(*together, *expected);
      CHECK(off.mean < 0.1);
      // Rounding decides whether a ray that just touches a surface crosses it.
      CHECK(off.pixels <= (blending.mode == BlendMode::Isosurface ? 0.002 : 0.0));
    }
  }
}

TEST_CASE("blending: ranks that have nothing, and a mode that differs") {
  const comm::Communicator world = comm::Communicator::world();
  VdiGenerator generator(test::device(), comm::Communicator::world());
  const auto whole = test::dealt(world, "turbulence", {12, 12, 12}, {1, 1, 1}, Layout::OnOneRank);
  generator.setBlocks(whole.mine);
  GenerateSettings settings = test::smallSettings(20, 16);
  for (const BlendMode mode : {BlendMode::Maximum, BlendMode::Minimum, BlendMode::Isosurface}) {
    settings.blending = {mode, {}};
    if (mode == BlendMode::Isosurface) settings.blending.isovalues = {0.5};
    TransferFunction function = test::threeHues(1.0);
    function.opacities = {{0.0, 0.5}};
    const auto image = generator.renderVolume(test::oblique(), function, settings);
    if (image) CHECK(test::mostOpaque(*image) >= 0.5F);
  }
  if (world.size() == 1) return;
  settings.blending = {world.rank() == 0 ? BlendMode::Maximum : BlendMode::Minimum, {}};
  CHECK_THROWS_WITH(generator.renderVolume(test::oblique(), test::threeHues(1.0), settings),
                    vdi::test::ContainsSubstring("blend mode"));
}
