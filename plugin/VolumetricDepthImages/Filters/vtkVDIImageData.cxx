#include "vtkVDIImageData.h"

#include <vtkAbstractArray.h>
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

vtkAbstractArray* vtkVDIImageData::Offsets() {
  vtkFieldData* fields = this->GetFieldData();
  return fields != nullptr ? fields->GetAbstractArray("VDI.offsets") : nullptr;
}

void vtkVDIImageData::SetFile(vtkUnsignedCharArray* file) {
  this->File = file;
  this->FileIsOf = this->Offsets();
}

vtkUnsignedCharArray* vtkVDIImageData::GetFile() {
  vtkAbstractArray* offsets = this->Offsets();
  return offsets != nullptr && offsets == this->FileIsOf ? this->File.Get() : nullptr;
}

void vtkVDIImageData::ShallowCopy(vtkDataObject* source) {
  this->Superclass::ShallowCopy(source);
  this->TakeFile(source);
}

void vtkVDIImageData::DeepCopy(vtkDataObject* source) {
  this->Superclass::DeepCopy(source);
  this->TakeFile(source);
}

void vtkVDIImageData::TakeFile(vtkDataObject* source) {
  auto* other = vtkVDIImageData::SafeDownCast(source);
  this->SetFile(other != nullptr ? other->GetFile() : nullptr);
}

void vtkVDIImageData::MakeOutput(vtkInformationVector* outputs) {
  if (vtkVDIImageData::SafeDownCast(vtkDataObject::GetData(outputs)) != nullptr) return;
  vtkNew<vtkVDIImageData> image;
  outputs->GetInformationObject(0)->Set(vtkDataObject::DATA_OBJECT(), image);
}
