#include "vtkVDIReader.h"

#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkInformationVector.h>
#include <vtkMultiProcessController.h>
#include <vtkObjectFactory.h>
#include <vtkStreamingDemandDrivenPipeline.h>

#include <cstdint>
#include <exception>
#include <filesystem>
#include <future>
#include <optional>
#include <system_error>
#include <utility>

#include "VDIImageData.h"
#include "vdi/core/Error.h"
#include "vdi/io/VdiFile.h"
#include "vdi/pipeline/Pipeline.h"
#include "vtkVDIImageData.h"

vtkStandardNewMacro(vtkVDIReader);

namespace {

bool isRoot() {
  vtkMultiProcessController* controller = vtkMultiProcessController::GetGlobalController();
  return controller == nullptr || controller->GetLocalProcessId() == 0;
}

/// What tells that a file isn't what it was.
struct FileState {
  std::filesystem::file_time_type written;
  std::uintmax_t bytes = 0;

  bool operator==(const FileState&) const = default;
};

std::optional<FileState> stateOf(const std::string& name) {
  std::error_code error;
  FileState state;
  state.written = std::filesystem::last_write_time(name, error);
  if (!error) state.bytes = std::filesystem::file_size(name, error);
  return error ? std::nullopt : std::optional(state);
}

}  // namespace

struct vtkVDIReader::Contents {
  vdi::Vdi Vdi;
  vdi::Image Flat;

  explicit Contents(const std::string& name) : Vdi(vdi::io::readVdi(name)), Flat(vdi::flatten(this->Vdi)) {}
};

struct vtkVDIReader::Ahead {
  std::string Name;
  std::optional<FileState> State;  // before it's read
  std::future<Contents> Job;
};

vtkVDIReader::vtkVDIReader() {
  this->SetNumberOfInputPorts(0);
}

void vtkVDIReader::Prefetch(const std::string& name) {
  if (!isRoot() || (this->Next && this->Next->Name == name)) return;
  this->Next = std::make_unique<Ahead>();
  this->Next->Name = name;
  this->Next->State = stateOf(name);
  this->Next->Job = std::async(std::launch::async, [name] { return Contents(name); });
}

vtkVDIReader::Contents vtkVDIReader::Read() {
  if (this->FileName == nullptr) throw vdi::Error(vdi::ErrorCode::Io, "no file name was given");
  const std::string name = this->FileName;
  if (this->Next && this->Next->Name == name) {
    const std::unique_ptr<Ahead> ahead = std::move(this->Next);
    if (ahead->State && ahead->State == stateOf(name)) {
      try {
        return ahead->Job.get();
      } catch (const std::exception&) {  // what's wrong is said by whoever was asked for it
      }
    }
  }
  return Contents(name);
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
      extent[1] = file.header.pictureSize().x - 1;
      extent[3] = file.header.pictureSize().y - 1;
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
    const Contents contents = this->Read();
    pv::setVdi(output, contents.Vdi, contents.Flat);
    output->GetInformation()->Set(vtkDataObject::DATA_TIME_STEP(), contents.Vdi.time);
  } catch (const std::exception& error) {
    output->Initialize();
    vtkErrorMacro(<< error.what());
    return 0;
  }
  return 1;
}
