// Pictures of several ranks compared with the optical model in double precision, which knows neither ranks
// nor blocks.
#include "tests/Catch.h"
#include "tests/Devices.h"
#include "tests/pipeline/OpticalBounds.h"
#include "vdi/core/Flatten.h"
#include "vdi/pipeline/VdiGenerator.h"

using namespace vdi;
using synthetic::Joint;
using synthetic::Layout;

TEST_CASE("optical model: several ranks", "[long]") {
  struct Case {
    std::size_t stretch;
    Joint joint;
    Layout layout;
    bool parallel;
  };
  const comm::Communicator world = comm::Communicator::world();
  VdiGenerator generator(test::device(), comm::Communicator::world());
  for (const Case& c : {Case{0, Joint::Cells, Layout::Random, false},
                        Case{6, Joint::SharedPoints, Layout::Interleaved, true}}) {
    const test::Stretch& stretch = test::stretches[c.stretch];
    const test::OpticalScene scene =
        test::opticalScene(stretch, c.joint, {3, 2, 2}, c.layout, world.rank(), world.size());
    generator.setBlocks(scene.mine);
    const Camera camera = test::lookingAt(c.parallel);
    // Pictures of one rank are compared for all functions.
    const std::vector<test::NamedFunction> functions = test::namedFunctions(stretch);
    for (std::size_t i = c.parallel ? 1 : 0; i < functions.size(); i += 6) {
      const test::NamedFunction& named = functions[i];
      Image expected;
      for (const double rate : {automaticRate, 8.0}) {
        INFO(toString(stretch.type) << ", " << named.name << ", rate " << rate);
        const GenerateSettings settings = test::opticalSettings(rate);
        if (world.rank() == 0 && expected.rgba.empty())
          expected =
              reference::renderExactly(scene.whole, named.function, camera, settings.width, settings.height);
        const test::Bound bound = test::boundOf(*test::device(), rate, named.steep);
        const auto volume = generator.renderVolume(camera, named.function, settings);
        const auto vdi = generator.generate(camera, named.function, settings);
        if (world.rank() != 0) continue;
        test::checkPicture(*volume, expected, named, bound);
        // Each rank rounds its codes, and compositing rounds the result once more.
        test::checkPicture(flatten(*vdi), expected, named,
                           {bound.largest + 1.0, bound.mean + 0.3, bound.pixels});
      }
    }
  }
}
