#include "vtkVDIStreamWriter.h"

#include <fmt/format.h>
#include <vtkErrorCode.h>
#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkObjectFactory.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <iterator>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "VDIImageData.h"
#include "VDIReport.h"
#include "vdi/core/Error.h"
#include "vdi/page/Page.h"
#include "vdi/stream/LiveStream.h"
#include "vdi/stream/Steering.h"

namespace {

std::string textOf(const char* value) {
  return value != nullptr ? value : "";
}

std::vector<std::string> wordsOf(const char* value) {
  std::istringstream text(textOf(value));
  return {std::istream_iterator<std::string>(text), {}};
}

}  // namespace

vtkStandardNewMacro(vtkVDIStreamWriter);

vtkVDIStreamWriter::vtkVDIStreamWriter() {
  this->vtkVDIStreamWriter::SetHost("127.0.0.1");
  this->vtkVDIStreamWriter::SetTitle("Live");
}

vtkVDIStreamWriter::~vtkVDIStreamWriter() {
  this->vtkVDIStreamWriter::SetHost(nullptr);
  this->vtkVDIStreamWriter::SetTokenFile(nullptr);
  this->vtkVDIStreamWriter::SetLinkFile(nullptr);
  this->vtkVDIStreamWriter::SetTitle(nullptr);
  this->vtkVDIStreamWriter::SetCertificate(nullptr);
  this->vtkVDIStreamWriter::SetKey(nullptr);
  this->vtkVDIStreamWriter::SetOrigins(nullptr);
  this->vtkVDIStreamWriter::SetEmbedIn(nullptr);
  this->vtkVDIStreamWriter::SetSteeringLog(nullptr);
}

void vtkVDIStreamWriter::PrintSelf(ostream& os, vtkIndent indent) {
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Host: " << textOf(this->Host) << "\n" << indent << "Port: " << this->Port << "\n";
}

int vtkVDIStreamWriter::FillInputPortInformation(int, vtkInformation* info) {
  info->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkImageData");
  return 1;
}

void vtkVDIStreamWriter::Start() {
  constexpr int largestPort = 65535;
  if (this->Port < 0 || this->Port > largestPort)
    throw vdi::Error(vdi::ErrorCode::InvalidArgument,
                     fmt::format("the port must be from 0 to 65535, but is {}", this->Port));
  this->Running = std::make_unique<vdi::stream::LiveStream>(
      vdi::stream::LiveOptions{.host = textOf(this->Host),
                               .port = static_cast<std::uint16_t>(this->Port),
                               .tokenFile = textOf(this->TokenFile),
                               .linkFile = textOf(this->LinkFile),
                               .certificate = textOf(this->Certificate),
                               .key = textOf(this->Key),
                               .origins = wordsOf(this->Origins),
                               .originOption = "Writer.Origins = \"{}\"",
                               .embedders = wordsOf(this->EmbedIn),
                               .megabits = std::max(this->Rate, 0.0),
                               .isSteered = this->Steer,
                               .page = vdi::page::emptyPage(textOf(this->Title)),
                               .programName = "VDIStream"});
}

std::optional<vdi::stream::SteeringRequest> vtkVDIStreamWriter::TakeRequest(
    std::chrono::milliseconds patience) {
  if (!this->Running) return std::nullopt;
  return this->Running->takeRequest(patience);
}

void vtkVDIStreamWriter::SetControls(const vdi::stream::Controls& controls) {
  if (this->Running) this->Running->setControls(controls);
}

void vtkVDIStreamWriter::WriteData() {
  const auto start = std::chrono::steady_clock::now();
  try {
    auto* image = vtkImageData::SafeDownCast(this->GetInput());
    auto vdi = std::make_shared<vdi::Vdi>();
    if (!pv::getVdi(image, *vdi)) {
      if (image == nullptr || image->GetNumberOfPoints() == 0) return;  // another rank has it
      throw vdi::Error(vdi::ErrorCode::InvalidArgument, pv::noVdi);
    }
    if (this->TimeStep >= 0) vdi->timeStep = static_cast<std::uint64_t>(this->TimeStep);
    if (!this->Running) this->Start();
    this->Running->publish(std::move(vdi));
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
    pv::noteOutput(this, {.seconds = spent.count(), .dropped = this->Running->dropped()});
    this->Running->requireSent();
  } catch (const std::exception& error) {
    this->SetErrorCode(vtkErrorCode::CannotOpenFileError);
    vtkErrorMacro(<< error.what());
  }
}
