#include "vdi/gpu/DeviceChoice.h"

#include <fmt/format.h>
#include <fmt/ranges.h>  // fmt::join

#include <algorithm>
#include <cctype>

#include "vdi/core/Error.h"

namespace vdi::gpu {

namespace {

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

const char* typeName(DeviceType type) {
  switch (type) {
    case DeviceType::Discrete:
      return "discrete";
    case DeviceType::Integrated:
      return "integrated";
    case DeviceType::Virtual:
      return "virtual";
    case DeviceType::Cpu:
      return "CPU";
    default:
      return "other";
  }
}

/// A number is an index: as part of a name, "7" would select a device by its driver's version.
bool selected(const DeviceSummary& device, std::size_t index, const std::string& selector) {
  if (selector.empty()) return true;
  if (std::all_of(selector.begin(), selector.end(), [](unsigned char c) { return std::isdigit(c) != 0; })) {
    return std::to_string(index) == selector;
  }
  return lower(device.name).find(lower(selector)) != std::string::npos;
}

}  // namespace

std::string describeDevices(std::span<const DeviceSummary> devices) {
  if (devices.empty()) return "there is no Vulkan device: no driver (ICD) is installed or visible\n";
  std::string text;
  for (std::size_t i = 0; i < devices.size(); ++i) {
    const DeviceSummary& d = devices[i];
    text += fmt::format("{}: {} ({}, {}, {} MiB): {}\n", i, d.name, typeName(d.type), d.driver,
                        d.memoryBytes >> 20,
                        d.refusals.empty() ? "usable" : fmt::format("{}", fmt::join(d.refusals, ", ")));
  }
  return text;
}

std::size_t chooseDevice(std::span<const DeviceSummary> devices, const DeviceRequest& request) {
  std::vector<std::size_t> best;
  for (std::size_t i = 0; i < devices.size(); ++i) {
    if (!devices[i].refusals.empty() || !selected(devices[i], i, request.selector)) continue;
    if (!best.empty()) {
      const DeviceType before = devices[best.front()].type;
      if (devices[i].type < before) continue;
      if (devices[i].type > before) best.clear();
    }
    best.push_back(i);
  }
  if (best.empty()) {
    const std::string wanted =
        request.selector.empty() ? "" : fmt::format(" that matches VDI_DEVICE='{}'", request.selector);
    throw Error(ErrorCode::DeviceUnavailable, fmt::format("no usable Vulkan device{}; the devices are:\n{}",
                                                          wanted, describeDevices(devices)));
  }
  return best[static_cast<std::size_t>(std::max(request.localRank, 0)) % best.size()];
}

}  // namespace vdi::gpu
