// The picture of a VDI from its own viewpoint.
#pragma once

#include "vdi/core/Image.h"
#include "vdi/core/Vdi.h"

namespace vdi {

/// The VDI seen from V_O: composites each list of the picture front to back, on the host. Equals DVR.
Image flatten(const Vdi& vdi);

}  // namespace vdi
