#include "vtkSMVDIRendererProxy.h"

#include <vtkObjectFactory.h>

#include <optional>

#include "vtkSMVDIGeneratorProxy.h"

vtkStandardNewMacro(vtkSMVDIRendererProxy);

void vtkSMVDIRendererProxy::UpdatePipeline() {
  if (!vtkSMVDIGeneratorProxy::EnterUpdate(this)) return;
  vtkSMVDIGeneratorProxy::PrepareUpstream(this, std::nullopt);
  this->Superclass::UpdatePipeline();
}

void vtkSMVDIRendererProxy::UpdatePipeline(double time) {
  if (!vtkSMVDIGeneratorProxy::EnterUpdate(this)) return;
  vtkSMVDIGeneratorProxy::PrepareUpstream(this, time);
  this->Superclass::UpdatePipeline(time);
}
