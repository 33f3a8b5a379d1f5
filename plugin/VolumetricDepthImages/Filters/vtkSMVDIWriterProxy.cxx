#include "vtkSMVDIWriterProxy.h"

#include <vtkObjectFactory.h>

#include <optional>

#include "vtkSMVDIGeneratorProxy.h"

vtkStandardNewMacro(vtkSMVDIWriterProxy);

void vtkSMVDIWriterProxy::UpdatePipeline() {
  if (!vtkSMVDIGeneratorProxy::EnterUpdate(this)) return;
  vtkSMVDIGeneratorProxy::PrepareUpstream(this, std::nullopt);
  this->Superclass::UpdatePipeline();
}

void vtkSMVDIWriterProxy::UpdatePipeline(double time) {
  if (!vtkSMVDIGeneratorProxy::EnterUpdate(this)) return;
  vtkSMVDIGeneratorProxy::PrepareUpstream(this, time);
  this->Superclass::UpdatePipeline(time);
}
