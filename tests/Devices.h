// The devices of tests.
#pragma once

#include <array>
#include <memory>
#include <mutex>

#include "vdi/gpu/Device.h"

namespace vdi::test {

/// The devices that device() keeps. runCases (Main.h) drops them before it returns, because the
/// validation layer frees state of its own at the program's exit, and can't close a device afterwards.
inline std::array<std::shared_ptr<gpu::Device>, 2>& keptDevices() {
  static std::array<std::shared_ptr<gpu::Device>, 2> kept;
  return kept;
}

/// The environment's device, with the validation layers, for all tests of a program. With `gpuPrograms`, a
/// second device, which runs the programs for GPUs. Thread-safe.
inline std::shared_ptr<gpu::Device> device(bool gpuPrograms = false) {
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  std::shared_ptr<gpu::Device>& kept = keptDevices()[gpuPrograms ? 1 : 0];
  if (kept == nullptr) {
    gpu::DeviceRequest request = gpu::requestFromEnvironment(0);
    request.validation = true;
    request.gpuPrograms = gpuPrograms;
    kept = gpu::Device::create(request);
  }
  return kept;
}

}  // namespace vdi::test
