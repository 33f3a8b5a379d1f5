#include "vtkVDIOutlineRepresentation.h"

#include <vtkDataObject.h>
#include <vtkInformationVector.h>
#include <vtkObjectFactory.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkTrivialProducer.h>

#include "VDIPlace.h"
#include "VDIUpdate.h"

vtkStandardNewMacro(vtkVDIOutlineRepresentation);

vtkVDIOutlineRepresentation::vtkVDIOutlineRepresentation() {
  this->Producer->SetOutput(this->Corners);
}

vtkVDIOutlineRepresentation::~vtkVDIOutlineRepresentation() = default;

void vtkVDIOutlineRepresentation::PrintSelf(ostream& os, vtkIndent indent) {
  this->Superclass::PrintSelf(os, indent);
}

int vtkVDIOutlineRepresentation::ProcessViewRequest(vtkInformationRequestKey* request, vtkInformation* in,
                                                    vtkInformation* out) {
  const pv::Update update(this, request);
  return this->Superclass::ProcessViewRequest(request, in, out);
}

int vtkVDIOutlineRepresentation::RequestData(vtkInformation* request, vtkInformationVector** inputs,
                                             vtkInformationVector* outputs) {
  this->Corners->Initialize();
  vtkDataObject* input =
      inputs[0]->GetNumberOfInformationObjects() > 0 ? vtkDataObject::GetData(inputs[0]) : nullptr;
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  if (const auto box = pv::boxIn(input != nullptr ? input->GetFieldData() : nullptr)) {
    points->InsertNextPoint(&box->lo.x);
    points->InsertNextPoint(&box->hi.x);
  }
  this->Corners->SetPoints(points);
  return this->Superclass::RequestData(request, inputs, outputs);
}

vtkAlgorithmOutput* vtkVDIOutlineRepresentation::GetInternalOutputPort(int, int) {
  return this->Producer->GetOutputPort();
}
