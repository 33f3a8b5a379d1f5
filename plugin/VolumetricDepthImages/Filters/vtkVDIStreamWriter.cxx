#include "vtkVDIStreamWriter.h"

#include <fmt/format.h>
#include <vtkErrorCode.h>
#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkObjectFactory.h>

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <string>
#include <utility>

#include "VDIImageData.h"
#include "VDIReport.h"
#include "vdi/core/Error.h"
#include "vdi/page/Page.h"
#include "vdi/stream/GivenToken.h"
#include "vdi/stream/Publisher.h"
#include "vdi/stream/SecretFile.h"
#include "vdi/stream/Server.h"
#include "vdi/stream/Steering.h"
#include "vdi/stream/Token.h"

namespace {

std::string textOf(const char* value) {
  return value != nullptr ? value : "";
}

}  // namespace

/// The members' order lets the publisher hand its last frame over before the server ends.
struct vtkVDIStreamWriter::Service {
  Service(vdi::stream::ServerOptions options, bool isSteered)
      : Server(Steered(std::move(options), isSteered)), Publisher(Server) {}
  vdi::stream::ServerOptions Steered(vdi::stream::ServerOptions options, bool isSteered) {
    if (isSteered)
      options.steer = [this](std::uint32_t viewer, const vdi::stream::Wish& wish) {
        this->Wishes.put(viewer, wish);
      };
    return options;
  }
  vdi::stream::Wishes Wishes;  // the server's thread uses it
  vdi::stream::Server Server;
  vdi::stream::Publisher Publisher;
  std::unique_ptr<vdi::stream::SecretFile> Link;
  std::string Told;  // the publisher's problem reported last
};

vtkStandardNewMacro(vtkVDIStreamWriter);

vtkVDIStreamWriter::vtkVDIStreamWriter() {
  this->vtkVDIStreamWriter::SetHost("127.0.0.1");
}

vtkVDIStreamWriter::~vtkVDIStreamWriter() {
  this->vtkVDIStreamWriter::SetHost(nullptr);
  this->vtkVDIStreamWriter::SetTokenFile(nullptr);
  this->vtkVDIStreamWriter::SetLinkFile(nullptr);
  this->vtkVDIStreamWriter::SetCertificate(nullptr);
  this->vtkVDIStreamWriter::SetKey(nullptr);
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
  constexpr double bytesPerMegabit = 1e6 / 8.0;
  constexpr int largestPort = 65535;
  if (this->Port < 0 || this->Port > largestPort)
    throw vdi::Error(vdi::ErrorCode::InvalidArgument, fmt::format("there is no port {}", this->Port));
  const std::string given = vdi::stream::givenToken(textOf(this->TokenFile));
  vdi::stream::ServerOptions options;
  options.host = textOf(this->Host);
  options.port = static_cast<std::uint16_t>(this->Port);
  options.token = given.empty() ? vdi::stream::randomToken() : given;
  options.page = vdi::page::emptyPage("Live");
  options.mostBytesPerSecond = this->Rate > 0.0 ? this->Rate * bytesPerMegabit : 0.0;
  options.certificate = textOf(this->Certificate);
  options.key = textOf(this->Key);
  auto service = std::make_unique<Service>(std::move(options), this->Steer);
  const std::string link = given.empty() ? service->Server.link() : service->Server.address();
  const std::string file = textOf(this->LinkFile);
  if (!file.empty()) service->Link = std::make_unique<vdi::stream::SecretFile>(file, link);
  // The token stays out of logs. The user has it in the file or chose it.
  fmt::print(stderr, "VDIStream: serving at {}{}\n", service->Server.address(),
             file.empty() ? "" : "; the link is in " + file);
  this->Running = std::move(service);
}

std::optional<vdi::stream::SteeringRequest> vtkVDIStreamWriter::TakeRequest(
    std::chrono::milliseconds patience) {
  if (!this->Running) return std::nullopt;
  return this->Running->Wishes.take(patience);
}

void vtkVDIStreamWriter::SetControls(const vdi::stream::Controls& controls) {
  if (this->Running) this->Running->Server.setControls(controls);
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
    this->Running->Publisher.publish(std::move(vdi));
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
    pv::noteOutput(this, {.seconds = spent.count(), .dropped = this->Running->Publisher.dropped()});
    const std::string trouble = this->Running->Publisher.trouble();
    if (trouble != this->Running->Told) {
      this->Running->Told = trouble;
      throw vdi::Error(vdi::ErrorCode::Format, "a VDI couldn't be sent: " + trouble);
    }
  } catch (const std::exception& error) {
    this->SetErrorCode(vtkErrorCode::CannotOpenFileError);
    vtkErrorMacro(<< error.what());
  }
}
