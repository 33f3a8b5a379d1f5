// Blocks of several levels on any number of ranks, compared with one uniform lattice of points.
#include <cmath>
#include <cstdio>
#include <functional>
#include <optional>

#include "tests/Catch.h"
#include "tests/Devices.h"
#include "tests/Scenes.h"
#include "tests/pipeline/PictureDifference.h"
#include "vdi/core/Error.h"
#include "vdi/core/Flatten.h"
#include "vdi/pipeline/VdiGenerator.h"

using namespace vdi;
using test::device;
using test::Difference;
using test::differenceOf;
using test::slanted;

namespace {

using Field = std::function<double(const glm::dvec3&)>;

double smooth(const glm::dvec3& p) {
  return 0.5 + 0.25 * std::sin(5.0 * p.x + 2.0 * p.y) + 0.25 * std::cos(4.0 * p.z - 3.0 * p.x);
}

/// Values from `box.lo` on, of cells or points. Cells have ghost layers, a coarsest cell thick, at the faces
/// of the unit cube, where no neighbour can provide them.
Block blockIn(bool cells, const Box& box, double spacing, const Field& field) {
  GhostLayers ghosts;
  glm::dvec3 origin = box.lo;
  glm::ivec3 dims(glm::round(box.size() / spacing));
  for (int axis = 0; axis < 3; ++axis) {
    if (!cells) {
      ++dims[axis];
      continue;
    }
    const int layers = static_cast<int>(std::round(1.0 / 12 / spacing));
    ghosts.lo[axis] = box.lo[axis] < 1e-9 ? layers : 0;
    ghosts.hi[axis] = box.hi[axis] > 1.0 - 1e-9 ? layers : 0;
    origin[axis] -= ghosts.lo[axis] * spacing;
    dims[axis] += ghosts.lo[axis] + ghosts.hi[axis];
  }
  Block block = cells
                    ? Block::fromCells(dims, origin, glm::dvec3(spacing), ScalarType::F32, nullptr, ghosts)
                    : Block::fromPoints(dims, origin, glm::dvec3(spacing), ScalarType::F32, nullptr, ghosts);
  auto values = std::make_shared<std::vector<float>>();
  for (int z = 0; z < dims.z; ++z) {
    for (int y = 0; y < dims.y; ++y) {
      for (int x = 0; x < dims.x; ++x)
        values->push_back(static_cast<float>(field(block.origin + spacing * glm::dvec3(x, y, z))));
    }
  }
  block.data = values->data();
  block.keepAlive = values;
  return block;
}

/// Opaque in bands that are 4 % of [0, 1] wide, transparent elsewhere.
TransferFunction bands() {
  TransferFunction function;
  function.colors = {{0.0, {0.2, 0.4, 0.9}}, {0.5, {0.9, 0.9, 0.3}}, {1.0, {0.9, 0.2, 0.1}}};
  function.opacities = {{0.0, 0.0}};
  for (const double center : {0.25, 0.5, 0.7}) {
    function.opacities.push_back({center - 0.02, 0.0});
    function.opacities.push_back({center, 0.9});
    function.opacities.push_back({center + 0.02, 0.0});
  }
  function.unitDistance = 0.05;
  return function;
}

std::vector<Block> decomposed(const std::vector<Block>& all, const comm::Communicator& world) {
  std::vector<Block> mine;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (static_cast<int>((i + i / 4) % static_cast<std::size_t>(world.size())) == world.rank())
      mine.push_back(all[i]);
  }
  return mine;
}

/// Eighths of the unit cube, of three levels; the finest has a spacing of 1 / 48.
std::vector<Block> sideBySide(bool cells, const Field& field) {
  std::vector<Block> all;
  const double spacings[] = {1.0 / 12, 1.0 / 48, 1.0 / 24, 1.0 / 12, 1.0 / 48, 1.0 / 24, 1.0 / 12, 1.0 / 24};
  for (int i = 0; i < 8; ++i) {
    const glm::dvec3 lo = 0.5 * glm::dvec3(i % 2, i / 2 % 2, i / 4);
    all.push_back(blockIn(cells, {lo, lo + 0.5}, spacings[i], field));
  }
  return all;
}

/// A coarse cube with finer boxes over it, `ratio` and ratio^2 times as fine; the values that they cover are
/// far off.
std::vector<Block> overEachOther(bool cells, const Field& field, int ratio) {
  const double finest = 1.0 / 48;
  const Box middle{glm::dvec3(1.0 / 3), glm::dvec3(2.0 / 3)};
  const Box inner{glm::dvec3(5.0 / 12), glm::dvec3(7.0 / 12)};
  const auto covered = [&field](const Box& by) {
    return [field, by](const glm::dvec3& p) {
      const bool inside =
          glm::all(glm::greaterThan(p, by.lo - 1e-9)) && glm::all(glm::lessThan(p, by.hi + 1e-9));
      return inside ? 0.5 : field(p);  // in a band
    };
  };
  std::vector<Block> all;
  if (ratio == 2) {
    all.push_back(blockIn(cells, {glm::dvec3(0.0), glm::dvec3(1.0)}, 4 * finest, covered(middle)));
    all.push_back(blockIn(cells, middle, 2 * finest, covered(inner)));
    all.push_back(blockIn(cells, inner, finest, field));
  } else {
    all.push_back(blockIn(cells, {glm::dvec3(0.0), glm::dvec3(1.0)}, 4 * finest, covered(middle)));
    all.push_back(blockIn(cells, middle, finest, field));
  }
  return all;
}

GenerateSettings settings() {
  return test::smallSettings(96, 72, 20);
}

/// The picture of the uniform lattice, on the first rank.
std::optional<Image> truthOf(const Field& field) {
  if (comm::Communicator::world().rank() != 0) return std::nullopt;
  VdiGenerator one(device(), comm::Communicator::serial());
  one.setBlocks({blockIn(false, {glm::dvec3(0.0), glm::dvec3(1.0)}, 1.0 / 48, field)});
  return one.renderVolume(test::oblique(), bands(), settings());
}

}  // namespace

TEST_CASE("three levels, side by side and over each other: the picture of a uniform lattice") {
  const comm::Communicator world = comm::Communicator::world();
  const std::optional<Image> truth = truthOf(slanted);
  VdiGenerator many(device(), comm::Communicator::world());
  for (const bool cells : {false, true}) {
    for (const int ratio : {0, 2, 4}) {
      INFO((cells ? "cells" : "points") << ", overlapping with ratio " << ratio);
      const auto all = ratio == 0 ? sideBySide(cells, slanted) : overEachOther(cells, slanted, ratio);
      many.setBlocks(decomposed(all, world));
      const auto volume = many.renderVolume(test::oblique(), bands(), settings());
      const auto vdi = many.generate(test::oblique(), bands(), settings());
      if (!volume) continue;
      const Difference ofVolume = differenceOf(*volume, *truth);
      const Difference ofVdi = differenceOf(flatten(*vdi), *truth);
      std::printf("%d ranks, %s, ratio %d: off by %.2f of 255 at most, the VDI by %.2f\n", world.size(),
                  cells ? "cells" : "points", ratio, ofVolume.worst, ofVdi.worst);
      CHECK(ofVolume.worst < 2.0);
      CHECK(ofVdi.worst < 2.0);
    }
  }
}

TEST_CASE("a curved field: no worse than the coarsest level alone, on any number of ranks") {
  const comm::Communicator world = comm::Communicator::world();
  const std::optional<Image> truth = truthOf(smooth);
  VdiGenerator many(device(), comm::Communicator::world());
  VdiGenerator one(device(), comm::Communicator::serial());
  for (const bool cells : {false, true}) {
    INFO((cells ? "cells" : "points"));
    const auto all = sideBySide(cells, smooth);
    many.setBlocks(decomposed(all, world));
    const auto volume = many.renderVolume(test::oblique(), bands(), settings());
    if (!volume) continue;
    one.setBlocks(all);
    CHECK(differenceOf(*volume, *one.renderVolume(test::oblique(), bands(), settings())).worst < 1.0);
    one.setBlocks({blockIn(cells, {glm::dvec3(0.0), glm::dvec3(1.0)}, 1.0 / 12, smooth)});
    GenerateSettings fine = settings();
    fine.samplesPerVoxel = 4.0;  // the same number as the others
    const auto coarse = one.renderVolume(test::oblique(), bands(), fine);
    const double share = differenceOf(*volume, *truth).wrongShare;
    const double coarseShare = differenceOf(*coarse, *truth).wrongShare;
    std::printf(
        "%d ranks, %s, curved: %.2f %% of the object's pixels off by more than 16, coarsest %.2f %%\n",
        world.size(), cells ? "cells" : "points", 100.0 * share, 100.0 * coarseShare);
    CHECK(share < coarseShare);
  }
}

TEST_CASE("blocks of one level that overlap between ranks: refused on all, and the next ones are shown") {
  const comm::Communicator world = comm::Communicator::world();
  VdiGenerator many(device(), comm::Communicator::world());
  const bool fill = GENERATE(true, false);
  const Block block = blockIn(false, {glm::dvec3(0.0), glm::dvec3(1.0)}, 1.0 / 12, slanted);
  Block shifted = block;
  shifted.origin.x += 0.5;
  shifted.owned.lo.x += 0.5;
  shifted.owned.hi.x += 0.5;
  try {
    many.setBlocks(decomposed({block, shifted}, world), fill);
    FAIL("nothing was thrown");
  } catch (const Error& error) {
    CHECK(error.code() == ErrorCode::InvalidArgument);
    CHECK_THAT(error.what(),
               vdi::test::ContainsSubstring("block 0 of rank 0") && vdi::test::ContainsSubstring("overlap"));
  }
  CHECK_NOTHROW(many.setBlocks(decomposed({block}, world), fill));
}

TEST_CASE("large blocks, whose values a process with one core lets the device copy, get their patches") {
  const comm::Communicator world = comm::Communicator::world();
  // Doubles are always staged. The coarse block takes 2 MiB, and it is partly covered.
  const double spacing = 1.0 / 80;
  const Box middle{glm::dvec3(0.25), glm::dvec3(0.75)};
  const auto covered = [&middle](const glm::dvec3& p) {
    return glm::all(glm::lessThan(glm::abs(p - middle.center()), glm::dvec3(0.2501))) ? 0.5 : smooth(p);
  };
  std::vector<Block> floats{blockIn(true, {glm::dvec3(0.0), glm::dvec3(1.0)}, spacing, covered),
                            blockIn(true, middle, spacing / 2, smooth),
                            blockIn(true, {{1.0, 0.0, 0.0}, {2.0, 1.0, 1.0}}, spacing, smooth)};
  std::vector<Block> doubles = floats;
  for (Block& block : doubles) {
    const auto* from = static_cast<const float*>(block.data);
    const auto values = std::make_shared<std::vector<double>>(from, from + block.valueCount());
    block.type = ScalarType::F64;
    block.data = values->data();
    block.keepAlive = values;
  }
  VdiGenerator many(device(), comm::Communicator::world());
  many.setBlocks(decomposed(floats, world));
  const auto ofFloats = many.renderVolume(test::oblique(), bands(), settings());
  many.setBlocks(decomposed(doubles, world));
  const auto ofDoubles = many.renderVolume(test::oblique(), bands(), settings());
  if (ofFloats) CHECK(differenceOf(*ofFloats, *ofDoubles).worst < 1.0);
  CHECK(device()->validationMessages() == "");
}
