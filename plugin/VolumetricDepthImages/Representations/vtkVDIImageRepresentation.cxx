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

/// Returns null for null, which takes the input away.
vtkAlgorithmOutput* vtkVDIImageRepresentation::PassOn(vtkAlgorithmOutput* input) {
  this->Passing->SetInputConnection(input);
  return input != nullptr ? this->Passing->GetOutputPort() : nullptr;
}

void vtkVDIImageRepresentation::SetInputConnection(int port, vtkAlgorithmOutput* input) {
  this->Superclass::SetInputConnection(port, this->PassOn(input));
}

void vtkVDIImageRepresentation::SetInputConnection(vtkAlgorithmOutput* input) {
  this->Superclass::SetInputConnection(this->PassOn(input));
}

void vtkVDIImageRepresentation::AddInputConnection(int port, vtkAlgorithmOutput* input) {
  this->Superclass::AddInputConnection(port, this->PassOn(input));
}

void vtkVDIImageRepresentation::AddInputConnection(vtkAlgorithmOutput* input) {
  this->Superclass::AddInputConnection(this->PassOn(input));
}

void vtkVDIImageRepresentation::RemoveInputConnection(int port, vtkAlgorithmOutput* input) {
  this->Superclass::RemoveInputConnection(port, this->Passing->GetOutputPort());
  this->Passing->RemoveInputConnection(0, input);
}

void vtkVDIImageRepresentation::RemoveInputConnection(int port, int index) {
  this->Superclass::RemoveInputConnection(port, index);
  this->Passing->RemoveInputConnection(0, index);
}
