// What a device can.
#pragma once

#include <array>
#include <cstdint>

namespace vdi::gpu {

struct DeviceLimits {
  std::uint64_t memoryBytes = 0;  // of the largest device-local heap
  /// The most that's worth asking for in one allocation: the larger of maxMemoryAllocationSize and
  /// maxBufferSize, at most memoryBytes. The driver may still refuse it.
  std::uint64_t maxAllocationBytes = 0;
  std::uint64_t maxBufferBytes = 0;
  std::uint32_t maxImageDimension3D = 0;
  std::array<std::uint32_t, 3> maxGroups{};  // of one dispatch, per axis
  float timestampPeriodNs = 0.0F;
  std::uint32_t timestampBits = 0;  // the low ones that count; the clock wraps around
  /// What the start and the size of host memory that's imported must be multiples of; 0: the device can't.
  std::uint64_t hostPointerAlignment = 0;
  /// Invocations of a subgroup, for compute shaders whose subgroups vote and add up: they can be told to have
  /// just that many (ComputePipelineInfo::wholeSubgroups), 32 at most. 0 if they can't.
  std::uint32_t subgroupSize = 0;
  // Features that are turned on where the device has them.
  bool shaderFloat16 = false;
  bool storage16Bit = false;  // storageBuffer16BitAccess
  bool storage8Bit = false;   // storageBuffer8BitAccess
};

}  // namespace vdi::gpu
