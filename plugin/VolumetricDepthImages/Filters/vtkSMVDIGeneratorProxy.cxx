#include "vtkSMVDIGeneratorProxy.h"

#include <vtkCommunicator.h>
#include <vtkMultiProcessController.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkPVArrayInformation.h>
#include <vtkPVDataInformation.h>
#include <vtkProcessModule.h>
#include <vtkSMInputProperty.h>
#include <vtkSMPropertyHelper.h>
#include <vtkSMProxy.h>
#include <vtkSMTransferFunctionManager.h>
#include <vtkSMTransferFunctionProxy.h>
#include <vtkSmartPointer.h>

#include <limits>

namespace {

/// Where each rank has a client of its own (pvbatch --symmetric, Catalyst), each knows the range of its own
/// data only.
void WidenOverRanks(double range[2]) {
  vtkMultiProcessController* controller = vtkMultiProcessController::GetGlobalController();
  if (!vtkProcessModule::GetProcessModule()->GetSymmetricMPIMode() || controller == nullptr) return;
  const double mine[2] = {-range[0], range[1]};
  double all[2];
  controller->AllReduce(mine, all, 2, vtkCommunicator::MAX_OP);
  range[0] = -all[0];
  range[1] = all[1];
}

}  // namespace

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
    double range[2] = {std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
    if (vtkPVArrayInformation* array = data->GetArrayInformation(name, scalars.GetAsInt(3))) {
      array->GetComponentRange(array->GetNumberOfComponents() > 1 ? -1 : 0, range);
    }
    WidenOverRanks(range);
    if (range[0] <= range[1]) {
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
