#include "vtkVDIForViews.h"

#include <vtkCompositeDataPipeline.h>
#include <vtkDataObject.h>
#include <vtkInformation.h>
#include <vtkInformationVector.h>
#include <vtkObjectFactory.h>
#include <vtkSmartPointer.h>

#include "vtkVDIGenerator.h"

vtkStandardNewMacro(vtkVDIForViews);

namespace {

/// Calls BeginView before, and EndView after, each request that goes upstream.
class Executive : public vtkCompositeDataPipeline {
 public:
  static Executive* New();
  vtkTypeMacro(Executive, vtkCompositeDataPipeline);

  int ComputePipelineMTime(vtkInformation* request, vtkInformationVector** inputs,
                           vtkInformationVector* outputs, int port, vtkMTimeType* time) override {
    const vtkVDIForViews::Bracket bracket(this->GetAlgorithm());
    return this->Superclass::ComputePipelineMTime(request, inputs, outputs, port, time);
  }

 protected:
  Executive() = default;
  ~Executive() override = default;

  int ForwardUpstream(vtkInformation* request) override {
    const vtkVDIForViews::Bracket bracket(this->GetAlgorithm());
    return this->Superclass::ForwardUpstream(request);
  }
  int ForwardUpstream(int i, int j, vtkInformation* request) override {
    const vtkVDIForViews::Bracket bracket(this->GetAlgorithm());
    return this->Superclass::ForwardUpstream(i, j, request);
  }

 private:
  Executive(const Executive&) = delete;
  void operator=(const Executive&) = delete;
};

vtkStandardNewMacro(Executive);

}  // namespace

vtkVDIForViews::Bracket::Bracket(vtkAlgorithm* algorithm) : Generator(GeneratorOf(algorithm)) {
  if (this->Generator != nullptr) this->Generator->BeginView();
}

vtkVDIForViews::Bracket::~Bracket() {
  if (this->Generator != nullptr) this->Generator->EndView();
}

vtkVDIGenerator* vtkVDIForViews::GeneratorOf(vtkAlgorithm* algorithm) {
  while (algorithm != nullptr && vtkVDIGenerator::SafeDownCast(algorithm) == nullptr) {
    const bool hasInput =
        algorithm->GetNumberOfInputPorts() > 0 && algorithm->GetNumberOfInputConnections(0) > 0;
    algorithm = hasInput ? algorithm->GetInputAlgorithm(0, 0) : nullptr;
  }
  return vtkVDIGenerator::SafeDownCast(algorithm);
}

vtkExecutive* vtkVDIForViews::CreateDefaultExecutive() {
  return Executive::New();
}

int vtkVDIForViews::FillInputPortInformation(int, vtkInformation* info) {
  info->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkDataObject");
  return 1;
}

int vtkVDIForViews::RequestData(vtkInformation*, vtkInformationVector** inputs,
                                vtkInformationVector* outputs) {
  vtkDataObject::GetData(outputs)->ShallowCopy(vtkDataObject::GetData(inputs[0]));
  return 1;
}
