#include "vtkVDIImageData.h"

#include <vtkDoubleArray.h>
#include <vtkFieldData.h>
#include <vtkInformation.h>
#include <vtkInformationVector.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>

#include <algorithm>

vtkStandardNewMacro(vtkVDIImageData);

void vtkVDIImageData::ComputeBounds() {
  this->Superclass::ComputeBounds();
  vtkFieldData* fields = this->GetFieldData();
  auto* scene = fields ? vtkDoubleArray::SafeDownCast(fields->GetAbstractArray("VDI.bounds")) : nullptr;
  if (scene == nullptr || scene->GetNumberOfValues() != 6) return;
  const double* bounds = scene->GetPointer(0);
  if (bounds[0] <= bounds[1] && bounds[2] <= bounds[3] && bounds[4] <= bounds[5])
    std::copy_n(bounds, 6, this->Bounds);
}

void vtkVDIImageData::MakeOutput(vtkInformationVector* outputs) {
  if (vtkVDIImageData::SafeDownCast(vtkDataObject::GetData(outputs)) != nullptr) return;
  vtkNew<vtkVDIImageData> image;
  outputs->GetInformationObject(0)->Set(vtkDataObject::DATA_OBJECT(), image);
}
