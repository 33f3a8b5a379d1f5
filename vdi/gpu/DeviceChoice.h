// The choice among a machine's devices: the part of Device::create that is independent of Vulkan.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "vdi/gpu/DeviceRequest.h"

namespace vdi::gpu {

/// In order of preference, the best last.
enum class DeviceType { Other, Cpu, Virtual, Integrated, Discrete };

struct DeviceSummary {
  std::string name;
  DeviceType type = DeviceType::Other;
  std::string driver;                 // name and version
  std::uint64_t memoryBytes = 0;      // size of the largest device-local heap
  std::vector<std::string> refusals;  // all requirements that it doesn't meet; empty: usable
};

/// Returns a line per device: index, name, type, driver, memory, "usable" or the reason why it is not.
/// Without devices, returns one line that says so.
std::string describeDevices(std::span<const DeviceSummary> devices);

/// Index of the requested device; DeviceRequest and Device::create have the rules. Throws
/// Error{DeviceUnavailable} with the text of describeDevices.
std::size_t chooseDevice(std::span<const DeviceSummary> devices, const DeviceRequest& request);

}  // namespace vdi::gpu
