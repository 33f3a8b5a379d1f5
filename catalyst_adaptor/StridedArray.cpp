#include "catalyst_adaptor/StridedArray.h"

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <new>
#include <stdexcept>
#include <string>

#include "vdi/core/Strides.h"

namespace vdi::catalyst {

namespace {

/// Whether neither a row nor the components of its values have gaps.
bool rowInOrder(const StridedValues& values) {
  const auto scalar = static_cast<std::int64_t>(values.scalarBytes);
  return (values.components == 1 || values.componentStride == scalar) &&
         (values.counts[0] == 1 || values.strides[0] == scalar * values.components);
}

}  // namespace

bool StridedValues::inOrder() const {
  std::int64_t next = static_cast<std::int64_t>(scalarBytes) * components;
  bool in = rowInOrder(*this) && reinterpret_cast<std::uintptr_t>(first) % scalarBytes == 0;
  for (std::size_t axis = 1; axis < 3; ++axis) {
    next *= counts[axis - 1];
    in = in && (counts[axis] == 1 || strides[axis] == next);
  }
  return in;
}

std::optional<MemoryRange> StridedValues::extent() const {
  std::int64_t lowest = 0;
  std::int64_t highest = 0;
  const auto add = [&](std::int64_t count, std::int64_t stride) {
    std::int64_t reach = 0;
    if (__builtin_mul_overflow(count - 1, stride, &reach)) return false;
    std::int64_t& end = reach < 0 ? lowest : highest;
    return !__builtin_add_overflow(end, reach, &end);
  };
  const auto address = reinterpret_cast<std::uintptr_t>(first);
  if (!add(counts[0], strides[0]) || !add(counts[1], strides[1]) || !add(counts[2], strides[2]) ||
      !add(components, componentStride))
    return std::nullopt;
  const std::uintptr_t below = 0 - static_cast<std::uintptr_t>(lowest);
  const std::uintptr_t above = static_cast<std::uintptr_t>(highest) + scalarBytes;
  if (below > address || above > std::numeric_limits<std::uintptr_t>::max() - address) return std::nullopt;
  return MemoryRange{first + lowest, below + above};
}

void StridedValues::copyTo(std::byte* to) const {
  const auto scalar = static_cast<std::int64_t>(scalarBytes);
  const ByteStrides from{strides[0], strides[1], strides[2]};
  glm::ivec3 size(counts[0], counts[1], counts[2]);
  if (rowInOrder(*this) && counts[0] * components <= std::numeric_limits<int>::max()) {
    size.x *= components;
    copyStrided(first, {scalar, from.y, from.z}, to, packedStrides(size, scalarBytes), size, scalarBytes);
    return;
  }
  const ByteStrides packed = packedStrides(size, scalarBytes) * std::int64_t{components};
  for (int c = 0; c < components; ++c)
    copyStrided(first + c * componentStride, from, to + c * scalar, packed, size, scalarBytes);
}

StridedArray::StridedArray(const StridedValues& values) : values_(values) {
  assert(values.reachable());
  const std::size_t bytes = values.bytes();
  // VTK's own allocation is unsuitable: when it fails, Debian's VTK ends the process.
  memory_.reset(new (std::nothrow) std::byte[bytes]);
  if (!memory_) throw std::runtime_error("no memory to gather an array: " + std::to_string(bytes) + " bytes");
}

void StridedArray::gather() {
  values_.copyTo(memory_.get());
}

}  // namespace vdi::catalyst
