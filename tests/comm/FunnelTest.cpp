// Communication in a thread that may not call MPI: every rank runs every line.
#include "tests/Catch.h"
#include "vdi/comm/Funnel.h"

#include <array>
#include <atomic>
#include <cstring>
#include <exception>
#include <functional>
#include <span>
#include <thread>
#include <vector>

#include "vdi/comm/Communicator.h"
#include "vdi/comm/Operation.h"
#include "vdi/core/Error.h"

using namespace vdi;
using comm::Communicator;
using namespace std::chrono_literals;

namespace {

/// Runs `work` in a thread within a funnel that this thread serves, and calls `meanwhile` a few times in
/// between.
void carried(const std::function<void()>& work, const std::function<void(int)>& meanwhile) {
  comm::Funnel funnel;
  std::atomic<bool> done{false};
  std::exception_ptr error;
  std::jthread thread([&] {
    const comm::Funnel::Entry entry(funnel);
    try {
      work();
    } catch (...) {
      error = std::current_exception();
    }
    done = true;
  });
  for (int i = 0; i < 5; ++i) {
    funnel.serve(1ms);
    meanwhile(i);
  }
  while (!done) funnel.serve(20ms);
  thread.join();
  if (error) std::rethrow_exception(error);
}

/// The results of a sequence of operations of each kind, the same in any thread.
std::vector<std::uint64_t> told(const Communicator& world) {
  const auto rank = static_cast<std::uint64_t>(world.rank());
  const auto size = static_cast<std::uint64_t>(world.size());
  std::vector<std::uint64_t> all;
  const auto keep = [&](std::span<const std::uint64_t> words) {
    all.insert(all.end(), words.begin(), words.end());
  };
  const auto keepBytes = [&](std::span<const std::byte> bytes) {
    std::vector<std::uint64_t> words(bytes.size() / sizeof(std::uint64_t));
    if (!words.empty()) std::memcpy(words.data(), bytes.data(), bytes.size());
    keep(words);
  };
  world.barrier();
  std::array<std::uint64_t, 2> sums{rank, 1};
  world.allReduceSum(sums);
  keep(sums);
  std::vector<std::uint64_t> own(rank + 1, rank);
  std::vector<std::byte> rootsBytes(24, std::byte{static_cast<unsigned char>(7 + rank)});
  keepBytes(world.broadcast(rootsBytes, world.size() - 1));
  const auto bytes = std::as_bytes(std::span(own));
  keepBytes(world.allGather(bytes, sizeof(std::uint64_t)).bytes);
  keepBytes(world.gather(bytes, sizeof(std::uint64_t), 0).bytes);
  keep(world.allGatherWords(own = {rank, 5}));
  std::vector<std::uint64_t> toEach(size, rank);
  std::vector<std::uint64_t> fromEach(toEach.size());
  world.allToAllWords(toEach, fromEach);
  keep(fromEach);
  std::vector<std::uint64_t> counts(size, 1);
  keepBytes(world.allToAll(std::as_bytes(std::span(toEach)), counts, sizeof(std::uint64_t)).bytes);
  // Only the first and the last rank exchange messages, which are large; the others go on at once.
  if (size > 1 && (rank == 0 || rank == size - 1)) {
    const int other = rank == 0 ? world.size() - 1 : 0;
    comm::Messages messages(world);
    std::vector<std::uint64_t> much(200000, rank);
    std::vector<std::uint64_t> received(much.size());
    for (const auto& each : {much, received}) messages.reserve(std::as_bytes(std::span(each)).size());
    messages.receive(other, std::as_writable_bytes(std::span(received)));
    if (rank == 0) std::this_thread::sleep_for(20ms);
    messages.send(other, std::as_bytes(std::span(much)));
    messages.wait();
    keep(received);
  }
  world.requireEqual(42, "what is the same");
  keep(world.gatherTogether([&] { return rank; }));
  return all;
}

}  // namespace

TEST_CASE("a carried thread gets the same results, whatever other threads do meanwhile") {
  const Communicator world = Communicator::world();
  const Communicator others = Communicator::world();
  const std::vector<std::uint64_t> expected = told(world);
  for (int round = 0; round < 3; ++round) {
    std::vector<std::uint64_t> heard;
    std::vector<std::uint64_t> sums;
    carried([&] { heard = told(world); },
            [&](int i) {
              if (world.rank() == i % world.size()) std::this_thread::sleep_for(10ms);
              std::array<std::uint64_t, 1> one{1};
              others.allReduceSum(one);  // in the thread that serves
              sums.push_back(one[0]);
            });
    CHECK(heard == expected);
    CHECK(sums == std::vector<std::uint64_t>(5, static_cast<std::uint64_t>(world.size())));
  }
}

TEST_CASE("a rank that fails in a carried thread makes all fail") {
  const Communicator world = Communicator::world();
  const int last = world.size() - 1;
  ErrorCode code = ErrorCode::Cancelled;
  try {
    carried(
        [&] {
          world.together([&] {
            if (world.rank() == last) throw Error(ErrorCode::Io, "no");
          });
        },
        [](int) {});
  } catch (const Error& error) {
    code = error.code();
  }
  CHECK(code == (world.rank() == last ? ErrorCode::Io : ErrorCode::RemoteRank));
}

TEST_CASE("a carried thread gets the exception of an operation that cannot begin") {
  const Communicator world = Communicator::world();
  ErrorCode code = ErrorCode::Cancelled;
  std::vector<std::uint64_t> heard;
  const auto work = [&] {
    const comm::Operation failing{[](std::vector<MPI_Request>&) -> int {
      throw Error(ErrorCode::OutOfMemory, "no room for a message");
    }};
    try {
      failing.carry("MPI_Isend");
    } catch (const Error& error) {
      code = error.code();
    }
    heard = told(world);  // the funnel still carries operations
  };
  carried(work, [](int) {});
  CHECK(code == ErrorCode::OutOfMemory);
  CHECK(heard == told(world));
}
