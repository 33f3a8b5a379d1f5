#include "vtkSMVDIStreamExtractWriterProxy.h"

#include <vtkObjectFactory.h>
#include <vtkSMExtractsController.h>
#include <vtkSMPropertyHelper.h>
#include <vtkSMSourceProxy.h>

vtkStandardNewMacro(vtkSMVDIStreamExtractWriterProxy);

bool vtkSMVDIStreamExtractWriterProxy::Write(vtkSMExtractsController* extractor) {
  auto* const writer = vtkSMSourceProxy::SafeDownCast(this->GetSubProxy("Writer"));
  if (writer == nullptr) return false;
  vtkSMPropertyHelper(writer, "TimeStep").Set(extractor->GetTimeStep());
  writer->UpdateVTKObjects();
  writer->UpdatePipeline(extractor->GetTime());
  return true;
}
