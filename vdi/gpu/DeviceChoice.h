// Which of a machine's devices to use: the part of Device::create that has nothing to do with Vulkan.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "vdi/gpu/DeviceRequest.h"

namespace vdi::gpu {

/// The later, the better.
enum class DeviceType { Other, Cpu, Virtual, Integrated, Discrete };

struct DeviceSummary {
  std::string name;
  DeviceType type = DeviceType::Other;
  std::string driver;                 // name and version
  std::uint64_t memoryBytes = 0;      // of the largest device-local heap
  std::vector<std::string> refusals;  // everything that's required and missing; empty: usable
};

/// A line per device: index, name, type, driver, memory, "usable" or why not. One line that says so when
/// there's no device.
std::string describeDevices(std::span<const DeviceSummary> devices);

/// Index of the device that the request asks for; see DeviceRequest and Device::create for the rules. Throws
/// Error{DeviceUnavailable} with describeDevices' text.
std::size_t chooseDevice(std::span<const DeviceSummary> devices, const DeviceRequest& request);

}  // namespace vdi::gpu
