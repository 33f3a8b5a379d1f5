#include "vtkVDIWriter.h"

#include <vtkErrorCode.h>
#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkObjectFactory.h>

#include <cstdint>

#include "VDIImageData.h"
#include "vdi/core/Error.h"
#include "vdi/io/VdiFile.h"

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
    vdi::Vdi vdi;
    if (!pv::getVdi(image, vdi)) {
      if (image == nullptr || image->GetNumberOfPoints() == 0) return;  // another rank has it
      throw vdi::Error(vdi::ErrorCode::InvalidArgument,
                       "the input has no VDI; it takes what VolumetricDepthImage or the VDI reader make");
    }
    if (this->FileName == nullptr || *this->FileName == '\0') {
      throw vdi::Error(vdi::ErrorCode::Io,
                       "no file name was given, or its pattern has a {field} of no value");
    }
    if (this->TimeStep >= 0) vdi.timeStep = static_cast<std::uint64_t>(this->TimeStep);
    vdi::io::writeVdi(this->FileName, vdi);
  } catch (const std::exception& error) {
    this->SetErrorCode(vtkErrorCode::CannotOpenFileError);
    vtkErrorMacro(<< error.what());
  }
}
