#include "vdi/comm/ByteSum.h"

#include <algorithm>
#include <span>

namespace vdi::comm {

namespace {

/// Adds up to 255, in a loop that compilers vectorise.
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

ByteSum::ByteSum(const Communicator& comm, Transport transport)
    : comm_(comm), scatter_(comm, transport), gather_(comm, transport) {
  const auto ranks = static_cast<std::size_t>(comm.size());
  pieces_.reserve(ranks);
  stretches_.reserve(ranks);
}

ByteSum::Bytes ByteSum::shareOf(int rank) const {
  constexpr std::uint64_t alignment = 256;
  const auto ranks = static_cast<std::uint64_t>(comm_.size());
  const std::uint64_t share = (bytes_ / ranks + alignment) / alignment * alignment;
  const std::uint64_t first = std::min(share * static_cast<std::uint64_t>(rank), bytes_);
  return {first, std::min(share, bytes_ - first)};
}

Exchange::Place ByteSum::begin(std::uint64_t bytes) {
  bytes_ = bytes;
  stretches_.clear();
  own_ = scatter_.outbox(bytes);
  return own_;
}

/// Adds other ranks' parts of this rank's share to its own.
void ByteSum::addUp() {
  pieces_.clear();
  for (int rank = 0; rank < comm_.size(); ++rank) {
    const Bytes bytes = shareOf(rank);
    if (rank != comm_.rank() && bytes.count > 0) pieces_.push_back({rank, bytes.first, bytes.count, {}});
  }
  const Bytes mine = shareOf(comm_.rank());
  for (const Exchange::Incoming& piece : scatter_.send(pieces_))
    addTo(bytesAt(own_, mine.first, mine.count), bytesAt(piece.place, 0, piece.bytes));
}

std::span<const ByteSum::Stretch> ByteSum::add() {
  stretches_.clear();
  if (comm_.size() == 1) {
    stretches_.push_back({own_, 0, bytes_});
    return stretches_;
  }
  addUp();
  const Bytes mine = shareOf(comm_.rank());
  const Exchange::Place sums = gather_.outbox(mine.count);
  const std::span<std::byte> own = bytesAt(own_, mine.first, mine.count);
  std::copy(own.begin(), own.end(), bytesAt(sums, 0, mine.count).begin());
  pieces_.clear();
  for (int rank = 0; rank < comm_.size(); ++rank) {
    if (rank != comm_.rank() && mine.count > 0) pieces_.push_back({rank, 0, mine.count, {mine.first, 0}});
  }
  if (mine.count > 0) stretches_.push_back({sums, mine.first, mine.count});
  for (const Exchange::Incoming& piece : gather_.send(pieces_))
    stretches_.push_back({piece.place, piece.note[0], piece.bytes});
  return stretches_;
}

}  // namespace vdi::comm
