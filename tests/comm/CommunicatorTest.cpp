// Tests the communicator on any number of ranks. Every rank runs every line.
#include <mpi.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>
#include <functional>
#include <new>
#include <span>
#include <string>
#include <vector>

#include "tests/Catch.h"
#include "tests/Thrown.h"
#include "vdi/comm/Communicator.h"
#include "vdi/core/Error.h"

using namespace vdi;
using comm::Communicator;
using test::Thrown;
using test::thrownBy;

namespace {

/// An element that identifies its sender, its receiver and itself.
struct Parcel {
  std::int32_t from;
  std::int32_t to;
  std::int32_t index;
  bool operator==(const Parcel&) const = default;
};

/// The number of parcels from one rank to another: irregular, and 0 for some pairs.
std::uint64_t parcelCount(int from, int to) {
  return static_cast<std::uint64_t>((from * 7 + to * 3) % 5);
}

template <typename T>
std::span<const std::byte> bytesOf(const std::vector<T>& values) {
  return std::as_bytes(std::span(values));
}

template <typename T>
std::vector<T> valuesOf(std::span<const std::byte> bytes) {
  std::vector<T> values(bytes.size() / sizeof(T));
  if (!values.empty()) std::memcpy(values.data(), bytes.data(), bytes.size());
  return values;
}

/// Address space without memory: a span of any length that a test needs, but must not touch.
class Unbacked {
 public:
  explicit Unbacked(std::size_t bytes)
      : bytes_(bytes),
        data_(::mmap(nullptr, bytes, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0)) {
    if (data_ == MAP_FAILED) throw std::bad_alloc();
  }
  ~Unbacked() { ::munmap(data_, bytes_); }
  Unbacked(const Unbacked&) = delete;
  Unbacked& operator=(const Unbacked&) = delete;
  std::span<const std::byte> span() const { return {static_cast<const std::byte*>(data_), bytes_}; }

 private:
  std::size_t bytes_;
  void* data_;
};

}  // namespace

TEST_CASE("rank, size and local rank are MPI's") {
  const Communicator world = Communicator::world();
  int rank = -1;
  int size = -1;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Comm_size(MPI_COMM_WORLD, &size);
  CHECK(world.rank() == rank);
  CHECK(world.size() == size);
  // The ranks before this one with the same name of the processor
  std::array<char, MPI_MAX_PROCESSOR_NAME> name{};
  int length = 0;
  MPI_Get_processor_name(name.data(), &length);
  std::vector<std::array<char, MPI_MAX_PROCESSOR_NAME>> names(static_cast<std::size_t>(size));
  MPI_Allgather(name.data(), MPI_MAX_PROCESSOR_NAME, MPI_CHAR, names.data(), MPI_MAX_PROCESSOR_NAME, MPI_CHAR,
                MPI_COMM_WORLD);
  CHECK(world.localRank() == std::count(names.begin(), names.begin() + rank, name));
}

TEST_CASE("a communicator of one rank, without MPI") {
  const Communicator alone = Communicator::serial();
  CHECK(alone.rank() == 0);
  CHECK(alone.size() == 1);
  CHECK(alone.localRank() == 0);
  alone.barrier();
  std::vector<double> values{3.0, -1.0};
  alone.allReduceMin(values);
  alone.allReduceSum(values);
  CHECK(values == std::vector<double>{3.0, -1.0});
  const std::vector<std::uint32_t> data{1, 2, 3};
  CHECK(valuesOf<std::uint32_t>(alone.allGather(bytesOf(data), 4).of(0)) == data);
  CHECK(valuesOf<std::uint32_t>(alone.gather(bytesOf(data), 4, 0).of(0)) == data);
  CHECK(valuesOf<std::uint32_t>(alone.allToAll(bytesOf(data), std::vector<std::uint64_t>{3}, 4).of(0)) ==
        data);
  CHECK_NOTHROW(alone.requireEqual(5, "x"));
  CHECK_NOTHROW(alone.together([] {}));
  CHECK_THROWS_AS(alone.together([] { throw std::out_of_range("mine"); }), std::out_of_range);
}

TEST_CASE("no communicator can be made of MPI_COMM_NULL") {
  const Thrown thrown = thrownBy([] { Communicator::fromMpi(MPI_Comm_c2f(MPI_COMM_NULL)); });
  CHECK(thrown.code == ErrorCode::InvalidArgument);
}

TEST_CASE("a part of the ranks makes a communicator of its own; it can be moved") {
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Comm half = MPI_COMM_NULL;
  MPI_Comm_split(MPI_COMM_WORLD, rank % 2, -rank, &half);
  Communicator first = Communicator::fromMpi(MPI_Comm_c2f(half));
  MPI_Comm_free(&half);  // the communicator has a duplicate
  Communicator mine = Communicator::serial();
  mine = std::move(first);
  std::vector<double> sum{1.0, static_cast<double>(rank % 2)};
  mine.allReduceSum(sum);
  CHECK(sum[0] == mine.size());
  CHECK(sum[1] == mine.size() * (rank % 2));
  CHECK(mine.rank() < mine.size());
}

TEST_CASE("reductions, element by element") {
  const Communicator world = Communicator::world();
  const double r = world.rank();
  const double last = world.size() - 1;
  std::vector<double> low{r, -r, 7.0};
  world.allReduceMin(low);
  CHECK(low == std::vector<double>{0.0, -last, 7.0});
  std::vector<double> high{r, -r, 7.0};
  world.allReduceMax(high);
  CHECK(high == std::vector<double>{last, 0.0, 7.0});
  std::vector<double> sum{r, 1.0};
  world.allReduceSum(sum);
  CHECK(sum == std::vector<double>{last * (last + 1.0) / 2.0, last + 1.0});
  std::vector<std::uint64_t> big{1ULL << 60, static_cast<std::uint64_t>(world.rank())};
  world.allReduceMax(big);
  CHECK(big == std::vector<std::uint64_t>{1ULL << 60, static_cast<std::uint64_t>(last)});
  std::vector<std::uint64_t> count{(1ULL << 53) + 1};  // no double represents this
  world.allReduceSum(count);
  CHECK(count[0] == ((1ULL << 53) + 1) * static_cast<std::uint64_t>(world.size()));
  world.allReduceSum(std::span<double>());
}

TEST_CASE("broadcast takes size and bytes from the root, whoever it is") {
  const Communicator world = Communicator::world();
  for (int root = 0; root < world.size(); ++root) {
    const std::vector<std::byte> sent(static_cast<std::size_t>(root * 1000),
                                      static_cast<std::byte>(root + 1));
    const std::vector<std::byte> other(17, std::byte{99});
    CHECK(world.broadcast(world.rank() == root ? sent : other, root) == sent);
  }
}

TEST_CASE("broadcastText calls its work only on the root") {
  const Communicator world = Communicator::world();
  for (int root = 0; root < world.size(); ++root) {
    const auto text = [&] {
      CHECK(world.rank() == root);
      return std::string(static_cast<std::size_t>(root), '-') + '\0' + "end";
    };
    const std::string sent = world.broadcastText(text, root);
    CHECK(sent.size() == static_cast<std::size_t>(root) + 4);
    CHECK(sent.ends_with("end"));
    CHECK(world.broadcastText([] { return std::string(); }, root).empty());
    const auto failing = []() -> std::string { throw Error(ErrorCode::Io, "no such text"); };
    CHECK_THROWS_WITH(world.broadcastText(failing, root), vdi::test::ContainsSubstring("no such text"));
  }
}

TEST_CASE("gather and allGather keep rank order and lengths, empty ones included") {
  const Communicator world = Communicator::world();
  const auto partOf = [](int rank) {
    return std::vector<Parcel>(static_cast<std::size_t>(rank * 5 % 4), Parcel{rank, rank * rank, -rank});
  };
  const std::vector<Parcel> mine = partOf(world.rank());
  const comm::Gathered everywhere = world.allGather(bytesOf(mine), sizeof(Parcel));
  REQUIRE(everywhere.offsets.size() == static_cast<std::size_t>(world.size()) + 1);
  for (int r = 0; r < world.size(); ++r) CHECK(valuesOf<Parcel>(everywhere.of(r)) == partOf(r));
  for (int root = 0; root < world.size(); ++root) {
    const comm::Gathered atRoot = world.gather(bytesOf(mine), sizeof(Parcel), root);
    CHECK(atRoot.bytes == (world.rank() == root ? everywhere.bytes : std::vector<std::byte>()));
    CHECK(atRoot.offsets == (world.rank() == root ? everywhere.offsets : std::vector<std::uint64_t>()));
  }
}

TEST_CASE("allToAll delivers each parcel to its rank, in order") {
  const Communicator world = Communicator::world();
  const int me = world.rank();
  std::vector<std::uint64_t> counts;
  std::vector<Parcel> parcels;
  for (int to = 0; to < world.size(); ++to) {
    counts.push_back(parcelCount(me, to));
    for (std::uint64_t i = 0; i < counts.back(); ++i)
      parcels.push_back({me, to, static_cast<std::int32_t>(i)});
  }
  const comm::Gathered received = world.allToAll(bytesOf(parcels), counts, sizeof(Parcel));
  for (int from = 0; from < world.size(); ++from) {
    const auto got = valuesOf<Parcel>(received.of(from));
    REQUIRE(got.size() == parcelCount(from, me));
    for (std::size_t i = 0; i < got.size(); ++i) {
      CHECK(got[i] == Parcel{from, me, static_cast<std::int32_t>(i)});
    }
  }
}

TEST_CASE("one rank throws: all do, and say which and why") {
  const Communicator world = Communicator::world();
  for (int bad = 0; bad < world.size(); ++bad) {
    const Thrown thrown = thrownBy([&] {
      world.together([&] {
        if (world.rank() == bad) throw Error(ErrorCode::OutOfMemory, "no room", "shelf");
      });
    });
    CHECK(thrown.code == (world.rank() == bad ? ErrorCode::OutOfMemory : ErrorCode::RemoteRank));
    CHECK(thrown.text == (world.rank() == bad ? "no room (shelf)"
                                              : "rank " + std::to_string(bad) + " failed: no room (shelf)"));
  }
  CHECK_NOTHROW(world.together([] {}));
}

TEST_CASE("several ranks throw: each its own error, the others the lowest rank's") {
  const Communicator world = Communicator::world();
  const bool bad = world.rank() % 2 == 1;
  const Thrown thrown = thrownBy([&] {
    world.together([&] {
      if (bad) throw std::runtime_error("rank " + std::to_string(world.rank()) + " is unwell");
    });
  });
  if (world.size() == 1) {
    CHECK(thrown.text.empty());
  } else if (bad) {
    CHECK(thrown.text == "rank " + std::to_string(world.rank()) + " is unwell");
  } else {
    CHECK(thrown.code == ErrorCode::RemoteRank);
    CHECK(thrown.text == "rank 1 failed: rank 1 is unwell");
  }
}

TEST_CASE("other thrown objects, and texts longer than a message, arrive too") {
  const Communicator world = Communicator::world();
  const int last = world.size() - 1;
  const auto failing = [&](const std::function<void()>& how) {
    try {
      world.together([&] {
        if (world.rank() == last) how();
      });
    } catch (const Error& error) {
      return std::string(error.what());
    } catch (...) {
      return std::string("own");
    }
    return std::string("none");
  };
  const std::string odd = failing([] { throw 42; });
  CHECK(odd ==
        (world.rank() == last ? "own" : "rank " + std::to_string(last) + " failed: an unknown exception"));
  const std::string huge = failing([] { throw std::runtime_error(std::string(100000, 'x')); });
  if (world.rank() != last) {
    CHECK(huge.size() > 500);
    CHECK(huge.size() < 2000);
  }
}

TEST_CASE("requireEqual: every rank throws if one differs") {
  const Communicator world = Communicator::world();
  for (const std::uint64_t value :
       {std::uint64_t{0}, std::uint64_t{1}, ~std::uint64_t{0}, std::uint64_t{1} << 63}) {
    CHECK_NOTHROW(world.requireEqual(value, "the same"));
    for (int odd = 0; odd < world.size() && world.size() > 1; ++odd) {
      const std::uint64_t mine = world.rank() == odd ? value + 1 : value;
      const Thrown thrown = thrownBy([&] { world.requireEqual(mine, "camera"); });
      CHECK(thrown.code == ErrorCode::InvalidArgument);
      CHECK(thrown.text.find("camera") != std::string::npos);
    }
  }
}

TEST_CASE("more elements than MPI counts: every rank throws, nothing is sent") {
  const Communicator world = Communicator::world();
  if (world.size() == 1) return;  // a single rank sends nothing through MPI
  constexpr std::uint64_t tooMany = 1ULL << 31;
  const bool sender = world.rank() == 1;
  const Unbacked memory(sender ? tooMany : 1);
  const std::span<const std::byte> bytes = memory.span();
  std::vector<std::uint64_t> counts(static_cast<std::size_t>(world.size()), 0);
  counts.front() = sender ? tooMany : 1;
  const auto check = [&](const Thrown& thrown, bool concerned) {
    CHECK(thrown.code == (concerned ? ErrorCode::Communication : ErrorCode::RemoteRank));
    CHECK(thrown.text.find("elements in one exchange") != std::string::npos);
  };
  // Sender and receiver both notice; ranks that neither send nor receive that much are told.
  check(thrownBy([&] { world.allToAll(bytes, counts, 1); }), sender || world.rank() == 0);
  check(thrownBy([&] { world.gather(bytes, 1, 0); }), true);
  check(thrownBy([&] { world.allGather(bytes, 1); }), true);
  std::vector<double> still{1.0};
  world.allReduceSum(still);
  CHECK(still[0] == world.size());
}

#ifndef __SANITIZE_ADDRESS__
TEST_CASE("a rank without enough memory makes all fail, and all continue") {
  const Communicator world = Communicator::world();
  const int poor = world.size() - 1;
  constexpr std::size_t room = 64ULL << 20;
  rlimit before{};
  REQUIRE(::getrlimit(RLIMIT_AS, &before) == 0);
  std::vector<std::byte> bytes;
  if (world.rank() == 0) bytes.resize(4 * room);
  if (world.rank() == poor && poor > 0) {
    std::size_t pages = 0;
    std::FILE* file = std::fopen("/proc/self/statm", "r");
    REQUIRE(file != nullptr);
    CHECK(std::fscanf(file, "%zu", &pages) == 1);
    std::fclose(file);
    const rlimit tight{pages * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE)) + room, before.rlim_max};
    REQUIRE(::setrlimit(RLIMIT_AS, &tight) == 0);
  }
  bool ownFault = false;
  Thrown thrown;
  try {
    bytes = world.broadcast(std::move(bytes), 0);
  } catch (const std::bad_alloc&) {
    ownFault = true;
  } catch (const Error& error) {
    thrown = {error.code(), error.what()};
  }
  REQUIRE(::setrlimit(RLIMIT_AS, &before) == 0);
  if (world.size() == 1) {
    CHECK(bytes.size() == 4 * room);
  } else {
    CHECK(ownFault == (world.rank() == poor));
    if (world.rank() != poor) CHECK(thrown.code == ErrorCode::RemoteRank);
  }
  world.barrier();
}
#endif

// Hidden, because it takes 5 GiB. Run it with the argument [large] on 2 ranks.
TEST_CASE("more than 2 GiB between two ranks", "[.][large]") {
  const Communicator world = Communicator::world();
  using Element = std::array<std::uint64_t, 3>;
  constexpr std::uint64_t count = 100'000'000;  // 2.4e9 bytes
  const bool sender = world.rank() == world.size() - 1;
  std::vector<Element> mine;
  if (sender) {
    mine.resize(count);
    for (std::uint64_t i = 0; i < count; ++i) mine[i] = {i, i * i, ~i};
  }
  const auto requireSame = [&](const comm::Gathered& received) {
    const auto part = received.of(world.size() - 1);
    REQUIRE(part.size() == count * sizeof(Element));
    std::uint64_t wrong = 0;
    for (std::uint64_t i = 0; i < count; ++i) {
      Element element{};
      std::memcpy(&element, part.data() + i * sizeof(Element), sizeof(Element));
      if (element != Element{i, i * i, ~i}) ++wrong;
    }
    CHECK(wrong == 0);
  };
  std::vector<std::uint64_t> counts(static_cast<std::size_t>(world.size()), 0);
  if (sender) counts.front() = count;
  const comm::Gathered exchanged = world.allToAll(bytesOf(mine), counts, sizeof(Element));
  if (world.rank() == 0) requireSame(exchanged);
  const comm::Gathered gathered = world.gather(bytesOf(mine), sizeof(Element), 0);
  if (world.rank() == 0) requireSame(gathered);
}
