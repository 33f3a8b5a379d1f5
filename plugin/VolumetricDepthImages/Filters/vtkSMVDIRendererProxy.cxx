#include "vtkSMVDIRendererProxy.h"

#include <vtkObjectFactory.h>

#include <optional>

#include "vtkSMVDIGeneratorProxy.h"

vtkStandardNewMacro(vtkSMVDIRendererProxy);

void vtkSMVDIRendererProxy::UpdatePipeline() {
  vtkSMVDIGeneratorProxy::PrepareUpstream(this, std::nullopt);
  this->Superclass::UpdatePipeline();
}

void vtkSMVDIRendererProxy::UpdatePipeline(double time) {
  vtkSMVDIGeneratorProxy::PrepareUpstream(this, time);
  this->Superclass::UpdatePipeline(time);
}
