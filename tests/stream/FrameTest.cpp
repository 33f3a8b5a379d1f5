// The levels of a frame, made from a VDI and from its file.

#include "tests/Catch.h"
#include "tests/io/Samples.h"
#include "vdi/core/Thinning.h"
#include "vdi/io/VdiFile.h"
#include "vdi/stream/Frame.h"

using namespace vdi;
using stream::FramePtr;

TEST_CASE("each coarse level is the coarsest that is worth less than a MiB, or a coarser one follows") {
  const std::uint64_t mebibyte = std::uint64_t{1} << 20;
  CHECK(stream::coarseFactorsOf(mebibyte - 1).empty());
  CHECK(stream::coarseFactorsOf(mebibyte) == std::vector{3});
  CHECK(stream::coarseFactorsOf(9 * mebibyte - 1) == std::vector{3});
  CHECK(stream::coarseFactorsOf(9 * mebibyte) == std::vector{5, 3});
  CHECK(stream::coarseFactorsOf(25 * mebibyte - 1) == std::vector{5, 3});
  CHECK(stream::coarseFactorsOf(25 * mebibyte) == std::vector{9, 5, 3});
  CHECK(stream::coarseFactorsOf(1000 * mebibyte) == std::vector{9, 5, 3});
}

TEST_CASE("a frame's levels are its VDI with fewer lists") {
  const auto [width, height] = GENERATE(table<int, int>({{40, 30}, {230, 120}, {700, 500}}));
  Vdi vdi = test::noisyVdi(width, height, 8);
  vdi.timeStep = 12;
  vdi.time = 0.5;
  const std::vector<std::byte> file = io::encode(vdi);
  const std::vector<int> factors = stream::coarseFactorsOf(io::decodeInfo(file).expandedBytes);
  const stream::Clock::time_point made = stream::Clock::now();
  std::vector<FramePtr> encoded;
  stream::encodeFrame(
      vdi, 7, made, [&](FramePtr frame) { encoded.push_back(std::move(frame)); }, [] { return true; });
  REQUIRE(encoded.size() == (factors.empty() ? 1 : 2));
  CHECK(encoded.front()->levels.size() == std::max<std::size_t>(factors.size(), 1));
  FramePtr passed;
  stream::passFrame(file, 7, made, [&](FramePtr frame) { passed = std::move(frame); });
  REQUIRE(passed);
  for (const FramePtr& frame : {encoded.back(), passed}) {
    CHECK(frame->id == 7);
    CHECK(frame->step == 12);
    CHECK(frame->time == 0.5);
    CHECK(frame->made == made);
    CHECK(frame->levelCount == factors.size() + 1);
    REQUIRE(frame->levels.size() == frame->levelCount);
    for (std::size_t i = 0; i < factors.size(); ++i) {
      const Vdi coarse = thinned(vdi, factors[i]);
      CHECK(frame->levels[i]->bytes == io::encode(coarse));
      CHECK(frame->levels[i]->width == coarse.width);
      CHECK(frame->levels[i]->height == coarse.height);
    }
    CHECK(frame->levels.back()->bytes == file);
    CHECK(frame->levels.back()->width == width);
  }
}

TEST_CASE("the whole VDI is given up where the next one waits") {
  const int chunks = GENERATE(0, 3);  // encoded before the next VDI comes
  int calls = 0;
  int asked = 0;
  stream::encodeFrame(
      test::noisyVdi(230, 120, 8), 0, stream::Clock::now(),
      [&](const FramePtr& frame) {
        ++calls;
        CHECK(frame->levels.size() == 1);
        CHECK(asked == 0);
      },
      [&] { return asked++ < chunks; });
  CHECK(calls == 1);
  CHECK(asked == chunks + 1);
}
