#include "vdi/gpu/DepositPass.h"

#include <algorithm>
#include <cstring>
#include <utility>

namespace vdi::gpu {

namespace {

constexpr std::uint64_t sumBytes = sizeof(std::int64_t);

}  // namespace

DepositPass::DepositPass(std::shared_ptr<Device> device)
    : device_(std::move(device)),
      pipeline_(device_, infoOf<shared::DepositConstants>("deposit")),
      commands_(device_) {}

void DepositPass::start(std::span<const glm::ivec3> blocks) {
  commands_.wait();
  cells_.clear();
  first_.clear();
  std::uint64_t total = 0;
  for (const glm::ivec3& block : blocks) {
    const auto size = glm::u64vec3(block);
    first_.push_back(total);
    cells_.push_back(size.x * size.y * size.z);
    total += cells_.back();
  }
  // A rank without blocks has buffers, too.
  sums_.reserve(device_, std::max<std::uint64_t>(total, 1) * sumBytes, MemoryKind::DeviceLocal);
  blocks_.reserve(device_, std::max<std::size_t>(blocks.size(), 1) * sizeof(shared::DepositBlock),
                  MemoryKind::Upload);
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const glm::uvec3 size(blocks[i]);
    blocks_.mappedAs<shared::DepositBlock>()[i] = {sums_.address() + first_[i] * sumBytes, size.x, size.y,
                                                   size.z, 0};
  }
  commands_.begin();
  commands_.fill(sums_, 0);
  commands_.submit();
}

void DepositPass::add(std::span<const shared::DepositParticle> particles) {
  if (particles.empty()) return;
  commands_.wait();  // the previous particles' memory is reused
  particles_.reserve(device_, particles.size_bytes(), MemoryKind::Upload);
  std::memcpy(particles_.mapped().data(), particles.data(), particles.size_bytes());
  shared::DepositConstants constants{};
  constants.particles = particles_.address();
  constants.blocks = blocks_.address();
  constants.count = static_cast<std::uint32_t>(particles.size());
  commands_.begin();
  commands_.dispatchMany(pipeline_, constants, particles.size(), shared::depositGroup);
  commands_.submit();
}

std::span<const std::int64_t> DepositPass::download(std::size_t block, std::uint64_t first,
                                                    std::uint64_t count) {
  commands_.wait();
  readback_.reserve(device_, count * sumBytes, MemoryKind::Readback);
  commands_.begin();
  commands_.copy(sums_, (first_[block] + first) * sumBytes, readback_, 0, count * sumBytes);
  commands_.submitAndWait();
  return readback_.mappedAs<const std::int64_t>().first(count);
}

void DepositPass::release() {
  commands_.wait();
  sums_ = {};
  readback_ = {};
}

}  // namespace vdi::gpu
