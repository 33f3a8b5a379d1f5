// In which rounds ranks exchange lists, and who with whom (paper, section 5.2: direct send; Peterka, Goodell,
// Ross, Shen and Thakur, "A configurable algorithm for parallel image-compositing applications", SC 2009:
// radix-k). Pure arithmetic: no communication, and nothing about what's exchanged.
#pragma once

#include <span>
#include <string_view>
#include <vector>

namespace vdi::comm {

/// A picture's lists are dealt as shares, as many as there are ranks, and numbered by *position* from the
/// picture's first list on. Each rank begins with its own part of all shares. In each round it keeps a
/// stretch of the shares that it holds and sends the others away, and merges what it keeps with what it
/// receives. In the end each rank holds one share, with all ranks' parts of it, each exactly once.
class Schedule {
 public:
  /// One round: each rank sends each other one its share. Rank r gets share r.
  static Schedule direct(int ranks);
  /// Rounds in which a rank sends to fewer than `radix` others, and hears from fewer than twice as many: some
  /// log R messages a rank instead of R. Ranks of one host come first: until each of them holds other shares
  /// than the rest, nothing goes to another host that has as many ranks. `hosts[r]`: equal for ranks of one
  /// host. `radix` is at least 2.
  static Schedule rounds(std::span<const int> hosts, int radix);
  /// `value`, what VDI_SCHEDULE is: "direct" or "rounds:K", K being a radix from 2 to 1024; direct if it's
  /// empty. Throws Error{InvalidArgument} that says so. `hosts` as above.
  static Schedule fromText(std::string_view value, std::span<const int> hosts);

  int ranks() const { return static_cast<int>(rankAt_.size()); }
  int roundCount() const { return static_cast<int>(stretches_.size()) - 1; }
  int rankAt(int position) const { return rankAt_[static_cast<std::size_t>(position)]; }
  int positionOf(int rank) const { return positionOf_[static_cast<std::size_t>(rank)]; }

  /// Shares [first, last).
  struct Shares {
    int first = 0;
    int last = 0;
    int count() const { return last - first; }
    bool operator==(const Shares&) const = default;
  };
  struct Sent {
    int to = 0;
    Shares shares;
    bool operator==(const Sent&) const = default;
  };
  /// What one rank does in a round.
  struct Round {
    Shares held;               // before
    Shares kept;               // and after
    std::vector<Sent> sent;    // the other shares, in order of position, each stretch to another rank
    std::vector<int> sources;  // who sends to this rank, in order of rank
  };
  Round round(int index, int rank) const;
  std::vector<Round> roundsOf(int rank) const;

 private:
  Schedule() = default;
  Shares heldBy(int position, int roundsDone) const;
  Shares ofHost(int host, const Shares& among) const;
  int receiverOf(int position, const Shares& kept, const Shares& sent) const;

  std::vector<int> rankAt_;  // by position
  std::vector<int> positionOf_;
  std::vector<int> hostAt_;                      // by position, counted from 0
  std::vector<std::vector<int>> hostPositions_;  // by host, ascending
  /// After so many rounds, ranks at positions [s[i], s[i + 1]) hold these shares, each with the parts of
  /// other ranks than the others in there.
  std::vector<std::vector<int>> stretches_;
};

}  // namespace vdi::comm
