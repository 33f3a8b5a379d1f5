// Pages of the process's memory that others may reach too: devices, and the ranks of the same host.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

namespace vdi {

/// Whole pages, zero at first, that stay where they are until the object goes. Neither copied nor moved:
/// shared by those who use them.
class HostMemory {
 public:
  /// Of this process alone. Throws Error{OutOfMemory}.
  static std::shared_ptr<HostMemory> anonymous(std::uint64_t bytes);
  /// What other processes of the host can open by its name (POSIX shared memory), from publish until unlink
  /// or the end of this object. All of it is there at once: a host with too little room for shared memory
  /// throws Error{OutOfMemory} here, and doesn't end the process later.
  static std::shared_ptr<HostMemory> shareable(std::uint64_t bytes);
  /// shareable, published.
  static std::shared_ptr<HostMemory> shared(std::uint64_t bytes);
  /// What another process made by shared(). Throws Error{Communication} if there's none of that name and
  /// size.
  static std::shared_ptr<HostMemory> open(const std::string& name, std::uint64_t bytes);

  ~HostMemory();
  HostMemory(const HostMemory&) = delete;
  HostMemory& operator=(const HostMemory&) = delete;
  HostMemory(HostMemory&&) = delete;
  HostMemory& operator=(HostMemory&&) = delete;

  std::span<std::byte> bytes() const { return bytes_; }  // at least as many as were asked for
  /// Of no other memory of this host, ever; empty: others can't open it.
  const std::string& name() const { return name_; }
  /// Whether others can open it from now on. To be called just before they do, since a process that is killed
  /// in between leaves the name and the memory behind. The first call in a process removes what dead
  /// processes have left. False, and nothing is done, after unlink and for memory that isn't shareable.
  bool publish();
  /// Nobody can open it from now on; those who have keep it.
  void unlink();

 private:
  HostMemory() = default;
  std::span<std::byte> bytes_;
  std::string name_;
  int descriptor_ = -1;  // of shareable memory, until unlink: locked, which tells that this process lives
  bool linked_ = false;  // and it's ours to unlink
};

}  // namespace vdi
