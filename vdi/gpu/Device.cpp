#include "vdi/gpu/Device.h"

#include <algorithm>
#include <utility>

#include "vdi/gpu/DeviceCandidate.h"
#include "vdi/gpu/Instance.h"
#include "vdi/gpu/VulkanDevice.h"

namespace vdi::gpu {

namespace {

DeviceCandidate choose(const Instance& instance, const DeviceRequest& request) {
  DeviceCandidate chosen = chooseDevice(instance.candidates(), request);
  if (!request.importsHostMemory) chosen.limits.hostPointerAlignment = 0;
  DeviceLimits& limits = chosen.limits;
  limits.mostBytes = request.mostBytes;
  if (request.mostBytes > 0) {
    limits.memoryBytes = std::min(limits.memoryBytes, request.mostBytes);
    limits.maxAllocationBytes = std::min(limits.maxAllocationBytes, request.mostBytes);
  }
  if (request.maxImageDimension3D > 0) {
    limits.maxImageDimension3D = std::min(limits.maxImageDimension3D, request.maxImageDimension3D);
  }
  return chosen;
}

}  // namespace

struct Device::State {
  explicit State(const DeviceRequest& request)
      : instance(request.validation),
        candidate(choose(instance, request)),
        vulkan(instance, candidate, request.cacheFolder),
        cpu(candidate.type == DeviceType::Cpu),
        gpuPrograms(!cpu || request.gpuPrograms) {}

  Instance instance;
  DeviceCandidate candidate;
  VulkanDevice vulkan;
  bool cpu;
  bool gpuPrograms;
};

std::string Device::describeAll() {
  return describeDevices(Instance(false).candidates());
}

std::shared_ptr<Device> Device::create(const DeviceRequest& request) {
  return std::shared_ptr<Device>(new Device(std::make_unique<State>(request)));
}

Device::Device(std::unique_ptr<State> state) : state_(std::move(state)) {}

Device::~Device() = default;

const std::string& Device::name() const {
  return state_->candidate.name;
}
bool Device::isCpu() const {
  return state_->cpu;
}
bool Device::runsGpuPrograms() const {
  return state_->gpuPrograms;
}
const DeviceLimits& Device::limits() const {
  return state_->candidate.limits;
}
bool Device::isLost() const {
  return state_->vulkan.isLost();
}
std::uint64_t Device::allocatedBytes() const {
  return state_->vulkan.allocatedBytes();
}
std::uint32_t Device::validationMessageCount() const {
  return state_->instance.messages().count();
}
std::string Device::validationMessages() const {
  return state_->instance.messages().text();
}
VulkanDevice& Device::vulkan() const {
  return state_->vulkan;
}

}  // namespace vdi::gpu
