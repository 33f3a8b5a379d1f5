#include "vdi/comm/Exchange.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cstring>
#include <numeric>
#include <string>

#include "vdi/core/Error.h"

namespace vdi::comm {

namespace {

/// The alignment of pieces, with which devices copy fast.
constexpr std::uint64_t alignment = 256;

std::uint64_t aligned(std::uint64_t bytes) {
  return (bytes + alignment - 1) / alignment * alignment;
}

/// A name as words, for exchange between ranks.
using NameWords = std::array<std::uint64_t, 8>;

NameWords wordsOf(const std::string& name) {
  NameWords words{};
  assert(name.size() < sizeof(words));
  std::memcpy(words.data(), name.data(), name.size());
  return words;
}

std::string nameOf(std::span<const std::uint64_t> words) {
  return {reinterpret_cast<const char*>(words.data())};
}

}  // namespace

Exchange::Exchange(const Communicator& comm, Transport transport)
    : comm_(comm),
      transport_(transport),
      sent_(static_cast<std::size_t>(comm.size()) * headerWords),
      received_(sent_.size()) {
  incoming_.reserve(static_cast<std::size_t>(comm.size()));
}

bool Exchange::sharesMemoryWith(int rank) const {
  return window_ != nullptr && comm_.hostLeader(rank) == comm_.hostLeader(comm_.rank());
}

Exchange::Place Exchange::outbox(std::uint64_t bytes) {
  if (transport_ == Transport::Shared && comm_.size() > 1) {
    const bool grows = comm_.anyTogether(
        [&] { return parts_.empty() || parts_[static_cast<std::size_t>(comm_.rank())] < aligned(bytes); });
    if (grows) shareNewWindow(comm_.allGatherWords(std::array{aligned(bytes)}));
    if (everyHostShares_) return outbox_;
  }
  // Either all ranks come here or none: everyHostShares_ is equal on all, and `together` is collective.
  comm_.together([&] {
    if (window_) return;
    if (!outbox_.memory || outbox_.memory->bytes().size() < bytes) {
      outbox_ = {};
      outbox_.memory = HostMemory::anonymous(bytes + bytes / 2);
    }
  });
  return outbox_;
}

/// Opens the window that the host's leader made. False if that fails.
bool Exchange::openWindow(const std::string& name, std::uint64_t bytes) {
  if (name.empty()) return false;
  if (window_) return true;
  try {
    window_ = HostMemory::open(name, bytes);
  } catch (const Error&) {  // the rank may see another file system
    return false;
  }
  return true;
}

/// Each host's leader makes a window. If that fails, the host has none. An error leaves all ranks without one
/// until the next outbox.
void Exchange::shareNewWindow(std::span<const std::uint64_t> sizes) {
  const int leader = comm_.hostLeader(comm_.rank());
  window_.reset();
  outbox_ = {};
  incoming_.clear();
  parts_.clear();
  everyHostShares_ = false;
  messages_ = true;
  // Makes each outbox 1.5 times as large, so that slow growth does not need a new window every frame, and at
  // least twice the mean, because the load may move from one rank to another between frames.
  std::vector<std::uint64_t> parts;
  comm_.together([&] { parts.assign(sizes.begin(), sizes.end()); });
  const std::uint64_t mean = std::accumulate(parts.begin(), parts.end(), std::uint64_t{0}) / parts.size();
  for (std::uint64_t& part : parts) part = aligned(std::max(part + part / 2, 2 * mean));
  std::uint64_t total = 0;
  std::uint64_t own = 0;
  for (int r = 0; r < comm_.size(); ++r) {
    if (comm_.hostLeader(r) != leader) continue;
    if (r == comm_.rank()) own = total;
    total += parts[static_cast<std::size_t>(r)];
  }
  std::string name;
  comm_.together([&] {
    if (comm_.rank() != leader) return;
    try {
      window_ = HostMemory::shared(total);
      name = window_->name();
    } catch (const Error&) {  // with too little shared memory, ranks send messages
    }
  });
  const std::vector<std::uint64_t> names = comm_.allGatherWords(wordsOf(name));
  const std::size_t words = NameWords().size();
  const std::vector<std::uint64_t> opened = comm_.gatherTogether([&] {
    name = nameOf(std::span(names).subspan(static_cast<std::size_t>(leader) * words, words));
    return openWindow(name, total) ? 1U : 0U;
  });
  if (window_) window_->unlink();  // all ranks have tried to open it
  everyHostShares_ = std::ranges::all_of(opened, [](std::uint64_t has) { return has != 0; });
  bool hostShares = true;
  bool oneHost = true;
  for (int r = 0; r < comm_.size(); ++r) {
    if (comm_.hostLeader(r) != leader) {
      oneHost = false;
    } else if (opened[static_cast<std::size_t>(r)] == 0) {
      hostShares = false;
    }
  }
  messages_ = !oneHost || !everyHostShares_;
  if (hostShares) {
    outbox_ = {window_, own};
  } else {
    window_.reset();
  }
  parts_ = std::move(parts);
}

void Exchange::putHeader(const Outgoing& piece, std::span<std::uint64_t> header) const {
  const std::array<std::uint64_t, headerWords> words{outbox_.at + piece.at, piece.bytes, piece.note[0],
                                                     piece.note[1]};
  std::copy(words.begin(), words.end(), header.begin());
}

std::span<const Exchange::Incoming> Exchange::send(std::span<const Outgoing> pieces) {
  std::fill(sent_.begin(), sent_.end(), 0);
  for (const Outgoing& piece : pieces) {
    assert(piece.to != comm_.rank() && piece.to < comm_.size());
    putHeader(piece, std::span(sent_).subspan(static_cast<std::size_t>(piece.to) * headerWords, headerWords));
  }
  // With shared memory, the data is ready as soon as its header arrives, since headers are sent after the
  // data is written.
  comm_.allToAllWords(sent_, received_);
  incoming_.clear();
  for (int r = 0; r < comm_.size(); ++r)
    addIncoming(r, &received_[static_cast<std::size_t>(r) * headerWords]);
  if (messages_) exchangeMessages(pieces);
  return incoming_;
}

/// Adds the data that a header describes, if it can be read in place.
void Exchange::addIncoming(int from, const std::uint64_t* header) {
  if (header[1] == 0) return;
  const bool shared = sharesMemoryWith(from);
  incoming_.push_back(
      {from, {shared ? window_ : nullptr, shared ? header[0] : 0}, header[1], {header[2], header[3]}});
}

/// Exchanges messages with the ranks that share no memory with this one.
void Exchange::exchangeMessages(std::span<const Outgoing> pieces) {
  Messages messages(comm_);
  comm_.together([&] {
    std::uint64_t messageBytes = 0;
    for (Incoming& piece : incoming_) {
      if (piece.place.memory) continue;
      piece.place.at = messageBytes;
      messageBytes += aligned(piece.bytes);
      messages.reserve(piece.bytes);
    }
    for (const Outgoing& piece : pieces) {
      if (!sharesMemoryWith(piece.to)) messages.reserve(piece.bytes);
    }
    if (messageBytes > 0 && (!inbox_ || inbox_->bytes().size() < messageBytes)) {
      inbox_.reset();
      inbox_ = HostMemory::anonymous(messageBytes + messageBytes / 2);
    }
  });
  for (Incoming& piece : incoming_) {
    if (piece.place.memory) continue;
    piece.place.memory = inbox_;
    messages.receive(piece.from, inbox_->bytes().subspan(piece.place.at, piece.bytes));
  }
  for (const Outgoing& piece : pieces) {
    if (piece.bytes == 0 || sharesMemoryWith(piece.to)) continue;
    messages.send(piece.to, outbox_.memory->bytes().subspan(outbox_.at + piece.at, piece.bytes));
  }
  messages.wait();
}

}  // namespace vdi::comm
