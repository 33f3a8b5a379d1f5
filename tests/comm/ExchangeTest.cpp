// Exchange between ranks, through shared memory and by messages, on any number of ranks.
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <optional>

#include "tests/Catch.h"
#include "vdi/comm/ByteSum.h"
#include "vdi/comm/Exchange.h"
#include "vdi/comm/GlobalScene.h"
#include "vdi/core/Error.h"

using namespace vdi;
using comm::Communicator;
using comm::Exchange;
using comm::Transport;

namespace {

std::byte valueOf(int from, int to, std::size_t i, int round) {
  return static_cast<std::byte>((static_cast<std::size_t>(from) * 31 + static_cast<std::size_t>(to) * 7 + i +
                                 static_cast<std::size_t>(round)) %
                                251);
}

/// Some pairs exchange nothing, and sizes change from round to round.
std::uint64_t bytesOf(int from, int to, int round) {
  const int kind = (from * 5 + to * 3 + round) % 4;
  return kind == 0 ? 0
                   : static_cast<std::uint64_t>(kind) * 1000 * static_cast<std::uint64_t>(1 + round * round);
}

enum class Trouble { None, NoRoom, NotOpened };

/// While it exists, this process cannot create files, or cannot open any.
class Limit {
 public:
  explicit Limit(__rlimit_resource kind) : kind_(kind) {
    getrlimit(kind, &before_);
    rlimit none = before_;
    none.rlim_cur = 0;
    if (kind == RLIMIT_NOFILE) {  // open ones stay usable
      const int next = dup(STDIN_FILENO);
      none.rlim_cur = static_cast<rlim_t>(next);
      close(next);
    }
    setrlimit(kind, &none);
    handler_ = std::signal(SIGXFSZ, SIG_IGN);
  }
  ~Limit() {
    setrlimit(kind_, &before_);
    (void)std::signal(SIGXFSZ, handler_);
  }
  Limit(const Limit&) = delete;
  Limit& operator=(const Limit&) = delete;

 private:
  __rlimit_resource kind_;
  rlimit before_{};
  void (*handler_)(int) = nullptr;
};

}  // namespace

TEST_CASE("every rank receives every rank's data for it, round after round") {
  const Transport transport = GENERATE(Transport::Shared, Transport::Mpi);
  const char* ranksPerHost = GENERATE("0", "2");
  const auto trouble = GENERATE(Trouble::None, Trouble::NoRoom, Trouble::NotOpened);
  INFO((transport == Transport::Shared ? "shared" : "mpi") << ", ranks a host: " << ranksPerHost);
  setenv("VDI_RANKS_PER_HOST", ranksPerHost, 1);
  const Communicator world = Communicator::world();
  unsetenv("VDI_RANKS_PER_HOST");
  const int last = world.size() - 1;
  // Only the last host has a problem: its leader has no room, or one of its ranks cannot open the
  // leader's memory.
  const int inTrouble = trouble == Trouble::NoRoom ? world.hostLeader(last) : last;
  Exchange exchange(world, transport);
  for (const int round : {0, 1, 7, 2, 3}) {
    std::optional<Limit> limit;
    if (round == 7 && world.rank() == inTrouble && trouble != Trouble::None)
      limit.emplace(trouble == Trouble::NoRoom ? RLIMIT_FSIZE : RLIMIT_NOFILE);
    std::vector<Exchange::Outgoing> pieces;
    std::uint64_t total = 0;
    for (int to = 0; to < world.size(); ++to) {
      if (to == world.rank() || bytesOf(world.rank(), to, round) == 0) continue;
      pieces.push_back({to, total, bytesOf(world.rank(), to, round), {static_cast<std::uint64_t>(round), 3}});
      total += pieces.back().bytes + 5;
    }
    const Exchange::Place outbox = exchange.outbox(total);
    limit.reset();
    REQUIRE(outbox.memory->bytes().size() >= outbox.at + total);
    for (const Exchange::Outgoing& piece : pieces) {
      for (std::size_t i = 0; i < piece.bytes; ++i) {
        outbox.memory->bytes()[outbox.at + piece.at + i] = valueOf(world.rank(), piece.to, i, round);
      }
    }
    const std::span<const Exchange::Incoming> incoming = exchange.send(pieces);
    std::size_t next = 0;
    for (int from = 0; from < world.size(); ++from) {
      if (from == world.rank() || bytesOf(from, world.rank(), round) == 0) continue;
      REQUIRE(next < incoming.size());
      const Exchange::Incoming& piece = incoming[next++];
      CHECK(piece.from == from);
      REQUIRE(piece.bytes == bytesOf(from, world.rank(), round));
      CHECK(piece.note == Exchange::Note{static_cast<std::uint64_t>(round), 3});
      bool same = true;
      for (std::size_t i = 0; i < piece.bytes; ++i) {
        same =
            same && piece.place.memory->bytes()[piece.place.at + i] == valueOf(from, world.rank(), i, round);
      }
      CHECK(same);
    }
    CHECK(next == incoming.size());
    const int leader = world.hostLeader(world.rank());
    const bool failed = round == 7 && trouble != Trouble::None && leader == world.hostLeader(last);
    if (world.size() > 1 && (round == 0 || round == 7))
      CHECK(exchange.sharesMemoryWith(leader) == (transport == Transport::Shared && !failed));
    world.barrier();  // before any rank writes in the next round
  }
}

TEST_CASE("the transport that the environment asks for") {
  CHECK(comm::transportFromText("mpi") == Transport::Mpi);
  CHECK(comm::transportFromText("") == Transport::Shared);
  CHECK_THROWS_AS(comm::transportFromText("pigeon"), Error);
}

TEST_CASE("an environment variable has rank 0's value on all ranks") {
  const Communicator world = Communicator::world();
  setenv("VDI_DEVICE", world.rank() == 0 ? "first" : "other", 1);
  CHECK(world.environment("VDI_DEVICE") == "first");
  unsetenv("VDI_DEVICE");
  CHECK(world.environment("VDI_DEVICE").empty());
}

TEST_CASE("shared memory is opened by name, and gone when nobody holds it") {
  const Communicator world = Communicator::world();
  const auto memory = HostMemory::shared(1000);
  REQUIRE(!memory->name().empty());
  const auto again = HostMemory::open(memory->name(), 1000);
  memory->bytes()[999] = std::byte{7};
  CHECK(again->bytes()[999] == std::byte{7});
  memory->unlink();
  CHECK_THROWS_AS(HostMemory::open(memory->name(), 1000), Error);
  CHECK(again->bytes()[999] == std::byte{7});
  CHECK(HostMemory::shared(1000)->name() != memory->name());
}

TEST_CASE("sums of bytes saturate at 255") {
  const Communicator world = Communicator::world();
  const Transport transport = GENERATE(Transport::Shared, Transport::Mpi);
  comm::ByteSum sum(world, transport);
  for (const std::size_t size : {std::size_t{1}, std::size_t{1000}, std::size_t{70001}, std::size_t{300}}) {
    INFO(size << " bytes");
    const auto valueOf = [](int rank, std::size_t i) {
      return (i * 7 + static_cast<std::size_t>(rank) * 3) % 256;
    };
    const Exchange::Place own = sum.begin(size);
    for (std::size_t i = 0; i < size; ++i) {
      own.memory->bytes()[own.at + i] = static_cast<std::byte>(valueOf(world.rank(), i));
    }
    std::vector<std::size_t> result(size, 1000);
    for (const comm::ByteSum::Stretch& stretch : sum.add()) {
      for (std::size_t i = 0; i < stretch.bytes; ++i) {
        result[stretch.first + i] =
            std::to_integer<std::size_t>(stretch.place.memory->bytes()[stretch.place.at + i]);
      }
    }
    bool same = true;
    for (std::size_t i = 0; i < size; ++i) {
      std::size_t expected = 0;
      for (int r = 0; r < world.size(); ++r) expected += valueOf(r, i);
      same = same && result[i] == std::min<std::size_t>(expected, 255);
    }
    CHECK(same);
    world.barrier();
  }
}

TEST_CASE("the global scene is the union of the ranks' scenes") {
  const Communicator world = Communicator::world();
  const int last = world.size() - 1;
  Scene local;  // rank 0 has nothing, unless it is the only rank
  if (world.rank() > 0 || last == 0) {
    const double r = world.rank();
    local.bounds = {{r, -r, 5.0}, {r + 1.0, 1.0, 6.0 + r}};
    local.minSpacing = 0.5 / (r + 1.0);
  }
  const Scene scene = comm::globalScene(world, local);
  const double first = last == 0 ? 0.0 : 1.0;
  CHECK(scene.bounds == Box{{first, -1.0 * last, 5.0}, {last + 1.0, 1.0, 6.0 + last}});
  CHECK(scene.minSpacing == 0.5 / (last + 1.0));
  const Scene nothing = comm::globalScene(world, Scene());
  CHECK(nothing.bounds.empty());
  CHECK(nothing.minSpacing == 0.0);
}
