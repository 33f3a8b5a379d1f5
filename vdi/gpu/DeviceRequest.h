// The caller's requirements for a device.
#pragma once

#include <cstdint>
#include <string>

namespace vdi::gpu {

struct DeviceRequest {
  /// Index (as `vdi info --devices` lists them) or part of the name, case-insensitive; a number is
  /// always an index. Empty: all devices. The best match is used; localRank distributes ranks over equally
  /// good ones.
  std::string selector;
  int localRank = 0;        // rank among the ranks of this node
  bool validation = false;  // VK_LAYER_KHRONOS_validation; every message of severity warning or error is kept
  /// Runs the programs that are fastest on GPUs on a CPU too, to test them there; see
  /// Device::runsGpuPrograms.
  bool gpuPrograms = false;
  /// A limit below the device's own, to test cutting into pieces; 0: the device's.
  std::uint32_t maxImageDimension3D = 0;
  /// The most bytes that the device's buffers and images may hold together; 0: as many as the driver allows.
  std::uint64_t mostBytes = 0;
  /// False: behaves as a device that cannot import the process's memory, to test the alternative.
  bool importsHostMemory = true;
  /// The folder that keeps compiled shaders from run to run; empty: no shaders are kept.
  std::string cacheFolder;
};

/// The request from this process's environment: VDI_DEVICE is the selector, VDI_VALIDATION=1 enables
/// validation, and VDI_CACHE is the cache's folder ("off": none; unset: pv-vdi in the user's folder for
/// caches). Throws Error{InvalidArgument} if VDI_VALIDATION is neither 0 nor 1. Not collective.
DeviceRequest requestFromEnvironment(int localRank);

}  // namespace vdi::gpu
