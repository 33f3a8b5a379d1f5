// The process's entry to Vulkan: its devices, and what the validation layer says about the one that's opened.
#pragma once

#include <vulkan/vulkan.h>

#include <cstdint>
#include <mutex>
#include <string>
#include <vector>

#include "vdi/gpu/DeviceCandidate.h"

namespace vdi::gpu {

/// The validation layer's messages.
class MessageLog {
 public:
  void add(const char* text) {
    const std::lock_guard lock(mutex_);
    ++count_;
    text_ += text;
    text_ += '\n';
    if (text_.size() > kept) text_.erase(0, text_.size() - kept);
  }
  std::uint32_t count() const {
    const std::lock_guard lock(mutex_);
    return count_;
  }
  std::string text() const {
    const std::lock_guard lock(mutex_);
    return text_;
  }

 private:
  static constexpr std::size_t kept = 65536;
  mutable std::mutex mutex_;
  std::uint32_t count_ = 0;
  std::string text_;
};

class Instance {
 public:
  /// A machine without any driver is none without devices. With `validation`, the layer's messages of
  /// severity warning or error are kept, and objects can have names. Throws Error{DeviceUnavailable} if the
  /// layer isn't installed or Vulkan can't be had otherwise.
  explicit Instance(bool validation);
  ~Instance();
  Instance(const Instance&) = delete;
  Instance& operator=(const Instance&) = delete;
  Instance(Instance&&) = delete;
  Instance& operator=(Instance&&) = delete;

  VkInstance handle() const { return handle_; }  // VK_NULL_HANDLE without any driver
  bool validates() const { return messenger_ != VK_NULL_HANDLE; }
  /// All devices, in the driver's order.
  std::vector<DeviceCandidate> candidates() const;
  const MessageLog& messages() const { return log_; }

 private:
  void listen();

  VkInstance handle_ = VK_NULL_HANDLE;
  VkDebugUtilsMessengerEXT messenger_ = VK_NULL_HANDLE;
  MessageLog log_;
};

}  // namespace vdi::gpu
