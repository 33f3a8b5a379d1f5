// Fills a filter's output with the VDI that the filter has made.
#ifndef VDIOutput_h
#define VDIOutput_h

#include <optional>

#include "VDILoad.h"
#include "VDIVolume.h"
#include "vdi/core/Vdi.h"

class vtkImageData;

namespace pv {

/// Completes the VDI with the facts about its blocks, and moves it to the output. `step` is the simulation's.
void giveVdi(vdi::Vdi& vdi, const Shown& shown, const Origin& origin, int step, vtkImageData* output);

/// Sets the output's time to the input's, or removes it.
void setTime(vtkImageData* output, std::optional<double> time);

}  // namespace pv

#endif
