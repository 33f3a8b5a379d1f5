// Dispatches cells.comp: macrocells of the pieces in pages.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "shaders/shared/cells.h"
#include "vdi/gpu/Commands.h"
#include "vdi/gpu/Memory.h"
#include "vdi/gpu/PipelineSet.h"

namespace vdi::gpu {

class CellsPass {
 public:
  explicit CellsPass(std::shared_ptr<Device> device);
  /// constants.mode is one of cellsMode.... `pages` are those of the pieces, at least one; `pagesVersion`
  /// changes when they do.
  void record(Commands& commands, const shared::CellsConstants& constants,
              std::span<const SampledImage> pages, std::uint64_t pagesVersion);

 private:
  Sampler sampler_;
  PipelineSet pipelines_;  // by page count
  std::uint64_t boundVersion_ = 0;
};

}  // namespace vdi::gpu
