// The work of a preparation's thread.
#ifndef VDIMaker_h
#define VDIMaker_h

#include <optional>

#include "VDIFrameInputs.h"
#include "VDILoad.h"
#include "VDIPreparation.h"
#include "VDIReport.h"

namespace pv {

/// The function that makes this frame's VDI of the blocks of `origin`. `load` has the blocks if the volume
/// doesn't show them yet. `step` is the simulation's. The function writes `reports`, which must outlive it.
Preparation::Make makerOf(FrameInputs frame, std::optional<Load> load, const Origin& origin, int step,
                          FrameReports& reports);

}  // namespace pv

#endif
