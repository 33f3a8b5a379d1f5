#include "VDIPiece.h"

#include <vtkAbstractArray.h>
#include <vtkDataArray.h>
#include <vtkDoubleArray.h>
#include <vtkFieldData.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkSmartPointer.h>
#include <vtkStringArray.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include "VDIImageData.h"
#include "vdi/core/Error.h"
#include "vdi/io/VdiFile.h"
#include "vtkVDIImageData.h"

namespace pv {

namespace {

constexpr const char* fileName = "VDI.file";
constexpr const char* problemName = "VDI.problem";
constexpr const char* filterName = "VDI.filter";
constexpr const char* boundsName = "VDI.bounds";

void packFile(vtkImageData* image, vtkFieldData* fields) {
  auto* made = vtkVDIImageData::SafeDownCast(image);
  vtkSmartPointer<vtkUnsignedCharArray> file = made != nullptr ? made->GetFile() : nullptr;
  if (file == nullptr) {
    vdi::Vdi vdi;
    getVdi(image, vdi);
    file = fileOf(vdi);
  }
  const auto bytes = static_cast<std::size_t>(file->GetNumberOfValues());
  // ParaView's messages have sizes of 32 bits, and some words of their own.
  constexpr std::size_t most = (std::size_t{1} << 31U) - (std::size_t{1} << 20U);
  if (bytes > most)
    throw vdi::Error(vdi::ErrorCode::InvalidArgument,
                     "This VDI takes " + std::to_string(bytes >> 20U) +
                         " MiB as a file: more than the 2 GiB that ParaView sends to its client. Make one of "
                         "a lower resolution or of fewer supersegments.");
  file->SetName(fileName);
  fields->AddArray(file);
  fields->AddArray(image->GetFieldData()->GetAbstractArray(boundsName));
}

}  // namespace

void packNothing(vtkPolyData* piece) {
  piece->Initialize();
  vtkNew<vtkPoints> points;
  points->InsertNextPoint(0.0, 0.0, 0.0);
  piece->SetPoints(points);
}

void packProblem(const std::string& text, vtkPolyData* piece) {
  packNothing(piece);
  vtkNew<vtkStringArray> array;
  array->SetName(problemName);
  array->InsertNextValue(text);
  piece->GetFieldData()->AddArray(array);
}

void packVdi(vtkDataObject* data, bool crosses, vtkPolyData* piece) {
  packNothing(piece);
  auto* image = vtkImageData::SafeDownCast(data);
  if (image != nullptr && image->GetNumberOfPoints() == 0) {
    const std::string why = waitingIn(image->GetFieldData());
    packProblem(why.empty() ? failedUpstream : noneYet + why + ".", piece);
    return;
  }
  if (image != nullptr && isBeingMade(image->GetFieldData())) {
    piece->GetFieldData()->ShallowCopy(image->GetFieldData());
    return;
  }
  if (image == nullptr || image->GetFieldData()->GetAbstractArray("VDI.offsets") == nullptr) {
    packProblem("This data set has no VDI. The filter Volumetric Depth Image makes one from it.", piece);
    return;
  }
  try {
    if (crosses) {
      packFile(image, piece->GetFieldData());
    } else {
      piece->GetFieldData()->ShallowCopy(image->GetFieldData());
    }
  } catch (const std::exception& error) {
    packProblem(error.what(), piece);
  }
}

bool isSaidUpstream(const std::string& problem) {
  return problem == failedUpstream || problem.starts_with(noneYet);
}

void markFiltered(vtkPolyData* piece) {
  vtkNew<vtkStringArray> array;
  array->SetName(filterName);
  array->InsertNextValue("");
  piece->GetFieldData()->AddArray(array);
}

bool isFiltered(vtkFieldData* fields) {
  return fields->GetAbstractArray(filterName) != nullptr;
}

bool boundsOf(vtkFieldData* fields, double bounds[6]) {
  auto* array = vtkDoubleArray::SafeDownCast(fields->GetAbstractArray(boundsName));
  if (array == nullptr || array->GetNumberOfValues() != 6) return false;
  std::copy_n(array->GetPointer(0), 6, bounds);
  return bounds[0] <= bounds[1] && bounds[2] <= bounds[3] && bounds[4] <= bounds[5];
}

PieceContent contentOf(vtkFieldData* fields) {
  PieceContent content;
  for (int i = 0; i < fields->GetNumberOfArrays(); ++i) {
    vtkAbstractArray* array = fields->GetAbstractArray(i);
    const std::string_view name(array->GetName() != nullptr ? array->GetName() : "");
    if (name.starts_with("VDI.") && name != filterName) content.emplace_back(array, array->GetMTime());
  }
  return content;
}

std::optional<vdi::Vdi> unpackVdi(vtkFieldData* fields) {
  if (auto* problem = vtkStringArray::SafeDownCast(fields->GetAbstractArray(problemName)))
    throw vdi::Error(vdi::ErrorCode::InvalidArgument, problem->GetValue(0));
  if (auto* file = vtkUnsignedCharArray::SafeDownCast(fields->GetAbstractArray(fileName))) {
    const std::span<const unsigned char> bytes(file->GetPointer(0),
                                               static_cast<std::size_t>(file->GetNumberOfValues()));
    return vdi::io::decode(std::as_bytes(bytes));
  }
  vdi::Vdi vdi;
  if (!getVdi(fields, vdi)) return std::nullopt;
  return vdi;
}

}  // namespace pv
