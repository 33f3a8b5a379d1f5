#include "vtkSMVDIWriterProxy.h"

#include <vtkObjectFactory.h>

#include "vtkSMVDIGeneratorProxy.h"

vtkStandardNewMacro(vtkSMVDIWriterProxy);

void vtkSMVDIWriterProxy::UpdatePipeline() {
  vtkSMVDIGeneratorProxy::PrepareUpstream(this);
  this->Superclass::UpdatePipeline();
}

void vtkSMVDIWriterProxy::UpdatePipeline(double time) {
  vtkSMVDIGeneratorProxy::PrepareUpstream(this);
  this->Superclass::UpdatePipeline(time);
}
