#include "vtkVDIReader.h"

#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkInformationVector.h>
#include <vtkObjectFactory.h>
#include <vtkStreamingDemandDrivenPipeline.h>

#include <exception>
#include <future>
#include <optional>
#include <utility>

#include "VDIFileState.h"
#include "VDIImageData.h"
#include "VDIRetire.h"
#include "VDISession.h"
#include "VDIValues.h"
#include "vdi/core/Error.h"
#include "vdi/core/Flatten.h"
#include "vdi/io/VdiFile.h"
#include "vtkVDIImageData.h"

vtkStandardNewMacro(vtkVDIReader);

struct vtkVDIReader::Contents {
  vdi::Vdi Vdi;
  vdi::Image Flat;

  explicit Contents(const std::string& name) : Vdi(vdi::io::readVdi(name)), Flat(vdi::flatten(this->Vdi)) {}
};

struct vtkVDIReader::Ahead {
  std::string Name;
  std::optional<pv::FileState> State;  // before the read
  std::future<Contents> Job;
};

vtkVDIReader::vtkVDIReader() {
  this->SetNumberOfInputPorts(0);
}

void vtkVDIReader::Prefetch(const std::string& name) {
  if (!pv::isRoot() || (this->Next && this->Next->Name == name)) return;
  if (this->Next) pv::retire(std::move(this->Next));
  this->Next = std::make_unique<Ahead>();
  this->Next->Name = name;
  this->Next->State = pv::stateOf(name);
  this->Next->Job = std::async(std::launch::async, [name] { return Contents(name); });
}

vtkVDIReader::Contents vtkVDIReader::Read() {
  if (this->FileName == nullptr) throw vdi::Error(vdi::ErrorCode::Io, "no file name was given");
  const std::string name = this->FileName;
  if (this->Next && this->Next->Name == name) {
    std::unique_ptr<Ahead> ahead = std::move(this->Next);
    if (!ahead->State || ahead->State != pv::stateOf(name)) {
      pv::retire(std::move(ahead));
    } else {
      try {
        return ahead->Job.get();
      } catch (const std::exception&) {  // reading it again reports the error
      }
    }
  }
  return Contents(name);
}

vtkVDIReader::~vtkVDIReader() {
  this->vtkVDIReader::SetFileName(nullptr);
  if (this->Next) pv::retire(std::move(this->Next));
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
  std::optional<Announced> announced;
  if (this->FileName != nullptr) {
    const auto found = this->Series.find(this->FileName);
    if (found != this->Series.end()) announced = found->second;
  }
  if (!announced && pv::isRoot()) {
    try {
      if (this->FileName == nullptr) throw vdi::Error(vdi::ErrorCode::Io, "no file name was given");
      const vdi::Vdi header = vdi::io::readVdiInfo(this->FileName).header;
      announced = {.Time = header.time, .Width = header.pictureSize().x, .Height = header.pictureSize().y};
    } catch (const vdi::Error& error) {
      vtkErrorMacro(<< error.what());
      return 0;
    }
  }
  if (announced) {
    const double range[2] = {announced->Time, announced->Time};
    info->Set(vtkStreamingDemandDrivenPipeline::TIME_STEPS(), range, 1);
    info->Set(vtkStreamingDemandDrivenPipeline::TIME_RANGE(), range, 2);
  }
  if (pv::isRoot()) {
    extent[1] = announced->Width - 1;
    extent[3] = announced->Height - 1;
    extent[5] = 0;
  }
  pv::announcePicture(info, extent);
  return 1;
}

int vtkVDIReader::RequestData(vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs) {
  vtkImageData* output = vtkImageData::GetData(outputs);
  output->Initialize();
  if (!pv::isRoot()) return 1;
  try {
    const Contents contents = this->Read();
    pv::setVdi(output, contents.Vdi, contents.Flat);
    if (contents.Vdi.coloring) pv::setShownRange(output, *contents.Vdi.coloring);
    output->GetInformation()->Set(vtkDataObject::DATA_TIME_STEP(), contents.Vdi.time);
    this->Said.clear();
  } catch (const std::exception& error) {
    output->Initialize();
    // The pipeline repeats requests that fail, so each error is reported once.
    if (this->Said != error.what()) vtkErrorMacro(<< error.what());
    this->Said = error.what();
    return 0;
  }
  return 1;
}
