#include "vtkVDIReader.h"

#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkInformationVector.h>
#include <vtkMultiProcessController.h>
#include <vtkObjectFactory.h>
#include <vtkStreamingDemandDrivenPipeline.h>

#include "VDIImageData.h"
#include "vdi/core/Error.h"
#include "vdi/io/VdiFile.h"
#include "vtkVDIImageData.h"

vtkStandardNewMacro(vtkVDIReader);

namespace {

bool isRoot() {
  vtkMultiProcessController* controller = vtkMultiProcessController::GetGlobalController();
  return controller == nullptr || controller->GetLocalProcessId() == 0;
}

}  // namespace

vtkVDIReader::vtkVDIReader() {
  this->SetNumberOfInputPorts(0);
}

vtkVDIReader::~vtkVDIReader() {
  this->vtkVDIReader::SetFileName(nullptr);
}

void vtkVDIReader::PrintSelf(ostream& os, vtkIndent indent) {
  this->Superclass::PrintSelf(os, indent);
  os << indent << "FileName: " << (this->FileName ? this->FileName : "(none)") << "\n";
}

int vtkVDIReader::CanReadFile(const char* name) {
  try {
    vdi::io::readVdiInfo(name);
    return 1;
  } catch (const vdi::Error&) {
    return 0;
  }
}

vtkTypeBool vtkVDIReader::ProcessRequest(vtkInformation* request, vtkInformationVector** inputs,
                                         vtkInformationVector* outputs) {
  if (request->Has(vtkDemandDrivenPipeline::REQUEST_DATA_OBJECT())) {
    vtkVDIImageData::MakeOutput(outputs);
    return 1;
  }
  return this->Superclass::ProcessRequest(request, inputs, outputs);
}

int vtkVDIReader::RequestInformation(vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs) {
  vtkInformation* info = outputs->GetInformationObject(0);
  int extent[6] = {0, -1, 0, -1, 0, -1};
  if (isRoot()) {
    try {
      if (this->FileName == nullptr) throw vdi::Error(vdi::ErrorCode::Io, "no file name was given");
      const vdi::io::VdiFileInfo file = vdi::io::readVdiInfo(this->FileName);
      const double range[2] = {file.header.time, file.header.time};
      info->Set(vtkStreamingDemandDrivenPipeline::TIME_STEPS(), range, 1);
      info->Set(vtkStreamingDemandDrivenPipeline::TIME_RANGE(), range, 2);
      extent[1] = file.header.width - 1;
      extent[3] = file.header.height - 1;
      extent[5] = 0;
    } catch (const vdi::Error& error) {
      vtkErrorMacro(<< error.what());
      return 0;
    }
  }
  info->Set(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT(), extent, 6);
  info->Set(vtkDataObject::SPACING(), 1.0, 1.0, 1.0);
  info->Set(vtkDataObject::ORIGIN(), 0.0, 0.0, 0.0);
  vtkDataObject::SetPointDataActiveScalarInfo(info, VTK_UNSIGNED_CHAR, 4);
  return 1;
}

int vtkVDIReader::RequestData(vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs) {
  vtkImageData* output = vtkImageData::GetData(outputs);
  output->Initialize();
  if (!isRoot()) return 1;
  try {
    const vdi::Vdi vdi = vdi::io::readVdi(this->FileName);
    pv::setVdi(output, vdi);
    output->GetInformation()->Set(vtkDataObject::DATA_TIME_STEP(), vdi.time);
  } catch (const std::exception& error) {
    output->Initialize();
    vtkErrorMacro(<< error.what());
    return 0;
  }
  return 1;
}
