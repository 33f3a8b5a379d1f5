// What all ranks' devices have, in arrays of the root's host. Not part of the library's interface.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "vdi/comm/Communicator.h"
#include "vdi/comm/Exchange.h"
#include "vdi/gpu/Commands.h"
#include "vdi/pipeline/HostAccess.h"

namespace vdi::detail {

class Gather {
 public:
  Gather(std::shared_ptr<gpu::Device> device, const comm::Communicator& comm, comm::Transport transport,
         int root);

  /// `bytes` of a device's buffer go to byte `at` of the array-th array.
  struct Piece {
    const gpu::Buffer* from = nullptr;
    std::uint64_t array = 0;
    std::uint64_t at = 0;
    std::uint64_t bytes = 0;
  };
  /// Collective. `arrays`: on the root, the data of vectors that have their memory from `pool`; ignored
  /// elsewhere. All ranks pass as many pieces, which don't overlap; a piece may have no bytes. `before`
  /// records what's to be done on the device before they're copied.
  void run(HostPool& pool, std::span<void* const> arrays, std::span<const Piece> pieces,
           const std::function<void(gpu::Commands&)>& before);

  std::uint64_t bytesSent() const { return bytesSent_; }  // of the last run, to another rank

 private:
  struct Array;
  std::vector<Array> shareArrays(HostPool& pool, std::span<void* const> arrays);
  HostAccess& openedAccess(const std::string& name, std::uint64_t bytes);

  std::shared_ptr<gpu::Device> device_;
  const comm::Communicator& comm_;
  comm::Transport transport_;
  int root_;
  gpu::Commands commands_;
  std::map<std::string, std::unique_ptr<HostAccess>> opened_;  // memory of the root
  std::vector<std::string> recent_;                            // their names, the latest one last
  std::unique_ptr<HostAccess> outbox_;                         // of messages
  std::uint64_t bytesSent_ = 0;
};

}  // namespace vdi::detail
