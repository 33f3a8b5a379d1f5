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

}  // namespace

ByteSum::ByteSum(const Communicator& comm, Transport transport)
    : comm_(comm), scatter_(comm, transport), gather_(comm, transport) {}

ByteSum::Stretch ByteSum::stretchOf(int rank) const {
  constexpr std::uint64_t alignment = 256;
  const auto ranks = static_cast<std::uint64_t>(comm_.size());
  const std::uint64_t share = (bytes_ / ranks + alignment) / alignment * alignment;
  const std::uint64_t first = std::min(share * static_cast<std::uint64_t>(rank), bytes_);
  return {{}, first, std::min(share, bytes_ - first)};
}

Exchange::Place ByteSum::begin(std::uint64_t bytes) {
  bytes_ = bytes;
  own_ = scatter_.outbox(bytes);
  return own_;
}

std::vector<ByteSum::Stretch> ByteSum::add() {
  std::vector<Exchange::Outgoing> pieces;
  for (int r = 0; r < comm_.size(); ++r) {
    const Stretch stretch = stretchOf(r);
    if (r != comm_.rank() && stretch.bytes > 0) pieces.push_back({r, stretch.first, stretch.bytes, {}});
  }
  const std::vector<Exchange::Incoming> others = scatter_.send(pieces);
  const Stretch mine = stretchOf(comm_.rank());
  const Exchange::Place result = gather_.outbox(mine.bytes);
  const std::span<std::byte> sum = result.memory->bytes().subspan(result.at, mine.bytes);
  const std::span<std::byte> own = own_.memory->bytes().subspan(own_.at + mine.first, mine.bytes);
  std::copy(own.begin(), own.end(), sum.begin());
  for (const Exchange::Incoming& piece : others) {
    addTo(sum, piece.place.memory->bytes().subspan(piece.place.at, piece.bytes));
  }
  pieces.clear();
  for (int r = 0; r < comm_.size(); ++r) {
    if (r != comm_.rank() && mine.bytes > 0) pieces.push_back({r, 0, mine.bytes, {}});
  }
  const std::vector<Exchange::Incoming> sums = gather_.send(pieces);
  std::vector<Stretch> stretches;
  if (mine.bytes > 0) stretches.push_back({result, mine.first, mine.bytes});
  for (const Exchange::Incoming& piece : sums) {
    stretches.push_back({piece.place, stretchOf(piece.from).first, piece.bytes});
  }
  return stretches;
}

}  // namespace vdi::comm
