#include "vtkSMVDIRendererProxy.h"

#include <vtkObjectFactory.h>

#include "vtkSMVDIGeneratorProxy.h"

vtkStandardNewMacro(vtkSMVDIRendererProxy);

void vtkSMVDIRendererProxy::UpdatePipeline() {
  vtkSMVDIGeneratorProxy::PrepareUpstream(this);
  this->Superclass::UpdatePipeline();
}

void vtkSMVDIRendererProxy::UpdatePipeline(double time) {
  vtkSMVDIGeneratorProxy::PrepareUpstream(this);
  this->Superclass::UpdatePipeline(time);
}
