// The inputs of a frame besides the volume.
#ifndef VDIFrameInputs_h
#define VDIFrameInputs_h

#include "vdi/core/Camera.h"
#include "vdi/core/GenerateSettings.h"
#include "vdi/core/TransferFunction.h"

namespace pv {

struct FrameInputs {
  vdi::Camera camera;
  vdi::TransferFunction function;
  vdi::GenerateSettings settings;
};

}  // namespace pv

#endif
