// Dispatches cast.comp: DVR, or the two steps that make lists, over the bricks of a VolumeStore.
#pragma once

#include <array>
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

  /// Chooses the pipelines for the store's pages and binds these. Cheap when nothing changed. No dispatch may
  /// be in flight.
  void bind(const VolumeStore& volume);

  /// What a dispatch does: the picture; or the first step of an algorithm (sensitivities or tolerances, and
  /// counts), or its second one (supersegments or grains).
  enum class Work { Volume, Search, Write };
  /// Rows [firstRow, lastRow). `params` is the address of a CastParams.
  void record(Commands& commands, VkDeviceAddress params, Work work, Algorithm algorithm, std::uint32_t width,
              std::uint32_t firstRow, std::uint32_t lastRow) const;

 private:
  /// By shared::castProgram...
  using Pipelines = std::array<std::unique_ptr<ComputePipeline>, 4>;
  std::shared_ptr<Device> device_;
  Sampler sampler_;
  std::map<std::size_t, Pipelines> pipelines_;  // by page count
  const Pipelines* bound_ = nullptr;
  std::uint64_t boundVersion_ = 0;
};

}  // namespace vdi::gpu
