// Specialised variants of one shader, and the uniforms that they share.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include "vdi/gpu/ComputePipeline.h"
#include "vdi/gpu/Memory.h"

namespace vdi::gpu {

class Commands;

/// Pipelines of one shader that differ in specialisation, each made when it's first asked for.
class PipelineSet {
 public:
  /// `common`: but for the specialisation.
  PipelineSet(std::shared_ptr<Device> device, ComputePipelineInfo common);
  /// With the uniforms of another set, which updates them.
  PipelineSet(const PipelineSet& updated, ComputePipelineInfo common);
  ComputePipeline& with(const std::vector<std::uint32_t>& specialization);
  /// What the uniforms of all pipelines are for what's recorded next; nothing is recorded where they are that
  /// already. They're in the device's own memory, where shaders read them as fast as constants: a GPU would
  /// fetch them from the host's memory again and again.
  template <typename Uniforms>
  void update(Commands& commands, const Uniforms& uniforms) {
    updateBytes(commands, std::as_bytes(std::span(&uniforms, 1)));
  }

 private:
  void updateBytes(Commands& commands, std::span<const std::byte> bytes);

  std::shared_ptr<Device> device_;
  ComputePipelineInfo common_;
  std::shared_ptr<const Buffer> uniforms_;  // of all of them; none: they have no uniforms
  std::vector<std::byte> updated_;          // what they are since the last update
  const Commands* updatedBy_ = nullptr;     // where that was recorded
  std::uint64_t updatedBehind_ = 0;         // and behind how many submissions of it
  std::map<std::vector<std::uint32_t>, std::unique_ptr<ComputePipeline>> pipelines_;
};

}  // namespace vdi::gpu
