#include "vtkVDIImageRepresentation.h"

#include <vtkObjectFactory.h>

#include "vtkVDIOutlineRepresentation.h"
#include "vtkVDIPictureRepresentation.h"
#include "vtkVDIRepresentation.h"

vtkStandardNewMacro(vtkVDIImageRepresentation);

void vtkVDIImageRepresentation::PrintSelf(ostream& os, vtkIndent indent) {
  this->Superclass::PrintSelf(os, indent);
}

void vtkVDIImageRepresentation::AddRepresentation(const char* key, vtkPVDataRepresentation* representation) {
  if (vtkVDIRepresentation::SafeDownCast(representation) != nullptr ||
      vtkVDIOutlineRepresentation::SafeDownCast(representation) != nullptr ||
      vtkVDIPictureRepresentation::SafeDownCast(representation) != nullptr)
    this->Superclass::AddRepresentation(key, representation);
}
