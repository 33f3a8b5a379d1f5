// Dispatches quota.comp: the ranks' agreement on lists that they have counted together.
#pragma once

#include <memory>

#include "shaders/shared/quota.h"
#include "vdi/gpu/Commands.h"
#include "vdi/gpu/ComputePipeline.h"

namespace vdi::gpu {

class QuotaPass {
 public:
  explicit QuotaPass(std::shared_ptr<Device> device);
  void record(Commands& commands, const shared::QuotaConstants& constants) const;

 private:
  ComputePipeline pipeline_;
};

}  // namespace vdi::gpu
