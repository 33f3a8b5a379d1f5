#include "VDIOutput.h"

#include <vtkDataObject.h>
#include <vtkImageData.h>
#include <vtkInformation.h>

#include <algorithm>
#include <cstdint>

#include "VDIImageData.h"
#include "VDIValues.h"

namespace pv {

void giveVdi(vdi::Vdi& vdi, const Shown& shown, const Origin& origin, int step, vtkImageData* output) {
  vdi.coloring->array = shown.array;
  vdi.time = origin.time.value_or(0.0);
  vdi.timeStep = static_cast<std::uint64_t>(std::max(step, 0));
  setVdi(output, vdi);
  setShownValues(output, shown.array, shown.values);
}

void setTime(vtkImageData* output, std::optional<double> time) {
  if (time) {
    output->GetInformation()->Set(vtkDataObject::DATA_TIME_STEP(), *time);
  } else {
    output->GetInformation()->Remove(vtkDataObject::DATA_TIME_STEP());
  }
}

}  // namespace pv
