#include "vtkVDIFileSeriesReader.h"

#include <vtkObjectFactory.h>

#include <set>

#include "vdi/core/Error.h"
#include "vdi/io/VdiFile.h"
#include "vtkVDIReader.h"

vtkStandardNewMacro(vtkVDIFileSeriesReader);

int vtkVDIFileSeriesReader::RequestInformation(vtkInformation* request, vtkInformationVector** inputs,
                                               vtkInformationVector* outputs) {
  std::set<double> times;
  bool differ = true;
  for (unsigned int i = 0; differ && i < this->GetNumberOfFileNames(); ++i) {
    try {
      differ = times.insert(vdi::io::readVdiInfo(this->GetFileName(i)).header.time).second;
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
