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

/// Pipelines of one shader that differ in specialisation, each made at its first use.
class PipelineSet {
 public:
  /// `common` is the info without the specialisation. `hasPrograms`: the shader is one of PROGRAMS in
  /// CMakeLists.txt, and the first word of a specialisation, constant 0, is the program's number. CPU devices
  /// get the program without the others' code, because they compile it several times as fast.
  PipelineSet(std::shared_ptr<Device> device, ComputePipelineInfo common, bool hasPrograms = false);
  /// Shares the uniforms of another set, which updates them. Has programs if that set does.
  PipelineSet(const PipelineSet& updated, ComputePipelineInfo common);
  ComputePipeline& with(const std::vector<std::uint32_t>& specialization);
  /// Compiles a pipeline for the device, so that its first use won't wait. Any thread may call it during the
  /// other calls.
  void compile(const std::vector<std::uint32_t>& specialization) const;
  /// Sets the uniforms of all pipelines for the commands recorded next; records nothing if the values are
  /// unchanged. Uniforms are in device-local memory, where shaders read them as fast as constants; a GPU
  /// would fetch them from host memory again and again.
  template <typename Uniforms>
  void update(Commands& commands, const Uniforms& uniforms) {
    updateBytes(commands, std::as_bytes(std::span(&uniforms, 1)));
  }

 private:
  /// Calls use(info). The info refers to a name that exists only during this call.
  template <typename Use>
  auto withInfo(const std::vector<std::uint32_t>& specialization, Use use) const;
  void updateBytes(Commands& commands, std::span<const std::byte> bytes);

  std::shared_ptr<Device> device_;
  ComputePipelineInfo common_;
  bool hasPrograms_ = false;
  std::shared_ptr<const Buffer> uniforms_;  // shared by all pipelines; null without uniforms
  std::vector<std::byte> updated_;          // the values of the last update
  const Commands* updatedBy_ = nullptr;     // the commands that recorded the update
  std::uint64_t updatedBehind_ = 0;         // their number of submissions at that time
  std::map<std::vector<std::uint32_t>, std::unique_ptr<ComputePipeline>> pipelines_;
};

}  // namespace vdi::gpu
