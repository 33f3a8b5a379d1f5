// Pages of the process's memory that devices and other ranks of the same host can reach too.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

namespace vdi {

/// Whole pages, zero at first, that stay in place as long as the object lives. Its users share it; it can be
/// neither copied nor moved.
class HostMemory {
 public:
  /// Memory private to this process. Throws Error{OutOfMemory}.
  static std::shared_ptr<HostMemory> anonymous(std::uint64_t bytes);
  /// POSIX shared memory that other processes of the host can open by its name, from publish until unlink or
  /// the end of this object. All of it is allocated here: a host with too little shared memory throws
  /// Error{OutOfMemory} now instead of ending the process at a later write.
  static std::shared_ptr<HostMemory> shareable(std::uint64_t bytes);
  /// Shareable memory, already published.
  static std::shared_ptr<HostMemory> shared(std::uint64_t bytes);
  /// Memory that another process made shareable. Throws Error{Communication} if none has that name and size.
  static std::shared_ptr<HostMemory> open(const std::string& name, std::uint64_t bytes);

  ~HostMemory();
  HostMemory(const HostMemory&) = delete;
  HostMemory& operator=(const HostMemory&) = delete;
  HostMemory(HostMemory&&) = delete;
  HostMemory& operator=(HostMemory&&) = delete;

  std::span<std::byte> bytes() const { return bytes_; }  // at least as many as requested
  /// Unique on this host for all time; empty if other processes cannot open the memory.
  const std::string& name() const { return name_; }
  /// Lets other processes open the memory from now on; returns whether they can. Call it just before they do,
  /// since a process that is killed in between leaves the name and the memory behind. The first call in a
  /// process removes the leftovers of dead processes. Does nothing and returns false after unlink, and for
  /// memory that is not shareable.
  bool publish();
  /// Prevents processes from opening the memory from now on. Processes that have opened it keep it.
  void unlink();

 private:
  HostMemory() = default;
  std::span<std::byte> bytes_;
  std::string name_;
  int descriptor_ = -1;  // exists for shareable memory, until unlink; its lock shows that this process lives
  bool linked_ = false;  // the name exists, and this object has to unlink it
};

}  // namespace vdi
