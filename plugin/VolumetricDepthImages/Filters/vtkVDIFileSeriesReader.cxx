#include "vtkVDIFileSeriesReader.h"

#include <vtkObjectFactory.h>

#include <set>

#include "vdi/core/Error.h"
#include "vdi/io/VdiFile.h"

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
