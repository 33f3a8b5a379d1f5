// The thread that makes a filter's next VDI, with functions in place of the generator: turns of a volume, and
// outputs that are taken, given up and dropped.
#include <atomic>
#include <chrono>
#include <memory>
#include <stdexcept>
#include <thread>

#include "plugin/VolumetricDepthImages/Filters/VDIPreparation.h"
#include "plugin/VolumetricDepthImages/Filters/VDIRetire.h"
#include "tests/Catch.h"

namespace {

using pv::Preparation;

std::shared_ptr<pv::Volume> volumeOfThisRank() {
  return std::make_shared<pv::Volume>(nullptr, pv::newIdentity(nullptr));
}

/// Makes an output `width` lists wide, in ten parts. Turns alone guard `made`, as they guard a generator.
Preparation::Make makesWidth(int width, int& made) {
  return [width, &made](pv::Volume&, const vdi::Progress& progress, vtkVDIImageData* output) {
    for (int part = 1; part <= 10; ++part) {
      if (!progress(0.1 * part)) throw std::runtime_error("given up");
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    output->SetDimensions(width, 1, 1);
    ++made;
  };
}

}  // namespace

TEST_CASE("preparations of one volume take turns, and the main thread gets their outputs") {
  const std::shared_ptr<pv::Volume> volume = volumeOfThisRank();
  int made = 0;
  Preparation first(volume, 1, makesWidth(3, made));
  Preparation second(volume, 2, makesWidth(5, made));
  int polls = 0;
  REQUIRE(second.wait([&] {
    const int percent = first.percent();
    CHECK((percent >= 0 && percent <= 100));
    ++polls;
  }) == Preparation::End::Good);
  CHECK(polls > 0);
  CHECK(first.isDone());
  REQUIRE(first.wait([] {}) == Preparation::End::Good);
  CHECK(made == 2);
  CHECK(first.output()->GetDimensions()[0] == 3);
  CHECK(second.output()->GetDimensions()[0] == 5);
  CHECK(second.percent() == 100);
}

TEST_CASE("a preparation that is given up, dropped or fails lets the next one begin") {
  const std::shared_ptr<pv::Volume> volume = volumeOfThisRank();
  int made = 0;
  for (int round = 0; round < 20; ++round) {
    Preparation working(volume, 1, makesWidth(3, made));
    auto waiting = std::make_unique<Preparation>(volume, 2, makesWidth(4, made));
    Preparation failing(volume, 3, [](pv::Volume&, const vdi::Progress&, vtkVDIImageData*) {
      throw std::runtime_error("no memory");
    });
    if (round % 2 == 0) working.giveUp();
    waiting.reset();
    CHECK(failing.wait([&] { working.giveUp(); }) == Preparation::End::Failed);
    CHECK(failing.percent() == -1);
    const Preparation::End end = working.wait([] {});
    CHECK((end == Preparation::End::GivenUp || end == Preparation::End::Good));
    pv::Turn turn(*volume);
    turn.await();
    ++made;
  }
  CHECK(made >= 20);
}

TEST_CASE("what is retired is destroyed by another thread, once") {
  std::atomic<int> destroyed = 0;
  for (int i = 0; i < 20; ++i) {
    pv::retire(std::shared_ptr<int>(new int(i), [&destroyed](const int* value) {
      delete value;
      ++destroyed;
    }));
  }
  for (int waited = 0; destroyed < 20 && waited < 5000; ++waited)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  CHECK(destroyed == 20);
}
