#include "catalyst_adaptor/memory/ReadableMemory.h"

#include <algorithm>
#include <array>
#include <cinttypes>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <memory>
#include <numeric>
#include <utility>

namespace vdi::catalyst {

namespace {

struct Close {
  void operator()(std::FILE* file) const { std::fclose(file); }
};

}  // namespace

std::optional<std::size_t> firstUnreadable(const std::vector<MemoryRange>& ranges) {
  std::vector<std::size_t> order(ranges.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, {}, [&](std::size_t i) { return ranges[i].first(); });
  const std::unique_ptr<std::FILE, Close> maps(std::fopen("/proc/self/maps", "re"));
  if (!maps) return std::nullopt;
  auto next = order.begin();
  std::uintptr_t low = 0;  // addresses from here to `high` are readable
  std::uintptr_t high = 0;
  std::array<char, 512> line{};
  bool isWhole = true;  // false: the rest of a long line comes
  while (next != order.end() && std::fgets(line.data(), line.size(), maps.get()) != nullptr) {
    const bool isBegin = std::exchange(isWhole, std::strchr(line.data(), '\n') != nullptr);
    std::uintptr_t from = 0;
    std::uintptr_t to = 0;
    char access = '-';
    if (!isBegin || std::sscanf(line.data(), "%" SCNxPTR "-%" SCNxPTR " %c", &from, &to, &access) != 3)
      continue;
    if (access != 'r') continue;
    if (from != high) low = from;
    high = to;
    for (; next != order.end(); ++next) {
      const MemoryRange& range = ranges[*next];
      if (range.first() < low) return *next;
      if (range.first() + range.bytes > high) break;  // the next mapping may continue this one
    }
  }
  return next != order.end() ? std::optional(*next) : std::nullopt;
}

}  // namespace vdi::catalyst
