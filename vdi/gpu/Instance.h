// The process's access to Vulkan: its devices, and the validation layer's messages about the opened one.
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
  /// A machine without any driver counts as one without devices. With `validation`, messages of severity
  /// warning or error are kept, and objects can have names. Throws Error{DeviceUnavailable} if the layer is
  /// not installed or Vulkan is unusable for another reason.
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
