// The devices of tests.
#pragma once

#include <memory>

#include "vdi/gpu/Device.h"

namespace vdi::test {

/// The environment's device, with the validation layers. `gpuPrograms`: does as a GPU does.
inline std::shared_ptr<gpu::Device> makeDevice(bool gpuPrograms = false) {
  gpu::DeviceRequest request = gpu::requestFromEnvironment(0);
  request.validation = true;
  request.gpuPrograms = gpuPrograms;
  return gpu::Device::create(request);
}

/// One for all tests of a program.
inline std::shared_ptr<gpu::Device> device() {
  static const std::shared_ptr<gpu::Device> instance = makeDevice();
  return instance;
}

}  // namespace vdi::test
