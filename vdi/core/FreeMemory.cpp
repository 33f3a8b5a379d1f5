#include "vdi/core/FreeMemory.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <limits>
#include <optional>
#include <string>

#include "vdi/core/Error.h"

namespace vdi {

namespace {

constexpr std::uint64_t unlimited = std::numeric_limits<std::uint64_t>::max();

/// The number in a file that has nothing else.
std::optional<std::uint64_t> numberIn(const char* path) {
  std::ifstream file(path);
  std::uint64_t number = 0;
  if (!(file >> number)) return std::nullopt;
  return number;
}

std::uint64_t ofMachine() {
  constexpr std::uint64_t kibibyte = 1024;
  std::ifstream file("/proc/meminfo");
  std::string name;
  std::uint64_t number = 0;
  for (std::string unit; file >> name >> number; std::getline(file, unit)) {
    if (name == "MemAvailable:") return number * kibibyte;
  }
  return unlimited;
}

/// The number after a name in a file of lines; 0 if there is none.
std::uint64_t numberOf(const char* path, const std::string& wanted) {
  std::ifstream file(path);
  std::string name;
  std::uint64_t number = 0;
  while (file >> name >> number) {
    if (name == wanted) return number;
  }
  return 0;
}

/// What the control group at the root of a container may take, of version 2 or 1. The system gives up copies
/// of files that are in no use.
std::uint64_t ofControlGroup() {
  auto limit = numberIn("/sys/fs/cgroup/memory.max");
  auto used = numberIn("/sys/fs/cgroup/memory.current");
  std::uint64_t files = numberOf("/sys/fs/cgroup/memory.stat", "inactive_file");
  if (!limit || !used) {
    limit = numberIn("/sys/fs/cgroup/memory/memory.limit_in_bytes");
    used = numberIn("/sys/fs/cgroup/memory/memory.usage_in_bytes");
    files = numberOf("/sys/fs/cgroup/memory/memory.stat", "total_inactive_file");
  }
  if (!limit || !used) return unlimited;
  return *limit - std::min(*limit, *used - std::min(*used, files));
}

}  // namespace

std::uint64_t availableHostBytes() {
  return std::min(ofMachine(), ofControlGroup());
}

void requireHostBytes(std::uint64_t bytes, const char* what) {
  constexpr std::uint64_t little = std::uint64_t{64} << 20U;
  constexpr double gibibyte = 1024.0 * 1024.0 * 1024.0;
  if (bytes < little) return;
  const std::uint64_t available = availableHostBytes();
  if (bytes <= available) return;
  throw Error(ErrorCode::OutOfMemory,
              fmt::format("{} takes {:.1f} GiB of memory, of which {:.1f} GiB are available", what,
                          static_cast<double>(bytes) / gibibyte, static_cast<double>(available) / gibibyte));
}

}  // namespace vdi
