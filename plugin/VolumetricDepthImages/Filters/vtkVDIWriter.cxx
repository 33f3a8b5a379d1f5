#include "vtkVDIWriter.h"

#include <vtkErrorCode.h>
#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkObjectFactory.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "VDIImageData.h"
#include "VDIReport.h"
#include "vdi/core/Error.h"
#include "vdi/io/Png.h"
#include "vdi/io/VdiFile.h"
#include "vdi/page/Page.h"

namespace {

/// The path's extension in lower case, with its dot.
std::string extensionOf(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char letter) { return static_cast<char>(std::tolower(letter)); });
  return extension;
}

void write(const std::filesystem::path& path, const vdi::Vdi& vdi) {
  if (extensionOf(path) != ".html") {
    vdi::io::writeVdi(path, vdi);
    return;
  }
  const std::string name = path.stem().string();
  const std::vector<vdi::page::PageFrame> frames{{name, [&vdi] { return vdi::io::encode(vdi); }}};
  vdi::page::writePage(path, name, frames);
}

}  // namespace

vtkStandardNewMacro(vtkVDIWriter);

vtkVDIWriter::vtkVDIWriter() = default;

vtkVDIWriter::~vtkVDIWriter() {
  this->vtkVDIWriter::SetFileName(nullptr);
}

void vtkVDIWriter::PrintSelf(ostream& os, vtkIndent indent) {
  this->Superclass::PrintSelf(os, indent);
  os << indent << "FileName: " << (this->FileName ? this->FileName : "(none)") << "\n";
}

int vtkVDIWriter::FillInputPortInformation(int, vtkInformation* info) {
  info->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkImageData");
  return 1;
}

void vtkVDIWriter::WriteData() {
  try {
    auto* image = vtkImageData::SafeDownCast(this->GetInput());
    if (image == nullptr || image->GetNumberOfPoints() == 0) return;  // another rank has it
    if (this->FileName == nullptr || *this->FileName == '\0') {
      throw vdi::Error(vdi::ErrorCode::Io,
                       "no file name was given, or its pattern has a {field} without a value");
    }
    const auto start = std::chrono::steady_clock::now();
    const std::filesystem::path path(this->FileName);
    if (extensionOf(path) == ".png") {
      const glm::vec3 background(this->Background[0], this->Background[1], this->Background[2]);
      vdi::io::writePng(path, vdi::io::toPicture(pv::pictureIn(image), background));
    } else {
      vdi::Vdi vdi;
      if (!pv::getVdi(image, vdi)) {
        throw vdi::Error(vdi::ErrorCode::InvalidArgument, pv::noVdi);
      }
      if (this->TimeStep >= 0) vdi.timeStep = static_cast<std::uint64_t>(this->TimeStep);
      write(path, vdi);
    }
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
    pv::noteOutput(this, {.seconds = spent.count(), .file = path.string()});
  } catch (const std::exception& error) {
    this->SetErrorCode(vtkErrorCode::CannotOpenFileError);
    vtkErrorMacro(<< error.what());
  }
}
