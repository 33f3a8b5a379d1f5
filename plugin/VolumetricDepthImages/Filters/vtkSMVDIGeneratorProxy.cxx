#include "vtkSMVDIGeneratorProxy.h"

#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkPVArrayInformation.h>
#include <vtkPVDataInformation.h>
#include <vtkSMInputProperty.h>
#include <vtkSMPropertyHelper.h>
#include <vtkSMProxy.h>
#include <vtkSMTransferFunctionManager.h>
#include <vtkSMTransferFunctionProxy.h>
#include <vtkSmartPointer.h>

vtkStandardNewMacro(vtkSMVDIGeneratorProxy);

void vtkSMVDIGeneratorProxy::UpdatePipeline() {
  this->ChooseLookupTable();
  this->Superclass::UpdatePipeline();
}

void vtkSMVDIGeneratorProxy::UpdatePipeline(double time) {
  this->ChooseLookupTable();
  this->Superclass::UpdatePipeline(time);
}

void vtkSMVDIGeneratorProxy::ChooseLookupTable() {
  vtkSMPropertyHelper table(this, "LookupTable");
  vtkSMPropertyHelper scalars(this, "SelectInputScalars");
  const char* name = scalars.GetNumberOfElements() > 4 ? scalars.GetAsString(4) : nullptr;
  const bool ours =
      table.GetNumberOfElements() == 0 || table.GetAsProxy() == nullptr || !this->Chosen.empty();
  if (!ours || name == nullptr || *name == '\0' || this->Chosen == name) return;
  vtkNew<vtkSMTransferFunctionManager> manager;
  vtkSMProxy* map = manager->GetColorTransferFunction(name, this->GetSessionProxyManager());
  if (map == nullptr) return;
  // A map that nobody has used yet is still on [0, 1]: give it the array's range, as a representation does.
  auto* input = vtkSMSourceProxy::SafeDownCast(vtkSMPropertyHelper(this, "Input").GetAsProxy());
  if (input != nullptr && vtkSMPropertyHelper(map, "ScalarRangeInitialized", true).GetAsInt() == 0) {
    input->UpdatePipeline();
    vtkPVDataInformation* data =
        input->GetDataInformation(vtkSMPropertyHelper(this, "Input").GetOutputPort());
    vtkPVArrayInformation* array = data->GetArrayInformation(name, scalars.GetAsInt(3));
    if (array != nullptr) {
      double range[2];
      array->GetComponentRange(array->GetNumberOfComponents() > 1 ? -1 : 0, range);
      vtkSMTransferFunctionProxy::RescaleTransferFunction(map, range);
      if (vtkSMProxy* opacity = manager->GetOpacityTransferFunction(name, this->GetSessionProxyManager())) {
        vtkSMTransferFunctionProxy::RescaleTransferFunction(opacity, range);
      }
    }
  }
  table.Set(map);
  this->UpdateVTKObjects();
  this->Chosen = name;
}
