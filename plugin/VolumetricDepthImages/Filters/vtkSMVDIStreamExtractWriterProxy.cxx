#include "vtkSMVDIStreamExtractWriterProxy.h"

#include <vtkObjectFactory.h>
#include <vtkSMExtractsController.h>
#include <vtkSMPropertyHelper.h>
#include <vtkSMSourceProxy.h>

#include <exception>

#include "VDISteering.h"

vtkStandardNewMacro(vtkSMVDIStreamExtractWriterProxy);

vtkSMVDIStreamExtractWriterProxy::vtkSMVDIStreamExtractWriterProxy()
    : Steering(std::make_unique<pv::Steering>()) {}

vtkSMVDIStreamExtractWriterProxy::~vtkSMVDIStreamExtractWriterProxy() = default;

bool vtkSMVDIStreamExtractWriterProxy::Write(vtkSMExtractsController* extractor) {
  auto* const writer = vtkSMSourceProxy::SafeDownCast(this->GetSubProxy("Writer"));
  if (writer == nullptr) return false;
  vtkSMPropertyHelper(writer, "TimeStep").Set(extractor->GetTimeStep());
  writer->UpdateVTKObjects();
  const bool isSteered = vtkSMPropertyHelper(writer, "Steer").GetAsInt() != 0;
  if (!isSteered || this->Steering->isDue()) writer->UpdatePipeline(extractor->GetTime());
  if (!isSteered) return true;
  try {
    this->Steering->meet(writer, extractor);
  } catch (const std::exception& error) {
    vtkErrorMacro(<< error.what());
    return false;
  }
  return true;
}
