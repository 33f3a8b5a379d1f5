#include "vtkSMVDIRepresentationProxy.h"

#include <vtkDataObject.h>
#include <vtkObjectFactory.h>

#include <cstring>

vtkStandardNewMacro(vtkSMVDIRepresentationProxy);

bool vtkSMVDIRepresentationProxy::SetRepresentationType(const char* type) {
  if (type != nullptr && std::strcmp(type, "VDI") == 0 && this->GetUsingScalarColoring())
    this->SetScalarColoring(nullptr, vtkDataObject::POINT);
  return this->Superclass::SetRepresentationType(type);
}

void vtkSMVDIRepresentationProxy::SetPropertyModifiedFlag(const char* name, int flag) {
  // The superclass connects the selection.
  // NOLINTNEXTLINE(bugprone-parent-virtual-call)
  this->vtkSMRepresentationProxy::SetPropertyModifiedFlag(name, flag);
}
