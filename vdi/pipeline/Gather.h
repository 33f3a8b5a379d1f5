// Gathers data from all ranks' devices into arrays on the root's host. Not part of the library's interface.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "vdi/comm/Communicator.h"
#include "vdi/comm/Exchange.h"
#include "vdi/gpu/Commands.h"
#include "vdi/pipeline/HostAccess.h"

namespace vdi::detail {

/// Memory of another rank that this rank's device writes to. A name can be opened only for a while, so opened
/// memory stays as long as the other rank has it.
class OpenedMemory {
 public:
  explicit OpenedMemory(std::shared_ptr<gpu::Device> device) : device_(std::move(device)) {}
  HostAccess& of(const std::string& name, std::uint64_t bytes);
  /// Forgets all memory except that of these names.
  void keep(const std::vector<std::string>& names);

 private:
  std::shared_ptr<gpu::Device> device_;
  std::map<std::string, std::unique_ptr<HostAccess>> accesses_;
};

class Gather {
 public:
  /// All gathers whose arrays come from one pool share `opened`.
  Gather(std::shared_ptr<gpu::Device> device, const comm::Communicator& comm, comm::Transport transport,
         int root, std::shared_ptr<OpenedMemory> opened);

  /// `bytes` of a device's buffer, to be written from byte `at` of array number `array` on.
  struct Piece {
    const gpu::Buffer* from = nullptr;
    std::uint64_t array = 0;
    std::uint64_t at = 0;
    std::uint64_t bytes = 0;
  };
  /// Collective. `arrays` are, on the root, the memory of vectors that come from `pool`; other ranks' are
  /// ignored. They must stay until finish, or until all ranks have called drop.
  void begin(HostPool& pool, std::span<const std::span<std::byte>> arrays);
  /// The array's size in bytes, on any rank.
  std::uint64_t room(std::size_t array) const { return arrays_[array].bytes; }
  /// Sends pieces by the transfer queue, after the submission `after`, which writes them. All ranks pass the
  /// same number of pieces in each call; pieces do not overlap, and may be empty. Their buffers must stay
  /// until finish.
  void send(std::span<const Piece> pieces, const gpu::Submission& after);
  /// Collective: when this returns, all pieces of all ranks have arrived.
  void finish();
  /// Waits for pieces under way and drops the rest.
  void drop();

  std::uint64_t bytesSent() const { return bytesSent_; }  // since begin, to another rank

 private:
  /// An array of the root, as this rank's device accesses it.
  struct Array {
    HostAccess* access = nullptr;  // null: sent by messages
    std::uint64_t at = 0;
    std::uint64_t bytes = 0;
    std::byte* data = nullptr;  // on the root
  };
  /// A sent piece as a message; it has no bytes if the device wrote them.
  struct Message {
    Piece piece;
    gpu::Submission after;
  };
  std::vector<std::byte> describe(HostPool& pool, std::span<const std::span<std::byte>> arrays);
  void open(std::span<const std::byte> described);
  gpu::Commands& nextTransfer();
  static constexpr std::size_t perMessage = 3;  // words that describe a message
  void sendMessages(std::span<const std::uint64_t> words);

  std::shared_ptr<gpu::Device> device_;
  const comm::Communicator& comm_;
  comm::Transport transport_;
  int root_;
  std::vector<std::unique_ptr<gpu::Commands>> transfers_;
  std::size_t transfersUsed_ = 0;
  std::vector<Array> arrays_;
  std::vector<Message> messages_;
  std::shared_ptr<OpenedMemory> opened_;  // the root's
  std::unique_ptr<HostAccess> outbox_;    // memory for messages
  std::uint64_t bytesSent_ = 0;
};

}  // namespace vdi::detail
