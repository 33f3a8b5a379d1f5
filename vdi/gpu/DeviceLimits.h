// A device's limits and optional features.
#pragma once

#include <array>
#include <cstdint>

namespace vdi::gpu {

struct DeviceLimits {
  /// Bytes of the largest device-local heap, or `mostBytes` if that is less. Frames are cut into bands
  /// accordingly.
  std::uint64_t memoryBytes = 0;
  std::uint64_t mostBytes = 0;  // the most that buffers and images may hold; 0: as the driver allows
  /// The largest reasonable allocation: the larger of maxMemoryAllocationSize and maxBufferSize, at most
  /// memoryBytes. The driver may still refuse it.
  std::uint64_t maxAllocationBytes = 0;
  std::uint64_t maxBufferBytes = 0;
  std::uint32_t maxImageDimension3D = 0;
  std::array<std::uint32_t, 3> maxGroups{};  // limit on the workgroups of one dispatch, per axis
  float timestampPeriodNs = 0.0F;
  std::uint32_t timestampBits = 0;  // number of valid low bits; the clock wraps around
  /// Required alignment of the start and the size of imported host memory; 0: the device cannot import any.
  std::uint64_t hostPointerAlignment = 0;
  /// Invocations of a subgroup, for compute shaders that need subgroup votes and sums and exactly that size,
  /// 32 at most. 0 if the device does not support this.
  std::uint32_t subgroupSize = 0;
  // Features that are enabled if the device has them.
  bool shaderFloat16 = false;
  bool storage16Bit = false;  // storageBuffer16BitAccess
  bool storage8Bit = false;   // storageBuffer8BitAccess
  /// Whether shaders store texels of all formats of 3-D images, and compute with doubles.
  bool storesTexels = false;
};

}  // namespace vdi::gpu
