#include "vtkVDIStreamWriter.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>
#include <vtkErrorCode.h>
#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkObjectFactory.h>

#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <string>
#include <utility>

#include "VDIImageData.h"
#include "vdi/core/Error.h"
#include "vdi/page/Page.h"
#include "vdi/stream/GivenToken.h"
#include "vdi/stream/Publisher.h"
#include "vdi/stream/Server.h"
#include "vdi/stream/Token.h"

namespace {

std::string textOf(const char* value) {
  return value != nullptr ? value : "";
}

/// A file that its owner alone can read, and that is there while this lives.
class SecretFile {
 public:
  SecretFile(std::string path, const std::string& line) : path_(std::move(path)) {
    constexpr mode_t ownerOnly = 0600;
    const std::string part = fmt::format("{}.{}.part", path_, ::getpid());
    (void)::unlink(part.c_str());
    const int file = ::open(part.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, ownerOnly);
    const std::string text = line + "\n";
    const bool isWritten =
        file >= 0 && ::write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size());
    int error = isWritten ? 0 : errno;
    if (file >= 0) ::close(file);
    if (error == 0 && std::rename(part.c_str(), path_.c_str()) != 0) error = errno;
    if (error == 0) return;
    (void)::unlink(part.c_str());
    throw vdi::Error(vdi::ErrorCode::Io, std::string("can't write the link: ") + std::strerror(error), path_);
  }
  ~SecretFile() { (void)::unlink(path_.c_str()); }
  SecretFile(const SecretFile&) = delete;
  SecretFile& operator=(const SecretFile&) = delete;

 private:
  std::string path_;
};

}  // namespace

/// The publisher hands its last frame over before the server ends.
struct vtkVDIStreamWriter::Service {
  explicit Service(vdi::stream::ServerOptions options) : Server(std::move(options)), Publisher(Server) {}
  vdi::stream::Server Server;
  vdi::stream::Publisher Publisher;
  std::unique_ptr<SecretFile> Link;
  std::string Told;  // of the publisher's trouble
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
  auto service = std::make_unique<Service>(std::move(options));
  const std::string link = given.empty() ? service->Server.link() : service->Server.address();
  const std::string file = textOf(this->LinkFile);
  if (!file.empty()) service->Link = std::make_unique<SecretFile>(file, link);
  // The token stays out of logs. It's in the file, or known.
  fmt::print(stderr, "VDIStream: serving at {}{}\n", service->Server.address(),
             file.empty() ? "" : "; the link is in " + file);
  this->Running = std::move(service);
}

void vtkVDIStreamWriter::WriteData() {
  try {
    auto* image = vtkImageData::SafeDownCast(this->GetInput());
    auto vdi = std::make_shared<vdi::Vdi>();
    if (!pv::getVdi(image, *vdi)) {
      if (image == nullptr || image->GetNumberOfPoints() == 0) return;  // another rank has it
      throw vdi::Error(vdi::ErrorCode::InvalidArgument,
                       "the input has no VDI; it takes what VolumetricDepthImage or the VDI reader make");
    }
    if (this->TimeStep >= 0) vdi->timeStep = static_cast<std::uint64_t>(this->TimeStep);
    if (!this->Running) this->Start();
    this->Running->Publisher.publish(std::move(vdi));
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
