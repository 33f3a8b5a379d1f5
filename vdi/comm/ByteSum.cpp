#include "vdi/comm/ByteSum.h"

#include <algorithm>
#include <span>

namespace vdi::comm {

namespace {

/// In a form that compilers make vector instructions of.
void addTo(std::span<std::byte> sum, std::span<const std::byte> other) {
  auto* a = reinterpret_cast<std::uint8_t*>(sum.data());
  const auto* b = reinterpret_cast<const std::uint8_t*>(other.data());
  for (std::size_t i = 0; i < sum.size(); ++i) {
    const auto both = static_cast<std::uint8_t>(a[i] + b[i]);
    a[i] = both < a[i] ? std::uint8_t{255} : both;
  }
}

std::span<std::byte> bytesAt(const Exchange::Place& place, std::uint64_t first, std::uint64_t count) {
  return place.memory->bytes().subspan(place.at + first, count);
}

}  // namespace

ByteSum::ByteSum(const Communicator& comm, Transport transport, const Schedule& schedule)
    : comm_(comm),
      rounds_(schedule.roundsOf(comm.rank())),
      scatter_(comm, transport),
      gather_(comm, transport) {}

ByteSum::Bytes ByteSum::bytesOf(const Schedule::Shares& shares) const {
  constexpr std::uint64_t alignment = 256;
  const auto ranks = static_cast<std::uint64_t>(comm_.size());
  const std::uint64_t share = (bytes_ / ranks + alignment) / alignment * alignment;
  const std::uint64_t first = std::min(share * static_cast<std::uint64_t>(shares.first), bytes_);
  const std::uint64_t last = std::min(share * static_cast<std::uint64_t>(shares.last), bytes_);
  return {first, last - first};
}

Exchange::Place ByteSum::begin(std::uint64_t bytes) {
  bytes_ = bytes;
  own_ = scatter_.outbox(bytes);
  return own_;
}

/// What a rank sends away isn't changed any more: only what it keeps is.
void ByteSum::addUp(const Schedule::Round& round) {
  Partners partners{{}, round.sources};
  std::vector<Exchange::Outgoing> pieces;
  for (const Schedule::Sent& sent : round.sent) {
    const Bytes bytes = bytesOf(sent.shares);
    partners.to.push_back(sent.to);
    if (bytes.count > 0) pieces.push_back({sent.to, bytes.first, bytes.count, {}});
  }
  const Bytes kept = bytesOf(round.kept);
  for (const Exchange::Incoming& piece : scatter_.send(pieces, partners))
    addTo(bytesAt(own_, kept.first, kept.count), bytesAt(piece.place, 0, piece.bytes));
}

/// To those whose bytes were added up in this round go the sums; the others' sums come.
std::vector<Exchange::Incoming> ByteSum::sendBack(const Schedule::Round& round) {
  Partners partners{round.sources, {}};
  for (const Schedule::Sent& sent : round.sent) partners.from.push_back(sent.to);
  std::sort(partners.from.begin(), partners.from.end());
  const Bytes kept = bytesOf(round.kept);
  std::vector<Exchange::Outgoing> pieces;
  for (const int rank : round.sources) {
    if (kept.count > 0) pieces.push_back({rank, kept.first - held_.first, kept.count, {kept.first, 0}});
  }
  return gather_.send(pieces, partners);
}

std::vector<ByteSum::Stretch> ByteSum::add() {
  if (rounds_.empty()) return {{own_, 0, bytes_}};
  for (const Schedule::Round& round : rounds_) addUp(round);
  held_ = bytesOf(rounds_.front().kept);
  sums_ = gather_.outbox(held_.count);
  const Bytes mine = bytesOf(rounds_.back().kept);
  const std::span<std::byte> own = bytesAt(own_, mine.first, mine.count);
  std::copy(own.begin(), own.end(), bytesAt(sums_, mine.first - held_.first, mine.count).begin());
  for (std::size_t i = rounds_.size() - 1; i > 0; --i) {
    for (const Exchange::Incoming& piece : sendBack(rounds_[i])) {
      const std::span<std::byte> sum = bytesAt(piece.place, 0, piece.bytes);
      std::copy(sum.begin(), sum.end(), bytesAt(sums_, piece.note[0] - held_.first, piece.bytes).begin());
    }
  }
  std::vector<Stretch> stretches;
  if (held_.count > 0) stretches.push_back({sums_, held_.first, held_.count});
  for (const Exchange::Incoming& piece : sendBack(rounds_.front()))
    stretches.push_back({piece.place, piece.note[0], piece.bytes});
  return stretches;
}

}  // namespace vdi::comm
