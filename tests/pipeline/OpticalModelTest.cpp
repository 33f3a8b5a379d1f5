// Pictures of device, reference and VDIs compared with the optical model in double precision, with which they
// share no table, no samples and no code. This exposes their common errors.
#include "tests/Catch.h"
#include "tests/Devices.h"
#include "tests/pipeline/OpticalBounds.h"
#include "vdi/comm/GhostExchange.h"
#include "vdi/core/Flatten.h"
#include "vdi/pipeline/VdiGenerator.h"
#include "vdi/reference/Reference.h"

using namespace vdi;
using synthetic::Joint;
using test::Bound;
using test::checkPicture;
using test::device;

namespace {

/// Checks every way to make a picture.
void checkAll(const test::Stretch& stretch, Joint joint, bool parallel, bool someOnly) {
  const test::OpticalScene scene = test::opticalScene(stretch, joint);
  VdiGenerator generator(device(), comm::Communicator::serial());
  generator.setBlocks(scene.mine);
  const std::vector<Block> blocks = comm::exchangeGhosts(comm::Communicator::serial(), scene.mine);
  const Camera camera = test::lookingAt(parallel);
  std::size_t number = static_cast<std::size_t>(stretch.type);
  for (const test::NamedFunction& named : test::namedFunctions(stretch)) {
    if (someOnly && number++ % 8 != 0) continue;
    const GenerateSettings once = test::opticalSettings(1.0);
    const Image expected =
        reference::renderExactly(scene.whole, named.function, camera, once.width, once.height);
    REQUIRE(test::mostOpaque(expected) > 0.25F);
    for (const double rate : {automaticRate, 8.0}) {
      INFO(toString(stretch.type) << ", " << named.name << (joint == Joint::Cells ? ", cells" : "")
                                  << (parallel ? ", parallel" : "") << ", rate " << rate);
      const Bound bound = test::boundOf(*device(), rate, named.steep);
      const GenerateSettings settings = test::opticalSettings(rate);
      checkPicture(*generator.renderVolume(camera, named.function, settings), expected, named, bound);
      // Codes carry rounding errors over to the next supersegment.
      checkPicture(flatten(*generator.generate(camera, named.function, settings)), expected, named,
                   {bound.largest + 0.5, bound.mean + 0.1, bound.pixels});
      if (rate == 8.0 && !someOnly) {
        const reference::RayInputs inputs(generator.scene(), camera, named.function, settings);
        checkPicture(reference::renderVolume(inputs, blocks), expected, named, bound);
      }
    }
    const reference::RayInputs inputs(generator.scene(), camera, named.function, once);
    checkPicture(reference::renderVolume(inputs, blocks), expected, named,
                 test::boundOf(*device(), once.samplesPerVoxel, named.steep));
  }
}

}  // namespace

TEST_CASE("optical model: floats of a negative range, each transfer function", "[pictures]") {
  checkAll(test::stretches[6], Joint::SharedPoints, false, false);
}

TEST_CASE("optical model: all types of scalars", "[pictures]") {
  for (const test::Stretch& stretch : test::stretches) checkAll(stretch, Joint::SharedPoints, false, true);
}

TEST_CASE("optical model: parallel projection, and data of cells", "[long]") {
  checkAll(test::stretches[0], Joint::SharedPoints, true, true);
  checkAll(test::stretches[3], Joint::Cells, false, true);
  checkAll(test::stretches[7], Joint::Cells, true, true);
}

TEST_CASE("optical model: missing values of all types are clear, with all that is interpolated with them",
          "[pictures]") {
  const auto joint = GENERATE(Joint::SharedPoints, Joint::Cells);
  VdiGenerator generator(device(), comm::Communicator::serial());
  for (const test::Stretch& stretch : test::stretches) {
    const double fill = test::fills[static_cast<std::size_t>(stretch.type)];
    INFO(toString(stretch.type) << (joint == Joint::Cells ? ", cells" : ""));
    const test::NamedFunction named = test::namedFunctions(stretch)[0];
    const Camera camera = test::lookingAt(false);
    const GenerateSettings settings = test::opticalSettings(8.0);
    const test::OpticalScene scene =
        test::opticalScene(stretch, joint, glm::ivec3(2), synthetic::Layout::OnOneRank, 0, 1, fill);
    generator.setBlocks(scene.mine);
    CHECK(generator.scalarRange().min >= stretch.low);
    CHECK(generator.scalarRange().max <= stretch.high);
    const Image expected =
        reference::renderExactly(scene.whole, named.function, camera, settings.width, settings.height);
    const Image all = reference::renderExactly(test::opticalScene(stretch, joint).whole, named.function,
                                               camera, settings.width, settings.height);
    REQUIRE(test::offBetween(all, expected).largest > 30.0);
    // A sample at the edge of missing values is off by up to half of its length.
    const Bound bound{3.0, 0.3, 0.0};
    checkPicture(*generator.renderVolume(camera, named.function, settings), expected, named, bound);
    checkPicture(flatten(*generator.generate(camera, named.function, settings)), expected, named,
                 {bound.largest + 0.5, bound.mean + 0.1, bound.pixels});
    const std::vector<Block> blocks = comm::exchangeGhosts(comm::Communicator::serial(), scene.mine);
    const reference::RayInputs inputs(generator.scene(), camera, named.function, settings);
    checkPicture(reference::renderVolume(inputs, blocks), expected, named, bound);
  }
}
