#include "vtkVDIFileSeriesReader.h"

#include <vtkObjectFactory.h>

#include <algorithm>
#include <array>
#include <set>

#include "vdi/core/Error.h"
#include "vdi/io/VdiFile.h"
#include "vtkVDIReader.h"

vtkStandardNewMacro(vtkVDIFileSeriesReader);

namespace {

std::array<double, 12> numbersOf(const vdi::Camera& camera) {
  const auto& [position, focalPoint, viewUp, viewAngle, parallelProjection, parallelScale] = camera;
  return {position.x,
          position.y,
          position.z,
          focalPoint.x,
          focalPoint.y,
          focalPoint.z,
          viewUp.x,
          viewUp.y,
          viewUp.z,
          viewAngle,
          parallelProjection ? 1.0 : 0.0,
          parallelScale};
}

}  // namespace

int vtkVDIFileSeriesReader::RequestInformation(vtkInformation* request, vtkInformationVector** inputs,
                                               vtkInformationVector* outputs) {
  std::set<double> times;
  bool differ = true;
  std::ranges::fill(this->Viewpoint, 0.0);
  for (unsigned int i = 0; differ && i < this->GetNumberOfFileNames(); ++i) {
    try {
      const vdi::Vdi header = vdi::io::readVdiInfo(this->GetFileName(i)).header;
      if (times.empty()) std::ranges::copy(numbersOf(header.camera), this->Viewpoint);
      differ = times.insert(header.time).second;
    } catch (const vdi::Error&) {
      differ = false;  // a file that can't be read; the reader says so when it's its turn
    }
  }
  this->IgnoreReaderTime = !differ;
  return this->Superclass::RequestInformation(request, inputs, outputs);
}

int vtkVDIFileSeriesReader::RequestData(vtkInformation* request, vtkInformationVector** inputs,
                                        vtkInformationVector* outputs) {
  const int result = this->Superclass::RequestData(request, inputs, outputs);
  const vtkIdType index = this->GetFileIndex();
  const auto count = static_cast<vtkIdType>(this->GetNumberOfFileNames());
  auto* reader = vtkVDIReader::SafeDownCast(this->Reader);
  if (this->LastIndex != index && count > 1) {
    const vtkIdType step = this->LastIndex >= 0 ? (index - this->LastIndex + count) % count : 0;
    const bool goesOn = step != 0 && step == this->LastStep;
    if (goesOn && reader != nullptr)
      reader->Prefetch(this->GetFileName(static_cast<unsigned int>((index + step) % count)));
    this->LastStep = step;
  }
  this->LastIndex = index;
  return result;
}
