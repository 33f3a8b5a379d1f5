// One reusable command buffer with its timestamps. begin, record, submit, wait; then begin again.
#pragma once

#include <vulkan/vulkan.h>

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "vdi/gpu/Device.h"
#include "vdi/gpu/VulkanDevice.h"

namespace vdi::gpu {

class Buffer;
class ComputePipeline;
class SampledImage;

struct StageTime {
  std::string name;
  double milliseconds = 0.0;
};

/// Workgroups of `group` invocations along an axis that has `count` of them.
constexpr std::uint32_t groupsFor(std::uint32_t count, std::uint32_t group) {
  return (count + group - 1) / group;
}

/// One that was handed to a queue: the how-manieth there. 0: none.
struct Submission {
  QueueKind kind = QueueKind::Compute;
  std::uint64_t number = 0;
};

class Commands {
 public:
  /// Those of a transfer queue only copy: no dispatches, clears or marks.
  explicit Commands(std::shared_ptr<Device> device, QueueKind kind = QueueKind::Compute);
  ~Commands();  // waits for what was submitted
  Commands(const Commands&) = delete;
  Commands& operator=(const Commands&) = delete;
  Commands(Commands&&) = delete;
  Commands& operator=(Commands&&) = delete;

  /// Waits for the previous submission, then starts anew, behind a barrier: whatever was submitted before, by
  /// others too, is finished and visible to what's recorded. What was recorded and not submitted is dropped,
  /// so an exception between begin and submit does no harm.
  void begin();
  /// What's recorded waits, on the device, for that submission. For another queue's: begin's barrier reaches
  /// its own queue only.
  void waitFor(const Submission& other);
  void waitFor(const Commands& other) { waitFor(other.last()); }
  /// The last one, done or not.
  Submission last() const { return {kind_, last_}; }
  void submit();
  /// How often that was done: more than while something was recorded tells that it wasn't dropped.
  std::uint64_t submissions() const { return submissions_; }
  /// Returns when the submission is done, at once when there's none. Throws Error{DeviceFailure} on device
  /// loss.
  void wait();
  /// After an error: waits, whatever becomes of the submission. Nothing uses its memory any more.
  void drop() noexcept;
  void submitAndWait() {
    submit();
    wait();
  }

  template <typename PushConstants>
  void dispatch(const ComputePipeline& pipeline, const PushConstants& constants, std::uint32_t x,
                std::uint32_t y = 1, std::uint32_t z = 1) {
    dispatchBytes(pipeline, std::as_bytes(std::span(&constants, 1)), x, y, z);
  }
  /// Workgroups of `group` invocations for `count` of them, over two axes: every device allows 65535 per
  /// axis. An invocation's index is gl_GlobalInvocationID.x + gl_GlobalInvocationID.y * gl_NumWorkGroups.x *
  /// group.
  template <typename PushConstants>
  void dispatchMany(const ComputePipeline& pipeline, const PushConstants& constants, std::uint64_t count,
                    std::uint32_t group) {
    constexpr std::uint64_t widest = 32768;
    const std::uint64_t groups = (count + group - 1) / group;
    const std::uint64_t across = groups < widest ? groups : widest;
    dispatch(pipeline, constants, static_cast<std::uint32_t>(across),
             static_cast<std::uint32_t>((groups + across - 1) / across));
  }
  void dispatchBytes(const ComputePipeline& pipeline, std::span<const std::byte> constants, std::uint32_t x,
                     std::uint32_t y, std::uint32_t z);
  /// As many workgroups as the buffer's first three words say when it comes to that.
  template <typename PushConstants>
  void dispatchIndirect(const ComputePipeline& pipeline, const PushConstants& constants,
                        const Buffer& groups) {
    dispatchIndirectBytes(pipeline, std::as_bytes(std::span(&constants, 1)), groups);
  }
  void dispatchIndirectBytes(const ComputePipeline& pipeline, std::span<const std::byte> constants,
                             const Buffer& groups);

  /// Everything recorded so far is finished and visible to everything recorded later. What the host wrote
  /// before submit() is anyway, and so is everything to the host after wait().
  void barrier();

  void copy(const Buffer& from, std::uint64_t fromOffset, const Buffer& to, std::uint64_t toOffset,
            std::uint64_t bytes);
  void fill(const Buffer& buffer, std::uint32_t word);  // the whole buffer
  /// Whole words.
  void fill(const Buffer& buffer, std::uint64_t offset, std::uint64_t bytes, std::uint32_t word);
  /// The buffer's first bytes, by way of the command buffer: whole words, 64 KiB at most.
  void update(const Buffer& buffer, std::span<const std::byte> bytes);
  /// Fills a new image with zeros and makes it ready to be sampled: texels that nothing is copied to would
  /// otherwise hold anything, NaN included, and a NaN spoils its neighbours even with weight 0.
  void clear(const SampledImage& image);
  /// From ready to be sampled to ready for copyToImage, with its texels as they are.
  void beginUpload(const SampledImage& image);
  /// And back.
  void endUpload(const SampledImage& image);
  /// Texels, x fastest, from the buffer into a box of the image. `pitch`: texels from row to row and rows
  /// from slice to slice; 0: tightly packed.
  void copyToImage(const Buffer& from, std::uint64_t fromOffset, const SampledImage& to,
                   const glm::uvec3& texelOffset, const glm::uvec3& texelExtent,
                   const glm::uvec2& pitch = glm::uvec2(0));

  /// Marks the start of a named stage on the device's clock; it ends at the next mark, or at submit. Up to 64
  /// a submission. Debuggers show its commands under that name.
  void mark(std::string name);
  /// Device time of each stage of the last submission that was waited for, in order.
  const std::vector<StageTime>& stageTimes() const { return times_; }

 private:
  void bind(const ComputePipeline& pipeline, std::span<const std::byte> constants);
  void memoryBarrier(bool host);
  void release() noexcept;
  void writeTimestamp(std::uint32_t query);
  void readTimes();

  enum class State { Idle, Recording, Submitted };

  std::shared_ptr<Device> device_;
  QueueKind kind_;
  VkCommandPool pool_ = VK_NULL_HANDLE;
  VkCommandBuffer buffer_ = VK_NULL_HANDLE;
  std::vector<VkSemaphoreSubmitInfo> waits_;
  VkQueryPool queries_ = VK_NULL_HANDLE;
  std::vector<std::string> marks_;
  std::vector<StageTime> times_;
  State state_ = State::Idle;
  std::uint64_t submissions_ = 0;
  std::uint64_t last_ = 0;  // the last submission's number on its queue
};

}  // namespace vdi::gpu
