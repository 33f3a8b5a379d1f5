#include "VDIArrays.h"

#include <fmt/format.h>
#include <vtkAlgorithm.h>
#include <vtkCellData.h>
#include <vtkCompositeDataIterator.h>
#include <vtkCompositeDataSet.h>
#include <vtkDataArray.h>
#include <vtkDataSetAttributes.h>
#include <vtkImageData.h>
#include <vtkPointData.h>
#include <vtkSmartPointer.h>

#include <string>

namespace pv {

namespace {

vtkDataSetAttributes* attributesOf(vtkImageData* image, bool cells) {
  return cells ? static_cast<vtkDataSetAttributes*>(image->GetCellData()) : image->GetPointData();
}

/// The arrays' names, without ghost marks.
std::string namesOf(vtkDataSetAttributes* attributes) {
  std::string names;
  for (int i = 0; i < attributes->GetNumberOfArrays(); ++i) {
    vtkDataArray* array = attributes->GetArray(i);
    if (array == nullptr || array->GetName() == nullptr) continue;
    const std::string name = array->GetName();
    if (name == vtkDataSetAttributes::GhostArrayName()) continue;
    names += fmt::format("{}'{}'", names.empty() ? "" : ", ", name);
    if (array->GetNumberOfComponents() > 1)
      names += fmt::format(" ({} components)", array->GetNumberOfComponents());
  }
  return names.empty() ? "none" : names;
}

bool has(vtkDataSetAttributes* attributes, const std::string& name) {
  if (name.empty()) return attributes->GetScalars() != nullptr;
  if (attributes->GetArray(name.c_str()) != nullptr) return true;
  // ParaView's names of components: velocity_X, velocity_Magnitude.
  const std::size_t end = name.rfind('_');
  if (end == std::string::npos) return false;
  vtkDataArray* whole = attributes->GetArray(name.substr(0, end).c_str());
  return whole != nullptr && whole->GetNumberOfComponents() > 1;
}

/// The blocks of a data set, those that have the array and those that lack it.
struct Holders {
  int with = 0;
  std::string
      missing;  // names the arrays of the first block that lacks this one; empty if every block has it
};

void count(vtkDataObject* leaf, const ArrayChoice& choice, Holders& holders) {
  auto* image = vtkImageData::SafeDownCast(leaf);
  if (image == nullptr || image->GetNumberOfPoints() == 0) return;
  if (has(attributesOf(image, choice.cells), choice.name)) {
    ++holders.with;
    return;
  }
  if (!holders.missing.empty()) return;
  if (image->GetPointData()->GetNumberOfArrays() + image->GetCellData()->GetNumberOfArrays() == 0) {
    holders.missing = "the data have no arrays, neither of points nor of cells";
    return;
  }
  const char* const kind = choice.cells ? "cells" : "points";
  const std::string lack = choice.name.empty()
                               ? fmt::format("the {} have no active scalars", kind)
                               : fmt::format("no array of {} is named '{}'", kind, choice.name);
  const bool otherHas = !choice.name.empty() && has(attributesOf(image, !choice.cells), choice.name);
  holders.missing =
      fmt::format("{}{}; arrays of points: {}; arrays of cells: {}", lack,
                  otherHas ? fmt::format(" (SelectInputScalars = ['{}', '{}'] asks for the one of {})",
                                         choice.cells ? "POINTS" : "CELLS", choice.name,
                                         choice.cells ? "points" : "cells")
                           : "",
                  namesOf(image->GetPointData()), namesOf(image->GetCellData()));
}

}  // namespace

std::string lackOf(vtkDataObject* data, vtkAlgorithm* producer, const ArrayChoice& choice) {
  // Looks at the source's own output.
  if (producer != nullptr && producer->IsA("vtkPVPostFilter") != 0 &&
      producer->GetNumberOfInputConnections(0) > 0) {
    if (vtkDataObject* original = producer->GetInputDataObject(0, 0)) data = original;
  }
  Holders holders;
  if (auto* composite = vtkCompositeDataSet::SafeDownCast(data)) {
    const auto iterator = vtkSmartPointer<vtkCompositeDataIterator>::Take(composite->NewIterator());
    for (iterator->InitTraversal(); !iterator->IsDoneWithTraversal(); iterator->GoToNextItem())
      count(iterator->GetCurrentDataObject(), choice, holders);
  } else {
    count(data, choice, holders);
  }
  return holders.with == 0 ? holders.missing : "";
}

}  // namespace pv
