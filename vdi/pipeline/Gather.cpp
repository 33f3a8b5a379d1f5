#include "vdi/pipeline/Gather.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <functional>

namespace vdi::detail {

namespace {

constexpr std::size_t nameBytes = 64;

/// What the root says about an array.
struct ArrayHeader {
  std::array<char, nameBytes> memory{};  // empty: others can't open it
  std::uint64_t memoryBytes = 0;
  std::uint64_t at = 0;
};

}  // namespace

struct Gather::Array {
  HostAccess* access = nullptr;  // null: by messages
  std::uint64_t at = 0;
};

Gather::Gather(std::shared_ptr<gpu::Device> device, const comm::Communicator& comm, comm::Transport transport,
               int root)
    : device_(std::move(device)), comm_(comm), transport_(transport), root_(root), commands_(device_) {}

HostAccess& Gather::openedAccess(const std::string& name, std::uint64_t bytes) {
  constexpr std::size_t maxCount = 8;  // arrays of a few frames
  std::erase(recent_, name);
  recent_.push_back(name);
  if (recent_.size() > maxCount) {
    opened_.erase(recent_.front());
    recent_.erase(recent_.begin());
  }
  std::unique_ptr<HostAccess>& access = opened_[name];
  if (!access) access = std::make_unique<HostAccess>(device_, HostMemory::open(name, bytes));
  return *access;
}

/// Where this rank's device writes each array to.
std::vector<Gather::Array> Gather::shareArrays(HostPool& pool, std::span<void* const> arrays) {
  const bool isRoot = comm_.rank() == root_;
  std::vector<Array> result;
  std::vector<std::byte> bytes;
  if (isRoot) {
    for (const void* data : arrays) {
      const HostPool::Place place = pool.placeOf(data);
      ArrayHeader header;
      const HostMemory& memory = *place.access->memory();
      std::copy(memory.name().begin(), memory.name().end(), header.memory.begin());
      header.memoryBytes = memory.bytes().size();
      header.at = place.at;
      const auto* begin = reinterpret_cast<const std::byte*>(&header);
      bytes.insert(bytes.end(), begin, begin + sizeof(header));
      result.push_back({place.access, place.at});
    }
  }
  bytes = comm_.broadcast(std::move(bytes), root_);
  if (isRoot) return result;
  const bool here =
      transport_ == comm::Transport::Shared && comm_.hostLeader(root_) == comm_.hostLeader(comm_.rank());
  result.resize(bytes.size() / sizeof(ArrayHeader));
  for (std::size_t i = 0; i < result.size(); ++i) {
    ArrayHeader header;
    std::memcpy(&header, bytes.data() + i * sizeof(header), sizeof(header));
    if (!here || header.memory.front() == '\0') continue;
    result[i] = {&openedAccess(header.memory.data(), header.memoryBytes), header.at};
  }
  return result;
}

void Gather::run(HostPool& pool, std::span<void* const> arrays, std::span<const Piece> pieces,
                 const std::function<void(gpu::Commands&)>& before) {
  const bool isRoot = comm_.rank() == root_;
  bytesSent_ = 0;
  std::vector<Array> targets;
  std::exception_ptr error;
  try {
    targets = shareArrays(pool, arrays);
  } catch (...) {
    error = std::current_exception();
  }
  comm_.agree(error);

  // The pieces of those who can't write there come as messages: what, and then the bytes.
  std::vector<std::uint64_t> messages;  // of this rank: array, at, bytes
  std::uint64_t messageBytes = 0;
  for (const Piece& piece : pieces) {
    const bool asMessage = targets[piece.array].access == nullptr;
    messages.insert(messages.end(), {piece.array, piece.at, asMessage ? piece.bytes : 0});
    if (asMessage) messageBytes += piece.bytes;
    if (!isRoot) bytesSent_ += piece.bytes;
  }
  comm_.together([&] {
    if (messageBytes > 0 && (!outbox_ || outbox_->memory()->bytes().size() < messageBytes)) {
      outbox_ = std::make_unique<HostAccess>(device_, HostMemory::anonymous(messageBytes + messageBytes / 2));
    }
    commands_.begin();
    if (before) before(commands_);
    commands_.barrier();
    std::uint64_t outboxAt = 0;
    for (const Piece& piece : pieces) {
      const Array& target = targets[piece.array];
      if (target.access != nullptr) {
        target.access->recordWrite(commands_, *piece.from, 0, target.at + piece.at, piece.bytes);
      } else {
        outbox_->recordWrite(commands_, *piece.from, 0, outboxAt, piece.bytes);
        outboxAt += piece.bytes;
      }
    }
    commands_.submitAndWait();
    for (const Array& target : targets) {
      if (target.access != nullptr) target.access->finish();
    }
    if (outboxAt > 0) outbox_->finish();
  });

  const std::vector<std::uint64_t> all = comm_.allGatherWords(messages);
  comm::Messages underWay(comm_);
  constexpr std::size_t words = 3;
  const std::size_t perRank = messages.size();
  std::uint64_t outboxAt = 0;
  for (int r = 0; r < comm_.size(); ++r) {
    for (std::size_t i = 0; i < perRank; i += words) {
      const std::uint64_t* message = &all[static_cast<std::size_t>(r) * perRank + i];
      const std::uint64_t bytes = message[2];
      if (bytes == 0) continue;
      if (isRoot) underWay.receive(r, {static_cast<std::byte*>(arrays[message[0]]) + message[1], bytes});
      if (r == comm_.rank()) {
        underWay.send(root_, outbox_->memory()->bytes().subspan(outboxAt, bytes));
        outboxAt += bytes;
      }
    }
  }
  underWay.wait();
  if (isRoot) {
    for (const Array& target : targets) target.access->memory()->unlink();  // those who can have opened it
  }
}

}  // namespace vdi::detail
