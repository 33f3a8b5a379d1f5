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
#include "vdi/gpu/PipelineSet.h"

namespace vdi {
struct DepthLattice;
struct Scene;
class View;
}  // namespace vdi

namespace vdi::gpu {

class VolumeStore;

/// The part of CastParams that follows from camera and scene. Addresses, the slab table's fields and list
/// fields are left 0.
shared::CastParams castGeometry(const Scene& scene, const View& view, const DepthLattice& lattice);

class CastPass {
 public:
  explicit CastPass(const std::shared_ptr<Device>& device);

  /// Sets the volume that later dispatches read; it must outlive them and have pages. Pipelines are made when
  /// they are first recorded.
  void bind(const VolumeStore& volume) { volume_ = &volume; }

  /// The purpose of a dispatch. Volume renders the picture, or the extremes that it shows
  /// (CastParams::blendMode). Histogram counts the demand of lists, and CountLevels the counts that this rank
  /// shares with others; both are for merging. Count finds sensitivities or tolerances, and counts. Write
  /// stores supersegments (bisection) or pre-segments (merging).
  enum class Work { Volume, Histogram, CountLevels, Count, Write };
  struct Band {
    std::uint32_t width = 0;
    std::uint32_t firstRow = 0;
    std::uint32_t lastRow = 0;        // exclusive
    std::uint32_t countedStride = 1;  // as in CastParams
    bool cutAtGaps = false;           // supersegments end at gaps
    shared::StoredForm form{};        // as in CastParams
  };
  /// No dispatch of this pass may be in flight.
  void record(Commands& commands, const shared::CastParams& params, Work work, Algorithm algorithm,
              const Band& band);

 private:
  /// Specialisation of cast.comp, besides the number of pages.
  struct Program {
    std::uint32_t program = 0;   // shared::castProgram...
    std::uint32_t encoding = 0;  // number of the encoding
    std::uint32_t lanesPerRay = 1;
    std::uint32_t samplesAhead = 1;
    bool cutAtGaps = false;
    bool byNeed = false;
    bool shaded = false;
    std::uint32_t blendMode = 0;
    bool takesNearest = false;
    bool hasPieces = false;
  };
  ComputePipeline& pipelineFor(const Program& program);
  /// The images that a pipeline reads.
  struct Bound {
    std::uint64_t pages = 0;
    std::uint64_t slabs = 0;
    bool operator==(const Bound&) const = default;
  };

  std::uint32_t samplesAhead_;
  std::uint32_t lanesPerRay_;  // for casting few rays
  Sampler sampler_;
  PipelineSet pipelines_;
  PipelineSet lanePipelines_;
  std::map<const ComputePipeline*, Bound> bound_;
  const VolumeStore* volume_ = nullptr;
};

}  // namespace vdi::gpu
