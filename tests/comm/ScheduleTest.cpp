// Rounds of exchanges: no communication, any number of ranks and hosts.
#include <algorithm>
#include <bitset>
#include <catch2/catch.hpp>
#include <numeric>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "vdi/comm/Schedule.h"

using vdi::comm::Schedule;

namespace {

constexpr int mostRanks = 1024;

std::size_t at(int index) {
  return static_cast<std::size_t>(index);
}

std::vector<int> hostsOf(int ranks, int perHost) {
  std::vector<int> hosts(at(ranks));
  for (int r = 0; r < ranks; ++r) hosts[at(r)] = r / perHost * perHost;
  return hosts;
}

/// Plays all rounds: whose parts each rank has of the shares that it holds. Returns what went wrong first.
std::string problemOf(const Schedule& schedule) {
  const int ranks = schedule.ranks();
  using Parts = std::bitset<mostRanks>;
  std::vector<Parts> parts(at(ranks));
  std::vector<Schedule::Shares> held(at(ranks), {0, ranks});
  for (int r = 0; r < ranks; ++r) parts[at(r)].set(at(r));
  for (int index = 0; index < schedule.roundCount(); ++index) {
    std::vector<Parts> merged = parts;
    std::vector<std::vector<int>> arrived(at(ranks));
    std::vector<Schedule::Round> rounds;
    for (int r = 0; r < ranks; ++r) {
      rounds.push_back(schedule.round(index, r));
      if (rounds.back().held != held[at(r)]) return "a rank holds something else than it kept";
    }
    for (int r = 0; r < ranks; ++r) {
      const Schedule::Round& round = rounds[at(r)];
      std::vector<Schedule::Shares> stretches{round.kept};
      for (const Schedule::Sent& sent : round.sent) {
        if (sent.to == r || sent.shares.count() <= 0) return "a message of nothing, or to oneself";
        if (rounds[at(sent.to)].kept != sent.shares) return "a rank gets what it doesn't keep";
        if ((merged[at(sent.to)] & parts[at(r)]).any()) return "a part comes twice";
        merged[at(sent.to)] |= parts[at(r)];
        arrived[at(sent.to)].push_back(r);
        stretches.push_back(sent.shares);
      }
      const auto byFirst = [](const auto& a, const auto& b) { return a.first < b.first; };
      if (!std::is_sorted(stretches.begin() + 1, stretches.end(), byFirst)) return "messages out of order";
      std::sort(stretches.begin(), stretches.end(), byFirst);
      int next = round.held.first;
      for (const Schedule::Shares& stretch : stretches) {
        if (std::exchange(next, stretch.last) != stretch.first) return "a share is lost, or sent twice";
      }
      if (next != round.held.last) return "a share is lost";
      held[at(r)] = round.kept;
    }
    for (int r = 0; r < ranks; ++r) {
      if (arrived[at(r)] != rounds[at(r)].sources) return "a rank waits for others than those who send";
    }
    parts = std::move(merged);
  }
  for (int r = 0; r < ranks; ++r) {
    const int position = schedule.positionOf(r);
    if (schedule.rankAt(position) != r) return "positions aren't a permutation of ranks";
    if (held[at(r)] != Schedule::Shares{position, position + 1}) return "a rank ends with other shares";
    if (parts[at(r)].count() != at(ranks)) return "a rank lacks parts";
  }
  return "";
}

/// A permutation of depths, in parts that are in order: a rank's part of a list.
using List = std::vector<int>;

}  // namespace

TEST_CASE("direct send: each rank its share, in one round") {
  for (int ranks = 1; ranks <= mostRanks; ranks = ranks < 40 ? ranks + 1 : ranks * 3 / 2) {
    INFO(ranks << " ranks");
    const Schedule schedule = Schedule::direct(ranks);
    CHECK(schedule.roundCount() == (ranks > 1 ? 1 : 0));
    CHECK(problemOf(schedule) == "");
    if (ranks > 1) {
      const Schedule::Round round = schedule.round(0, ranks / 2);
      CHECK(round.sent.size() == at(ranks - 1));
      CHECK(round.sources.size() == at(ranks - 1));
      CHECK(round.kept == Schedule::Shares{ranks / 2, ranks / 2 + 1});
    }
  }
}

TEST_CASE("rounds: each rank's part of each share arrives once, for 1 to 1024 ranks") {
  for (int ranks = 1; ranks <= mostRanks; ++ranks) {
    // All counts with one host size and radix each; all of both with the awkward counts.
    const bool all = ranks <= 33 || ranks == 61 || ranks == 97 || ranks == 1000 || ranks >= 1023;
    for (const int perHost : {1, 3, 4, 8, mostRanks}) {
      for (const int radix : {2, 3, 8, 32}) {
        if (!all && (perHost != 8 || radix != 8)) continue;
        INFO(ranks << " ranks, " << perHost << " a host, radix " << radix);
        CHECK(problemOf(Schedule::rounds(hostsOf(ranks, perHost), radix)) == "");
      }
    }
  }
}

TEST_CASE("rounds: hosts of different sizes, in any order of ranks") {
  std::mt19937 random(5);
  for (int trial = 0; trial < 100; ++trial) {
    const int ranks = 1 + static_cast<int>(random() % 200);
    const int hostCount = 1 + static_cast<int>(random() % 20);
    std::vector<int> hosts(at(ranks));
    for (int& host : hosts) host = static_cast<int>(random() % static_cast<unsigned>(hostCount)) * 7;
    INFO("trial " << trial << ", " << ranks << " ranks");
    CHECK(problemOf(Schedule::rounds(hosts, 2 + static_cast<int>(random() % 9))) == "");
  }
}

TEST_CASE("rounds: few of them, with few partners, the host's own first") {
  for (const int ranks : {2, 7, 64, 100, 512, 1000, 1024}) {
    for (const int radix : {2, 4, 8}) {
      INFO(ranks << " ranks, radix " << radix);
      const Schedule schedule = Schedule::rounds(std::vector<int>(at(ranks), 0), radix);
      int needed = 0;
      for (int reached = 1; reached < ranks; reached *= radix) ++needed;
      CHECK(schedule.roundCount() == needed);
      for (int index = 0; index < schedule.roundCount(); ++index) {
        for (int r = 0; r < ranks; ++r) {
          const Schedule::Round round = schedule.round(index, r);
          CHECK(round.sent.size() < at(radix));
          CHECK(round.sources.size() < at(2 * radix));
        }
      }
    }
  }
  constexpr int perHost = 8;
  const std::vector<int> hosts = hostsOf(128, perHost);
  const Schedule schedule = Schedule::rounds(hosts, perHost);
  REQUIRE(schedule.roundCount() == 3);  // 8 ranks of a host, then 16 hosts as 4 x 4
  for (int r = 0; r < 128; ++r) {
    for (const Schedule::Sent& sent : schedule.round(0, r).sent) CHECK(hosts[at(sent.to)] == hosts[at(r)]);
    for (int index = 1; index < 3; ++index) {
      CHECK(schedule.round(index, r).sent.size() == 3);
      for (const Schedule::Sent& sent : schedule.round(index, r).sent)
        CHECK(hosts[at(sent.to)] != hosts[at(r)]);
    }
  }
}

TEST_CASE("merging round by round gives what merging at once gives") {
  for (const int ranks : {1, 2, 3, 5, 7, 61, 97, 256, 1000, 1024}) {
    INFO(ranks << " ranks");
    const Schedule schedule = Schedule::rounds(hostsOf(ranks, 4), 4);
    std::mt19937 random(static_cast<unsigned>(ranks));
    // One list a share; each rank has some depths of each, which nobody else has.
    std::vector<std::vector<List>> held(at(ranks), std::vector<List>(at(ranks)));
    std::vector<List> expected(at(ranks));
    for (int share = 0; share < ranks; ++share) {
      for (int depth = 0; depth < 40; ++depth) {
        const auto owner = static_cast<std::size_t>(random() % static_cast<unsigned>(ranks));
        held[owner][at(share)].push_back(depth);
        expected[at(share)].push_back(depth);
      }
    }
    for (int index = 0; index < schedule.roundCount(); ++index) {
      const std::vector<std::vector<List>> before = held;
      for (int r = 0; r < ranks; ++r) {
        for (const Schedule::Sent& sent : schedule.round(index, r).sent) {
          for (int share = sent.shares.first; share < sent.shares.last; ++share) {
            List& to = held[at(sent.to)][at(share)];
            const List& from = before[at(r)][at(share)];
            const auto middle = static_cast<std::ptrdiff_t>(to.size());
            to.insert(to.end(), from.begin(), from.end());
            std::inplace_merge(to.begin(), to.begin() + middle, to.end());
          }
        }
      }
    }
    for (int r = 0; r < ranks; ++r)
      CHECK(held[at(r)][at(schedule.positionOf(r))] == expected[at(schedule.positionOf(r))]);
  }
}
