#include "vtkSMVDIExtractWriterProxy.h"

#include <vtkObjectFactory.h>
#include <vtkSMExtractsController.h>
#include <vtkSMPropertyHelper.h>

vtkStandardNewMacro(vtkSMVDIExtractWriterProxy);

bool vtkSMVDIExtractWriterProxy::Write(vtkSMExtractsController* extractor) {
  if (vtkSMProxy* writer = this->GetSubProxy("Writer")) {
    vtkSMPropertyHelper(writer, "TimeStep").Set(extractor->GetTimeStep());
  }
  return this->Superclass::Write(extractor);
}
