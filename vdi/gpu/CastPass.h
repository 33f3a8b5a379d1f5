// Dispatches cast.comp: DVR, or the two steps that make lists, over the bricks of a VolumeStore.
#pragma once

#include <cstdint>
#include <map>
#include <memory>

#include "shaders/shared/cast.h"
#include "vdi/core/GenerateSettings.h"
#include "vdi/gpu/Commands.h"
#include "vdi/gpu/ComputePipeline.h"
#include "vdi/gpu/Memory.h"

namespace vdi {
struct DepthLattice;
struct Scene;
class View;
}  // namespace vdi

namespace vdi::gpu {

class VolumeStore;

/// The part of CastParams that follows from camera and scene; `perUnitDistance`, addresses and list fields
/// are left 0.
shared::CastParams castGeometry(const Scene& scene, const View& view, const DepthLattice& lattice);

class CastPass {
 public:
  explicit CastPass(std::shared_ptr<Device> device);

  /// What later dispatches read; kept by reference, it must have pages. Pipelines are made when they're first
  /// recorded.
  void bind(const VolumeStore& volume) { volume_ = &volume; }

  /// What a dispatch does: the picture; or what lists need (merging); or the first step of an algorithm
  /// (sensitivities or tolerances, and counts), or its second one (supersegments or grains; by
  /// need, with Budget::Total).
  enum class Work { Volume, Survey, Search, Write, WriteByNeed };
  struct Band {
    std::uint32_t width = 0;
    std::uint32_t firstRow = 0;
    std::uint32_t lastRow = 0;        // exclusive
    std::uint32_t countedStride = 1;  // as in CastParams
    std::uint32_t countShares = 1;    // of the tolerances that Search counts, see AllotConstants
    shared::StoredForm form{};        // as in CastParams
  };
  /// No dispatch of this pass may be in flight.
  void record(Commands& commands, const shared::CastParams& params, Work work, Algorithm algorithm,
              const Band& band);

 private:
  ComputePipeline& pipelineFor(std::uint32_t program, std::uint32_t compact, std::uint32_t countShares);

  std::uint32_t samplesAhead_;
  Sampler sampler_;
  PipelineSet pipelines_;  // by shared::castProgram..., page count, precision and shares
  std::map<const ComputePipeline*, std::uint64_t> boundVersions_;  // of the pages that they're bound to
  const VolumeStore* volume_ = nullptr;
};

}  // namespace vdi::gpu
