#include "vdi/pipeline/Gather.h"

#include <algorithm>
#include <array>
#include <cstring>

#include "vdi/core/Error.h"

namespace vdi::detail {

namespace {

constexpr std::size_t nameBytes = 64;

/// The root's description of an array.
struct ArrayHeader {
  std::array<char, nameBytes> memory{};  // empty: others cannot open it
  std::uint64_t memoryBytes = 0;
  std::uint64_t at = 0;
  std::uint64_t bytes = 0;
};

}  // namespace

HostAccess& OpenedMemory::of(const std::string& name, std::uint64_t bytes) {
  std::unique_ptr<HostAccess>& access = accesses_[name];
  if (!access) access = std::make_unique<HostAccess>(device_, HostMemory::open(name, bytes));
  return *access;
}

void OpenedMemory::keep(const std::vector<std::string>& names) {
  std::erase_if(accesses_, [&](const auto& entry) {
    return std::find(names.begin(), names.end(), entry.first) == names.end();
  });
}

Gather::Gather(std::shared_ptr<gpu::Device> device, const comm::Communicator& comm, comm::Transport transport,
               int root, std::shared_ptr<OpenedMemory> opened)
    : device_(std::move(device)),
      comm_(comm),
      transport_(transport),
      root_(root),
      opened_(std::move(opened)) {}

/// Describes, for the other ranks, the arrays and then all of the pool's memory.
std::vector<std::byte> Gather::describe(HostPool& pool, std::span<const std::span<std::byte>> arrays) {
  std::vector<ArrayHeader> headers;
  for (const std::span<std::byte> array : arrays) {
    const HostPool::Place place = pool.placeOf(array.data());
    HostMemory& memory = *place.access->memory();
    memory.publish();  // if this fails, ranks that have not opened it before send messages
    ArrayHeader header;
    std::copy(memory.name().begin(), memory.name().end(), header.memory.begin());
    header.memoryBytes = memory.bytes().size();
    header.at = place.at;
    header.bytes = array.size();
    headers.push_back(header);
    arrays_.push_back({place.access, place.at, array.size(), array.data()});
  }
  for (const std::string& name : pool.names()) {
    ArrayHeader header;
    std::copy(name.begin(), name.end(), header.memory.begin());
    headers.push_back(header);
  }
  const auto bytes = std::as_bytes(std::span(headers));
  return {bytes.begin(), bytes.end()};
}

void Gather::open(std::span<const std::byte> described) {
  const bool here =
      transport_ == comm::Transport::Shared && comm_.hostLeader(root_) == comm_.hostLeader(comm_.rank());
  std::vector<ArrayHeader> headers(described.size() / sizeof(ArrayHeader));
  std::memcpy(headers.data(), described.data(), described.size());
  std::vector<std::string> names;
  names.reserve(headers.size());
  for (const ArrayHeader& header : headers) names.emplace_back(header.memory.data());
  opened_->keep(names);
  for (const ArrayHeader& header : headers) {
    if (header.bytes == 0) continue;  // not an array
    Array array{nullptr, header.at, header.bytes, nullptr};
    if (here && header.memory.front() != '\0') {
      try {
        array.access = &opened_->of(header.memory.data(), header.memoryBytes);
      } catch (const Error& error) {  // for example another file system; uses messages
        if (error.code() != ErrorCode::Communication) throw;
      }
    }
    arrays_.push_back(array);
  }
}

void Gather::begin(HostPool& pool, std::span<const std::span<std::byte>> arrays) {
  const bool isRoot = comm_.rank() == root_;
  bytesSent_ = 0;
  std::vector<std::byte> described;
  comm_.together([&] {
    drop();
    if (isRoot) described = describe(pool, arrays);
  });
  described = comm_.broadcast(std::move(described), root_);
  comm_.together([&] {
    if (!isRoot) open(described);
  });
  if (isRoot) {
    // All ranks that can open the memory have done so.
    for (const Array& array : arrays_) array.access->memory()->unlink();
  }
}

gpu::Commands& Gather::nextTransfer() {
  if (transfersUsed_ == transfers_.size())
    transfers_.push_back(std::make_unique<gpu::Commands>(device_, gpu::QueueKind::Transfer));
  return *transfers_[transfersUsed_++];
}

void Gather::send(std::span<const Piece> pieces, const gpu::Submission& after) {
  gpu::Commands& transfer = nextTransfer();
  transfer.begin();
  transfer.waitFor(after);
  for (const Piece& piece : pieces) {
    const Array& array = arrays_[piece.array];
    Message message{piece, after};
    if (array.access != nullptr) {
      array.access->recordWrite(transfer, *piece.from, 0, array.at + piece.at, piece.bytes);
      message.piece.bytes = 0;
    }
    messages_.push_back(message);
    if (comm_.rank() != root_) bytesSent_ += piece.bytes;
  }
  transfer.submit();
}

void Gather::drop() {
  for (const std::unique_ptr<gpu::Commands>& transfer : transfers_) transfer->drop();
  for (const Array& array : arrays_) {
    if (array.access != nullptr) array.access->drop();
  }
  if (outbox_) outbox_->drop();
  transfersUsed_ = 0;
  messages_.clear();
  arrays_.clear();
}

/// Sends the pieces of ranks that cannot write to the root's memory: a description of each, then the bytes.
void Gather::sendMessages(std::span<const std::uint64_t> words) {
  const std::vector<std::uint64_t> all = comm_.allGatherWords(words);
  comm::Messages underWay(comm_);
  comm_.together([&] {
    for (std::size_t i = 0; i < all.size(); i += perMessage) {
      const bool own = i / words.size() == static_cast<std::size_t>(comm_.rank());
      if (own || comm_.rank() == root_) underWay.reserve(all[i + 2]);
    }
  });
  std::uint64_t outboxAt = 0;
  for (int r = 0; r < comm_.size(); ++r) {
    for (std::size_t i = 0; i < words.size(); i += perMessage) {
      const std::uint64_t* message = &all[static_cast<std::size_t>(r) * words.size() + i];
      const std::uint64_t bytes = message[2];
      if (bytes == 0) continue;
      if (comm_.rank() == root_) underWay.receive(r, {arrays_[message[0]].data + message[1], bytes});
      if (r == comm_.rank()) {
        underWay.send(root_, outbox_->memory()->bytes().subspan(outboxAt, bytes));
        outboxAt += bytes;
      }
    }
  }
  underWay.wait();
}

void Gather::finish() {
  std::uint64_t outboxBytes = 0;
  for (const Message& message : messages_) outboxBytes += message.piece.bytes;
  std::vector<std::uint64_t> words;
  comm_.together([&] {
    for (const Message& message : messages_)
      words.insert(words.end(), {message.piece.array, message.piece.at, message.piece.bytes});
    if (outboxBytes > 0) {
      if (!outbox_ || outbox_->memory()->bytes().size() < outboxBytes)
        outbox_ = std::make_unique<HostAccess>(device_, HostMemory::anonymous(outboxBytes + outboxBytes / 2));
      gpu::Commands& transfer = nextTransfer();
      transfer.begin();
      std::uint64_t at = 0;
      for (const Message& message : messages_) {
        transfer.waitFor(message.after);
        outbox_->recordWrite(transfer, *message.piece.from, 0, at, message.piece.bytes);
        at += message.piece.bytes;
      }
      transfer.submit();
    }
    for (const std::unique_ptr<gpu::Commands>& transfer : transfers_) transfer->wait();
    for (const Array& array : arrays_) {
      if (array.access != nullptr) array.access->finish();
    }
    if (outboxBytes > 0) outbox_->finish();
  });
  sendMessages(words);
  drop();
}

}  // namespace vdi::detail
