#include "vdi/comm/Schedule.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <charconv>
#include <cstddef>
#include <map>
#include <numeric>

#include "vdi/core/Error.h"

namespace vdi::comm {

namespace {

std::size_t at(int index) {
  return static_cast<std::size_t>(index);
}

/// Where [first, last) begins to be cut into `parts` whose sizes differ by one at most; without `last`.
void cutEvenly(int first, int last, int parts, std::vector<int>& boundaries) {
  const int size = last - first;
  for (int i = 0; i < parts; ++i)
    boundaries.push_back(first + i * (size / parts) + std::min(i, size % parts));
}

/// As few parts as will do with the fewest rounds: 9 ranks in parts of at most 8 are 3 x 3, not 5 + 4.
int partsFor(int size, int radix) {
  int rounds = 1;
  for (long reached = radix; reached < size; reached *= radix) ++rounds;
  int parts = 2;
  const auto reach = [&] {
    long product = 1;
    for (int i = 0; i < rounds && product < size; ++i) product *= parts;
    return product;
  };
  while (parts < radix && reach() < size) ++parts;
  return std::min(parts, size);
}

}  // namespace

Schedule Schedule::direct(int ranks) {
  assert(ranks >= 1);
  return rounds(std::vector<int>(at(ranks), 0), std::max(ranks, 2));
}

Schedule Schedule::rounds(std::span<const int> hosts, int radix) {
  assert(!hosts.empty() && radix >= 2);
  const int ranks = static_cast<int>(hosts.size());
  // Each host's ranks, counted from 0. All that come first on their hosts come first, then all that come
  // second: who is on one host then has its place in different stretches, and they exchange first.
  std::map<int, std::vector<int>> members;
  std::vector<int> places;
  for (int r = 0; r < ranks; ++r) {
    std::vector<int>& host = members[hosts[at(r)]];
    places.push_back(static_cast<int>(host.size()));
    host.push_back(r);
  }
  Schedule schedule;
  schedule.rankAt_.resize(at(ranks));
  std::iota(schedule.rankAt_.begin(), schedule.rankAt_.end(), 0);
  std::stable_sort(schedule.rankAt_.begin(), schedule.rankAt_.end(), [&](int a, int b) {
    return places[at(a)] != places[at(b)] ? places[at(a)] < places[at(b)] : hosts[at(a)] < hosts[at(b)];
  });
  schedule.positionOf_.resize(at(ranks));
  for (int p = 0; p < ranks; ++p) schedule.positionOf_[at(schedule.rankAt(p))] = p;
  schedule.hostAt_.resize(at(ranks));
  for (const auto& [key, host] : members) {
    std::vector<int> positions;
    for (const int r : host) positions.push_back(schedule.positionOf(r));
    for (const int p : positions) schedule.hostAt_[at(p)] = static_cast<int>(schedule.hostPositions_.size());
    schedule.hostPositions_.push_back(std::move(positions));
  }

  // Within hosts: stretches of places, as positions.
  std::vector<int> placeBegins;  // positions at which a place begins, and the end
  for (int p = 0; p < ranks; ++p) {
    if (p == 0 || places[at(schedule.rankAt(p))] != places[at(schedule.rankAt(p - 1))])
      placeBegins.push_back(p);
  }
  placeBegins.push_back(ranks);
  const int placeCount = static_cast<int>(placeBegins.size()) - 1;
  std::vector<int> byPlace{0, placeCount};
  const auto asPositions = [&](const std::vector<int>& boundaries) {
    std::vector<int> positions;
    positions.reserve(boundaries.size());
    for (const int place : boundaries) positions.push_back(placeBegins[at(place)]);
    return positions;
  };
  schedule.stretches_.push_back(asPositions(byPlace));
  const auto split = [radix](std::vector<int>& boundaries) {
    std::vector<int> finer;
    for (std::size_t i = 0; i + 1 < boundaries.size(); ++i) {
      const int size = boundaries[i + 1] - boundaries[i];
      cutEvenly(boundaries[i], boundaries[i + 1], partsFor(size, radix), finer);
    }
    finer.push_back(boundaries.back());
    const bool changed = finer != boundaries;
    boundaries = std::move(finer);
    return changed;
  };
  while (split(byPlace)) schedule.stretches_.push_back(asPositions(byPlace));
  // Between hosts.
  std::vector<int> byPosition = schedule.stretches_.back();
  while (split(byPosition)) schedule.stretches_.push_back(byPosition);
  return schedule;
}

Schedule Schedule::fromText(std::string_view value, std::span<const int> hosts) {
  if (value.empty() || value == "direct") return direct(static_cast<int>(hosts.size()));
  constexpr std::string_view prefix = "rounds:";
  constexpr int largestRadix = 1024;
  int radix = 0;
  if (value.starts_with(prefix)) {
    const char* const end = value.data() + value.size();
    const auto [after, error] = std::from_chars(value.data() + prefix.size(), end, radix);
    if (error == std::errc() && after == end && radix >= 2 && radix <= largestRadix)
      return rounds(hosts, radix);
  }
  throw Error(ErrorCode::InvalidArgument,
              fmt::format("VDI_SCHEDULE is '{}'; there are: direct, and rounds:K with K from 2 to {}", value,
                          largestRadix));
}

Schedule::Shares Schedule::heldBy(int position, int roundsDone) const {
  const std::vector<int>& stretches = stretches_[at(roundsDone)];
  const auto after = std::upper_bound(stretches.begin(), stretches.end(), position);
  return {*(after - 1), *after};
}

/// Of a host's positions, ascending, which are in a stretch: as indices.
Schedule::Shares Schedule::ofHost(int host, const Shares& among) const {
  const std::vector<int>& all = hostPositions_[at(host)];
  const auto first = std::lower_bound(all.begin(), all.end(), among.first);
  const auto last = std::lower_bound(first, all.end(), among.last);
  return {static_cast<int>(first - all.begin()), static_cast<int>(last - all.begin())};
}

/// Whom a rank sends shares that it doesn't keep: one of those that do, on its own host if there are any. The
/// ranks that keep what it keeps take them in turns.
int Schedule::receiverOf(int position, const Shares& kept, const Shares& sent) const {
  const int host = hostAt_[at(position)];
  const Shares here = ofHost(host, sent);
  if (here.count() == 0) return sent.first + (position - kept.first) % sent.count();
  const int index = ofHost(host, {kept.first, position}).count();
  return hostPositions_[at(host)][at(here.first + index % here.count())];
}

Schedule::Round Schedule::round(int index, int rank) const {
  assert(index >= 0 && index < roundCount() && rank >= 0 && rank < ranks());
  const int position = positionOf(rank);
  Round round;
  round.held = heldBy(position, index);
  round.kept = heldBy(position, index + 1);
  for (int p = round.held.first; p < round.held.last;) {
    const Shares stretch = heldBy(p, index + 1);
    if (stretch != round.kept) {
      round.sent.push_back({rankAt(receiverOf(position, round.kept, stretch)), stretch});
      const auto ask = [&](int from) {
        if (receiverOf(from, stretch, round.kept) == position) round.sources.push_back(rankAt(from));
      };
      // Who might: its host's ranks, and those of other hosts whose turn it is.
      const int host = hostAt_[at(position)];
      const Shares here = ofHost(host, stretch);
      for (int i = here.first; i < here.last; ++i) ask(hostPositions_[at(host)][at(i)]);
      for (int from = stretch.first + position - round.kept.first; from < stretch.last;
           from += round.kept.count()) {
        if (hostAt_[at(from)] != host) ask(from);
      }
    }
    p = stretch.last;
  }
  std::sort(round.sources.begin(), round.sources.end());
  return round;
}

std::vector<Schedule::Round> Schedule::roundsOf(int rank) const {
  std::vector<Round> rounds;
  rounds.reserve(at(roundCount()));
  for (int index = 0; index < roundCount(); ++index) rounds.push_back(round(index, rank));
  return rounds;
}

}  // namespace vdi::comm
