// One reusable command buffer with its timestamps: begin, record, submit, wait; then begin again.
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

/// Number of workgroups of `group` invocations that cover `count` invocations along an axis.
constexpr std::uint32_t groupsFor(std::uint32_t count, std::uint32_t group) {
  return (count + group - 1) / group;
}

/// A queue submission by sequence number; 0 means none.
struct Submission {
  QueueKind kind = QueueKind::Compute;
  std::uint64_t number = 0;
};

class Commands {
 public:
  /// Commands for a transfer queue only copy: no dispatches, clears or marks.
  explicit Commands(std::shared_ptr<Device> device, QueueKind kind = QueueKind::Compute);
  ~Commands();  // waits for the last submission
  Commands(const Commands&) = delete;
  Commands& operator=(const Commands&) = delete;
  Commands(Commands&&) = delete;
  Commands& operator=(Commands&&) = delete;

  /// Waits for the previous submission, then starts recording after a barrier: all earlier submissions, also
  /// those of other objects, are finished and visible to the new commands. Drops commands that were recorded
  /// and not submitted, so an exception between begin and submit does no harm.
  void begin();
  /// Makes the commands wait, on the device, for that submission. Call it for another queue's submission,
  /// since begin's barrier reaches only its own queue.
  void waitFor(const Submission& other);
  void waitFor(const Commands& other) { waitFor(other.last()); }
  /// The last submission, complete or not.
  Submission last() const { return {kind_, last_}; }
  void submit();
  /// Number of calls of submit. If it has grown since a command was recorded, that command was not dropped.
  std::uint64_t submissions() const { return submissions_; }
  /// Returns when the last submission is complete, at once if there is none. Throws Error{DeviceFailure} on
  /// device loss.
  void wait();
  /// For use after an error: waits without throwing. Afterwards the submission no longer uses any memory.
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
  /// Dispatches `count` invocations in workgroups of `group`, over two axes, since devices need not allow
  /// more than 65535 workgroups per axis. An invocation's index is gl_GlobalInvocationID.x +
  /// gl_GlobalInvocationID.y * gl_NumWorkGroups.x * group.
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
  /// Dispatches the numbers of workgroups that the buffer's first three words contain at execution time.
  template <typename PushConstants>
  void dispatchIndirect(const ComputePipeline& pipeline, const PushConstants& constants,
                        const Buffer& groups) {
    dispatchIndirectBytes(pipeline, std::as_bytes(std::span(&constants, 1)), groups);
  }
  void dispatchIndirectBytes(const ComputePipeline& pipeline, std::span<const std::byte> constants,
                             const Buffer& groups);

  /// Makes everything recorded before finish and be visible to everything recorded later. Writes of the host
  /// before submit() are visible anyway, and so are all results to the host after wait().
  void barrier();

  void copy(const Buffer& from, std::uint64_t fromOffset, const Buffer& to, std::uint64_t toOffset,
            std::uint64_t bytes);
  void fill(const Buffer& buffer, std::uint32_t word);  // the whole buffer
  /// Fills part of the buffer: `offset` and `bytes` are multiples of a word's 4 bytes.
  void fill(const Buffer& buffer, std::uint64_t offset, std::uint64_t bytes, std::uint32_t word);
  /// Writes the buffer's first bytes, carried by the command buffer: whole words, 64 KiB at most.
  void update(const Buffer& buffer, std::span<const std::byte> bytes);
  /// Fills a new image with zeros and makes it ready to be sampled. Texels without data would otherwise hold
  /// anything, NaN included, and a NaN spoils its neighbours even with weight 0.
  void clear(const SampledImage& image);
  /// Makes an image that is ready to be sampled ready for copyToImage; its texels stay unchanged.
  void beginUpload(const SampledImage& image);
  /// Makes the image ready to be sampled again.
  void endUpload(const SampledImage& image);
  /// Makes an image that is ready to be sampled ready for shaders that store to it; its texels stay
  /// unchanged.
  void beginStores(const SampledImage& image);
  /// Makes the image ready to be sampled again.
  void endStores(const SampledImage& image);
  /// Copies texels, x fastest, from the buffer into a box of the image. `pitch` is the number of texels from
  /// row to row and of rows from slice to slice; 0: tightly packed.
  void copyToImage(const Buffer& from, std::uint64_t fromOffset, const SampledImage& to,
                   const glm::uvec3& texelOffset, const glm::uvec3& texelExtent,
                   const glm::uvec2& pitch = glm::uvec2(0));

  /// Marks the start of a named stage on the device's clock; it ends at the next mark, or at submit. At most
  /// 64 marks per submission. Debuggers show the stage's commands under that name.
  void mark(std::string name);
  /// Device time of each stage of the last completed submission, in order.
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
  std::uint64_t last_ = 0;  // number of the last submission on its queue
};

}  // namespace vdi::gpu
