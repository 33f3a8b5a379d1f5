// Results that several threads make are taken in order, and no more of them are made ahead than allowed.
#include "vdi/core/InOrder.h"

#include <atomic>
#include <chrono>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "tests/Catch.h"

using namespace vdi;

TEST_CASE("results are taken in order, not too many ahead") {
  const std::size_t count = GENERATE(0, 1, 2, 5, 1000);
  const std::size_t ahead = GENERATE(0, 1, 3, 64);
  std::atomic<std::size_t> begun{0};
  std::size_t taken = 0;
  const auto makeWorker = [&] {
    return [&, scratch = std::vector<int>()](std::size_t index) mutable {
      ++begun;
      scratch.assign(index % 7, 1);  // each thread has its own
      if (index % 50 == 3) std::this_thread::sleep_for(std::chrono::milliseconds(1));
      return std::make_unique<std::size_t>(index * index + scratch.size());
    };
  };
  inOrder(count, ahead, makeWorker, [&](std::unique_ptr<std::size_t> result) {
    CHECK(*result == taken * taken + taken % 7);
    ++taken;
    CHECK(begun <= taken + std::max<std::size_t>(ahead, 1));
  });
  CHECK(taken == count);
  CHECK(begun == count);
}

TEST_CASE("a failure ends the work, wherever it happens") {
  constexpr std::size_t count = 1000;
  const bool inMake = GENERATE(false, true);
  std::size_t taken = 0;
  const auto makeWorker = [&] {
    return [&](std::size_t index) {
      if (inMake && index == 300) throw std::runtime_error("made");
      return index;
    };
  };
  const auto take = [&](std::size_t index) {
    CHECK(index == taken);
    if (!inMake && index == 300) throw std::runtime_error("taken");
    ++taken;
  };
  std::string text;
  try {
    inOrder(count, 16, makeWorker, take);
  } catch (const std::runtime_error& error) {
    text = error.what();
  }
  CHECK(text == (inMake ? "made" : "taken"));
  CHECK(taken <= 300);
}
