#include "vtkSMVDIRepresentationProxy.h"

#include <vtkDataObject.h>
#include <vtkObjectFactory.h>

vtkStandardNewMacro(vtkSMVDIRepresentationProxy);

bool vtkSMVDIRepresentationProxy::SetRepresentationType(const char* type) {
  if (this->GetUsingScalarColoring()) this->SetScalarColoring(nullptr, vtkDataObject::POINT);
  // The superclass colours slices by an array.
  // NOLINTNEXTLINE(bugprone-parent-virtual-call)
  return this->vtkSMRepresentationProxy::SetRepresentationType(type);
}

void vtkSMVDIRepresentationProxy::SetPropertyModifiedFlag(const char* name, int flag) {
  // The superclass connects the selection.
  // NOLINTNEXTLINE(bugprone-parent-virtual-call)
  this->vtkSMRepresentationProxy::SetPropertyModifiedFlag(name, flag);
}
