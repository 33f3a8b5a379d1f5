#include "vdi/gpu/Commands.h"

#include <cassert>
#include <utility>

#include "vdi/core/Error.h"
#include "vdi/gpu/ComputePipeline.h"
#include "vdi/gpu/Memory.h"
#include "vdi/gpu/VulkanResult.h"

namespace vdi::gpu {

namespace {

constexpr std::uint32_t maxMarks = 64;

/// Changes the image's layout after all earlier commands and before all later ones.
void changeLayout(VkCommandBuffer commands, const SampledImage& image, VkImageLayout from, VkImageLayout to) {
  const VkImageMemoryBarrier2 barrier{VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER_2,
                                      nullptr,
                                      VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT,
                                      VK_ACCESS_2_MEMORY_WRITE_BIT,
                                      VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT,
                                      VK_ACCESS_2_MEMORY_READ_BIT | VK_ACCESS_2_MEMORY_WRITE_BIT,
                                      from,
                                      to,
                                      VK_QUEUE_FAMILY_IGNORED,
                                      VK_QUEUE_FAMILY_IGNORED,
                                      image.handle(),
                                      {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1}};
  const VkDependencyInfo info{
      VK_STRUCTURE_TYPE_DEPENDENCY_INFO, nullptr, 0, 0, nullptr, 0, nullptr, 1, &barrier};
  vkCmdPipelineBarrier2(commands, &info);
}

}  // namespace

Commands::Commands(std::shared_ptr<Device> device, QueueKind kind) : device_(std::move(device)), kind_(kind) {
  try {
    const VkCommandPoolCreateInfo poolInfo{VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO, nullptr, 0,
                                           device_->vulkan().queueFamily(kind_)};
    check(vkCreateCommandPool(device_->vulkan().handle(), &poolInfo, nullptr, &pool_), "vkCreateCommandPool");
    const VkCommandBufferAllocateInfo bufferInfo{VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO, nullptr,
                                                 pool_, VK_COMMAND_BUFFER_LEVEL_PRIMARY, 1};
    check(vkAllocateCommandBuffers(device_->vulkan().handle(), &bufferInfo, &buffer_),
          "vkAllocateCommandBuffers");
    const VkQueryPoolCreateInfo queryInfo{
        VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO, nullptr, 0, VK_QUERY_TYPE_TIMESTAMP, maxMarks + 1, 0};
    check(vkCreateQueryPool(device_->vulkan().handle(), &queryInfo, nullptr, &queries_), "vkCreateQueryPool");
  } catch (...) {
    release();
    throw;
  }
}

Commands::~Commands() {
  try {
    if (state_ == State::Submitted) device_->vulkan().wait(kind_, last_);
  } catch (const Error&) {  // the device is lost, so nothing runs any more
  }
  release();
}

void Commands::release() noexcept {
  VkDevice device = device_->vulkan().handle();
  if (queries_ != VK_NULL_HANDLE) vkDestroyQueryPool(device, queries_, nullptr);
  if (pool_ != VK_NULL_HANDLE) vkDestroyCommandPool(device, pool_, nullptr);
}

void Commands::begin() {
  wait();
  marks_.clear();
  waits_.clear();
  vkResetQueryPool(device_->vulkan().handle(), queries_, 0, maxMarks + 1);
  check(vkResetCommandPool(device_->vulkan().handle(), pool_, 0), "vkResetCommandPool");
  const VkCommandBufferBeginInfo info{VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO, nullptr,
                                      VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT, nullptr};
  check(vkBeginCommandBuffer(buffer_, &info), "vkBeginCommandBuffer");
  state_ = State::Recording;
  barrier();
}

void Commands::waitFor(const Submission& other) {
  assert(state_ == State::Recording);
  if (other.number == 0) return;
  waits_.push_back({VK_STRUCTURE_TYPE_SEMAPHORE_SUBMIT_INFO, nullptr,
                    device_->vulkan().submissionsDone(other.kind), other.number,
                    VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT, 0});
}

void Commands::submit() {
  assert(state_ == State::Recording);
  state_ = State::Idle;
  if (!marks_.empty()) {
    device_->vulkan().endLabel(buffer_);
    writeTimestamp(static_cast<std::uint32_t>(marks_.size()));
  }
  // Makes all writes visible to the host after wait().
  memoryBarrier(true);
  check(vkEndCommandBuffer(buffer_), "vkEndCommandBuffer");
  last_ = device_->vulkan().submit(kind_, waits_, buffer_);
  state_ = State::Submitted;
  ++submissions_;
}

/// After device loss the submission never counts as complete: each further begin or wait throws again.
void Commands::wait() {
  if (state_ != State::Submitted) return;
  device_->vulkan().wait(kind_, last_);
  state_ = State::Idle;
  readTimes();
}

void Commands::drop() noexcept {
  try {
    wait();
  } catch (const Error&) {  // the device is lost, so nothing runs any more
    state_ = State::Idle;
  }
}

void Commands::dispatchBytes(const ComputePipeline& pipeline, std::span<const std::byte> constants,
                             std::uint32_t x, std::uint32_t y, std::uint32_t z) {
  assert(x <= device_->limits().maxGroups[0] && y <= device_->limits().maxGroups[1] &&
         z <= device_->limits().maxGroups[2]);
  bind(pipeline, constants);
  vkCmdDispatch(buffer_, x, y, z);
}

void Commands::dispatchIndirectBytes(const ComputePipeline& pipeline, std::span<const std::byte> constants,
                                     const Buffer& groups) {
  assert(groups.size() >= sizeof(VkDispatchIndirectCommand));
  bind(pipeline, constants);
  vkCmdDispatchIndirect(buffer_, groups.handle(), 0);
}

void Commands::bind(const ComputePipeline& pipeline, std::span<const std::byte> constants) {
  assert(state_ == State::Recording);
  vkCmdBindPipeline(buffer_, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline.handle());
  VkDescriptorSet set = pipeline.descriptorSet();
  if (set != VK_NULL_HANDLE) {
    vkCmdBindDescriptorSets(buffer_, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline.layout(), 0, 1, &set, 0,
                            nullptr);
  }
  if (!constants.empty()) {
    vkCmdPushConstants(buffer_, pipeline.layout(), VK_SHADER_STAGE_COMPUTE_BIT, 0,
                       static_cast<std::uint32_t>(constants.size()), constants.data());
  }
}

void Commands::barrier() {
  memoryBarrier(false);
}

/// `host` also makes writes visible to the host, which flushes more caches than the device alone needs.
void Commands::memoryBarrier(bool host) {
  VkPipelineStageFlags2 stages = VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT;
  VkAccessFlags2 writes = VK_ACCESS_2_TRANSFER_WRITE_BIT;
  VkAccessFlags2 reads = VK_ACCESS_2_TRANSFER_READ_BIT;
  if (kind_ == QueueKind::Compute) {
    stages |= VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT |
              VK_PIPELINE_STAGE_2_DRAW_INDIRECT_BIT;  // reads the arguments of indirect dispatches
    writes |= VK_ACCESS_2_SHADER_WRITE_BIT;
    reads |= VK_ACCESS_2_SHADER_READ_BIT | VK_ACCESS_2_INDIRECT_COMMAND_READ_BIT;
  }
  const VkMemoryBarrier2 barrier{VK_STRUCTURE_TYPE_MEMORY_BARRIER_2,
                                 nullptr,
                                 stages,
                                 writes,
                                 host ? VK_PIPELINE_STAGE_2_HOST_BIT : stages,
                                 host ? VK_ACCESS_2_HOST_READ_BIT : reads | writes};
  const VkDependencyInfo info{
      VK_STRUCTURE_TYPE_DEPENDENCY_INFO, nullptr, 0, 1, &barrier, 0, nullptr, 0, nullptr};
  vkCmdPipelineBarrier2(buffer_, &info);
}

void Commands::copy(const Buffer& from, std::uint64_t fromOffset, const Buffer& to, std::uint64_t toOffset,
                    std::uint64_t bytes) {
  assert(fromOffset + bytes <= from.size() && toOffset + bytes <= to.size());
  if (bytes == 0) return;
  const VkBufferCopy region{fromOffset, toOffset, bytes};
  vkCmdCopyBuffer(buffer_, from.handle(), to.handle(), 1, &region);
}

void Commands::fill(const Buffer& buffer, std::uint32_t word) {
  vkCmdFillBuffer(buffer_, buffer.handle(), 0, VK_WHOLE_SIZE, word);
}

void Commands::fill(const Buffer& buffer, std::uint64_t offset, std::uint64_t bytes, std::uint32_t word) {
  assert(offset % 4 == 0 && bytes % 4 == 0 && offset + bytes <= buffer.size());
  if (bytes > 0) vkCmdFillBuffer(buffer_, buffer.handle(), offset, bytes, word);
}

void Commands::update(const Buffer& buffer, std::span<const std::byte> bytes) {
  assert(bytes.size() <= buffer.size() && bytes.size() <= 65536 && bytes.size() % 4 == 0);
  vkCmdUpdateBuffer(buffer_, buffer.handle(), 0, bytes.size(), bytes.data());
}

void Commands::clear(const SampledImage& image) {
  changeLayout(buffer_, image, VK_IMAGE_LAYOUT_UNDEFINED, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL);
  const VkClearColorValue zero{};
  const VkImageSubresourceRange all{VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
  vkCmdClearColorImage(buffer_, image.handle(), VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, &zero, 1, &all);
  endUpload(image);
}

void Commands::beginUpload(const SampledImage& image) {
  changeLayout(buffer_, image, VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL,
               VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL);
}

void Commands::endUpload(const SampledImage& image) {
  changeLayout(buffer_, image, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL,
               VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL);
}

void Commands::beginStores(const SampledImage& image) {
  changeLayout(buffer_, image, VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL, VK_IMAGE_LAYOUT_GENERAL);
}

void Commands::endStores(const SampledImage& image) {
  changeLayout(buffer_, image, VK_IMAGE_LAYOUT_GENERAL, VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL);
}

void Commands::copyToImage(const Buffer& from, std::uint64_t fromOffset, const SampledImage& to,
                           const glm::uvec3& texelOffset, const glm::uvec3& texelExtent,
                           const glm::uvec2& pitch) {
  assert(glm::all(glm::lessThanEqual(texelOffset + texelExtent, to.extent())));
  if (texelExtent.x == 0 || texelExtent.y == 0 || texelExtent.z == 0) return;
  [[maybe_unused]] const glm::u64vec2 steps(pitch.x > 0 ? pitch.x : texelExtent.x,
                                            pitch.y > 0 ? pitch.y : texelExtent.y);
  assert(fromOffset + (((texelExtent.z - 1) * steps.y + texelExtent.y - 1) * steps.x + texelExtent.x) *
                          texelBytes(to.format()) <=
         from.size());
  const glm::ivec3 offset(texelOffset);
  const VkBufferImageCopy region{fromOffset,
                                 pitch.x,
                                 pitch.y,
                                 {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1},
                                 {offset.x, offset.y, offset.z},
                                 {texelExtent.x, texelExtent.y, texelExtent.z}};
  vkCmdCopyBufferToImage(buffer_, from.handle(), to.handle(), VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 1,
                         &region);
}

void Commands::mark(std::string name) {
  assert(state_ == State::Recording && marks_.size() < maxMarks);
  if (!marks_.empty()) device_->vulkan().endLabel(buffer_);
  writeTimestamp(static_cast<std::uint32_t>(marks_.size()));
  device_->vulkan().beginLabel(buffer_, name);
  marks_.push_back(std::move(name));
}

void Commands::writeTimestamp(std::uint32_t query) {
  vkCmdWriteTimestamp2(buffer_, VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT, queries_, query);
}

void Commands::readTimes() {
  times_.clear();
  if (marks_.empty()) return;
  std::vector<std::uint64_t> ticks(marks_.size() + 1);
  check(
      vkGetQueryPoolResults(device_->vulkan().handle(), queries_, 0, static_cast<std::uint32_t>(ticks.size()),
                            ticks.size() * sizeof(std::uint64_t), ticks.data(), sizeof(std::uint64_t),
                            VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WAIT_BIT),
      "vkGetQueryPoolResults");
  const DeviceLimits& limits = device_->limits();
  const std::uint64_t validBits = ~std::uint64_t{0} >> (64U - limits.timestampBits);
  for (std::size_t i = 0; i < marks_.size(); ++i) {
    const auto elapsed = static_cast<double>((ticks[i + 1] - ticks[i]) & validBits);
    times_.push_back({marks_[i], elapsed * static_cast<double>(limits.timestampPeriodNs) * 1e-6});
  }
}

}  // namespace vdi::gpu
