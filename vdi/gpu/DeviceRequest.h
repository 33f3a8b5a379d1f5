// What somebody asks of a device.
#pragma once

#include <cstdint>
#include <string>

namespace vdi::gpu {

struct DeviceRequest {
  /// Index (as `vdi info --devices` lists them) or part of the name, case-insensitive; digits alone are
  /// always an index. Empty: all devices. The best of those is used; equal ones are dealt out by localRank.
  std::string selector;
  int localRank = 0;        // rank among the ranks of this node
  bool validation = false;  // VK_LAYER_KHRONOS_validation; every message of severity warning or error is kept
  /// Runs what's the fastest on GPUs on a CPU too, so that it can be tested there; see
  /// Device::runsGpuPrograms.
  bool gpuPrograms = false;
  /// A smaller limit than the device's own, so that what is cut to fit can be tested; 0: the device's.
  std::uint32_t maxImageDimension3D = 0;
  /// False: as a device that can't import the process's memory, so that what goes without it can be tested.
  bool importsHostMemory = true;
};

/// The request that the environment asks for: VDI_DEVICE is the selector, VDI_VALIDATION=1 turns validation
/// on.
DeviceRequest requestFromEnvironment(int localRank);

}  // namespace vdi::gpu
