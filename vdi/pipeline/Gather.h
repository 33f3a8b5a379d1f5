// What all ranks' devices have, in arrays of the root's host. Not part of the library's interface.
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

/// Another rank's memory that this rank's device writes to. A name can be opened just for a while, so what
/// was opened stays as long as the other rank has it.
class OpenedMemory {
 public:
  explicit OpenedMemory(std::shared_ptr<gpu::Device> device) : device_(std::move(device)) {}
  HostAccess& of(const std::string& name, std::uint64_t bytes);
  /// Forgets all but these.
  void keep(const std::vector<std::string>& names);

 private:
  std::shared_ptr<gpu::Device> device_;
  std::map<std::string, std::unique_ptr<HostAccess>> accesses_;
};

class Gather {
 public:
  /// `opened` is shared by all whose arrays come from one pool.
  Gather(std::shared_ptr<gpu::Device> device, const comm::Communicator& comm, comm::Transport transport,
         int root, std::shared_ptr<OpenedMemory> opened);

  /// `bytes` of a device's buffer go to byte `at` of the array-th array.
  struct Piece {
    const gpu::Buffer* from = nullptr;
    std::uint64_t array = 0;
    std::uint64_t at = 0;
    std::uint64_t bytes = 0;
  };
  /// Collective. `arrays`: on the root, the memory of vectors that have it from `pool`; ignored elsewhere.
  /// They must stay until finish, or until all ranks have called drop.
  void begin(HostPool& pool, std::span<const std::span<std::byte>> arrays);
  /// The array's bytes, on any rank.
  std::uint64_t room(std::size_t array) const { return arrays_[array].bytes; }
  /// Sends pieces on their way, by the transfer queue, behind `after`, which has written them. All ranks pass
  /// as many pieces in each call, which don't overlap; a piece may have no bytes. What they're taken from
  /// must stay until finish.
  void send(std::span<const Piece> pieces, const gpu::Submission& after);
  /// Collective: when it returns, all pieces of all ranks are there.
  void finish();
  /// Waits for what's under way, and drops the rest.
  void drop();

  std::uint64_t bytesSent() const { return bytesSent_; }  // since begin, to another rank

 private:
  /// Of the root, as this rank's device sees it.
  struct Array {
    HostAccess* access = nullptr;  // null: by messages
    std::uint64_t at = 0;
    std::uint64_t bytes = 0;
    std::byte* data = nullptr;  // on the root
  };
  /// A piece that was sent, as its message: without bytes if the device has written them.
  struct Message {
    Piece piece;
    gpu::Submission after;
  };
  std::vector<std::byte> describe(HostPool& pool, std::span<const std::span<std::byte>> arrays);
  void open(std::span<const std::byte> described);
  gpu::Commands& nextTransfer();
  void sendMessages();

  std::shared_ptr<gpu::Device> device_;
  const comm::Communicator& comm_;
  comm::Transport transport_;
  int root_;
  std::vector<std::unique_ptr<gpu::Commands>> transfers_;
  std::size_t transfersUsed_ = 0;
  std::vector<Array> arrays_;
  std::vector<Message> messages_;
  std::shared_ptr<OpenedMemory> opened_;  // of the root
  std::unique_ptr<HostAccess> outbox_;    // of messages
  std::uint64_t bytesSent_ = 0;
};

}  // namespace vdi::detail
