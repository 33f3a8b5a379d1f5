#include "VDIBlocks.h"

#include <fmt/format.h>
#include <vtkCellData.h>
#include <vtkCompositeDataIterator.h>
#include <vtkCompositeDataSet.h>
#include <vtkDataArray.h>
#include <vtkDiscretizableColorTransferFunction.h>
#include <vtkDoubleArray.h>
#include <vtkImageData.h>
#include <vtkMatrix3x3.h>
#include <vtkOverlappingAMR.h>
#include <vtkPiecewiseFunction.h>
#include <vtkPointData.h>
#include <vtkSmartPointer.h>
#include <vtkUniformGridAMRDataIterator.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "vdi/core/Error.h"

namespace pv {

namespace {

using vdi::Error;
using vdi::ErrorCode;

struct TypedArray {
  vdi::ScalarType type;
  vtkSmartPointer<vtkDataArray> array;  // contiguous, one component
};

/// The library's type for a VTK type of that size; false for 64-bit integers and what isn't a number.
bool scalarTypeOf(int vtkType, vdi::ScalarType& type) {
  switch (vtkType) {
    case VTK_UNSIGNED_CHAR:
      type = vdi::ScalarType::U8;
      return true;
    case VTK_CHAR:
      type = std::is_signed_v<char> ? vdi::ScalarType::I8 : vdi::ScalarType::U8;
      return true;
    case VTK_SIGNED_CHAR:
      type = vdi::ScalarType::I8;
      return true;
    case VTK_UNSIGNED_SHORT:
      type = vdi::ScalarType::U16;
      return true;
    case VTK_SHORT:
      type = vdi::ScalarType::I16;
      return true;
    case VTK_UNSIGNED_INT:
      type = vdi::ScalarType::U32;
      return true;
    case VTK_INT:
      type = vdi::ScalarType::I32;
      return true;
    case VTK_FLOAT:
      type = vdi::ScalarType::F32;
      return true;
    case VTK_DOUBLE:
      type = vdi::ScalarType::F64;
      return true;
    default:
      return false;
  }
}

vtkSmartPointer<vtkDataArray> magnitudeOf(vtkDataArray* array) {
  auto result = vtkSmartPointer<vtkDoubleArray>::New();
  result->SetNumberOfTuples(array->GetNumberOfTuples());
  for (vtkIdType i = 0; i < array->GetNumberOfTuples(); ++i) {
    double sum = 0.0;
    for (int c = 0; c < array->GetNumberOfComponents(); ++c)
      sum += array->GetComponent(i, c) * array->GetComponent(i, c);
    result->SetValue(i, std::sqrt(sum));
  }
  return result;
}

TypedArray typed(vtkDataArray* array, int component) {
  TypedArray result{vdi::ScalarType::F64, array};
  if (array->GetNumberOfComponents() > 1) {
    if (component >= array->GetNumberOfComponents()) {
      throw Error(ErrorCode::InvalidArgument,
                  fmt::format("there is no component {}, the array has {}", component,
                              array->GetNumberOfComponents()),
                  array->GetName());
    }
    if (component < 0) {
      result.array = magnitudeOf(array);
    } else {
      auto one = vtkSmartPointer<vtkDataArray>::Take(vtkDataArray::CreateDataArray(array->GetDataType()));
      one->SetNumberOfTuples(array->GetNumberOfTuples());
      one->CopyComponent(0, array, component);
      result.array = one;
    }
  }
  const bool known = scalarTypeOf(result.array->GetDataType(), result.type);
  if (!known || !result.array->HasStandardMemoryLayout()) {
    const int type = known ? result.array->GetDataType() : VTK_DOUBLE;  // 64-bit integers as double
    auto copy = vtkSmartPointer<vtkDataArray>::Take(vtkDataArray::CreateDataArray(type));
    copy->DeepCopy(result.array);
    result.array = copy;
    scalarTypeOf(type, result.type);
  }
  return result;
}

/// Where an image's cells lie.
struct Lattice {
  glm::dvec3 origin;  // lower corner of the first cell
  glm::dvec3 spacing;
  glm::ivec3 points;
  glm::ivec3 cells;
};

/// Cells of the image that are its own, as disjoint boxes [lo, hi) of cell indices: all of them in one box
/// unless ghost or blanked cells say otherwise, or `finer` blocks of an AMR data set cover some. Boxes grow
/// along x, then y, then z, so that whole ghost layers leave one box.
struct CellBox {
  glm::ivec3 lo;
  glm::ivec3 hi;
};

std::vector<CellBox> ownCells(vtkImageData* image, const Lattice& lattice,
                              const std::vector<vdi::Box>& finer) {
  constexpr unsigned char notOurs = vtkDataSetAttributes::DUPLICATECELL | vtkDataSetAttributes::REFINEDCELL |
                                    vtkDataSetAttributes::HIDDENCELL;
  const glm::ivec3& cells = lattice.cells;
  vtkUnsignedCharArray* ghosts = image->GetCellGhostArray();
  if (ghosts == nullptr && finer.empty()) return {{glm::ivec3(0), cells}};
  const auto index = [&](int x, int y, int z) {
    return (static_cast<std::size_t>(z) * static_cast<std::size_t>(cells.y) + static_cast<std::size_t>(y)) *
               static_cast<std::size_t>(cells.x) +
           static_cast<std::size_t>(x);
  };
  std::vector<bool> open(index(cells.x - 1, cells.y - 1, cells.z - 1) + 1, true);
  if (ghosts != nullptr) {
    const unsigned char* flags = ghosts->GetPointer(0);
    for (std::size_t i = 0; i < open.size(); ++i) open[i] = (flags[i] & notOurs) == 0;
  }
  for (const vdi::Box& box : finer) {
    // Finer boxes begin and end with coarse cells; a cell is covered if its middle is.
    const glm::dvec3 lo = glm::ceil((box.lo - lattice.origin) / lattice.spacing - 0.5);
    const glm::dvec3 hi = glm::ceil((box.hi - lattice.origin) / lattice.spacing - 0.5);
    const glm::ivec3 first(glm::clamp(lo, glm::dvec3(0.0), glm::dvec3(cells)));
    const glm::ivec3 last(glm::clamp(hi, glm::dvec3(0.0), glm::dvec3(cells)));
    for (int z = first.z; z < last.z; ++z) {
      for (int y = first.y; y < last.y; ++y) {
        for (int x = first.x; x < last.x; ++x) open[index(x, y, z)] = false;
      }
    }
  }
  const auto allOpen = [&](const CellBox& box) {
    for (int z = box.lo.z; z < box.hi.z; ++z) {
      for (int y = box.lo.y; y < box.hi.y; ++y) {
        for (int x = box.lo.x; x < box.hi.x; ++x) {
          if (!open[index(x, y, z)]) return false;
        }
      }
    }
    return true;
  };
  std::vector<CellBox> boxes;
  for (int z = 0; z < cells.z; ++z) {
    for (int y = 0; y < cells.y; ++y) {
      for (int x = 0; x < cells.x; ++x) {
        if (!open[index(x, y, z)]) continue;
        CellBox box{{x, y, z}, {x + 1, y + 1, z + 1}};
        for (int axis = 0; axis < 3; ++axis) {
          while (box.hi[axis] < cells[axis]) {
            CellBox next = box;
            next.lo[axis] = box.hi[axis];
            next.hi[axis] = box.hi[axis] + 1;
            if (!allOpen(next)) break;
            box.hi[axis] = next.hi[axis];
          }
        }
        for (int k = box.lo.z; k < box.hi.z; ++k) {
          for (int j = box.lo.y; j < box.hi.y; ++j) {
            for (int i = box.lo.x; i < box.hi.x; ++i) open[index(i, j, k)] = false;
          }
        }
        boxes.push_back(box);
      }
    }
  }
  return boxes;
}

void addImage(vtkImageData* image, const ArrayChoice& choice, const std::vector<vdi::Box>& finer,
              std::vector<vdi::Block>& blocks) {
  if (image->GetNumberOfPoints() == 0) return;
  if (!image->GetDirectionMatrix()->IsIdentity()) {
    throw Error(ErrorCode::InvalidArgument,
                "rotated images (a direction matrix) can't be handled; resample them first");
  }
  auto* attributes =
      choice.cells ? static_cast<vtkDataSetAttributes*>(image->GetCellData()) : image->GetPointData();
  vtkDataArray* array =
      choice.name.empty() ? attributes->GetScalars() : attributes->GetArray(choice.name.c_str());
  if (array == nullptr) {
    throw Error(ErrorCode::InvalidArgument,
                fmt::format("a block has no {} array '{}'", choice.cells ? "cell" : "point", choice.name));
  }
  const TypedArray scalars = typed(array, choice.component);
  int extent[6];
  image->GetExtent(extent);
  Lattice lattice;
  for (int axis = 0; axis < 3; ++axis) {
    lattice.spacing[axis] = image->GetSpacing()[axis];
    const std::ptrdiff_t side = std::ptrdiff_t{2} * axis;
    lattice.origin[axis] = image->GetOrigin()[axis] + extent[side] * lattice.spacing[axis];
    lattice.points[axis] = extent[side + 1] - extent[side] + 1;
  }
  lattice.cells = glm::max(lattice.points - 1, glm::ivec3(1));
  const auto& [origin, spacing, points, cells] = lattice;
  // The deleter's copy of the smart pointer is what keeps the array alive.
  const std::shared_ptr<const void> keepAlive(
      scalars.array->GetVoidPointer(0), [array = scalars.array](const void*) mutable { array = nullptr; });
  for (const CellBox& box : ownCells(image, lattice, finer)) {
    vdi::Block block = choice.cells
                           ? vdi::Block::fromCells(cells, origin, spacing, scalars.type, keepAlive.get())
                           : vdi::Block::fromPoints(points, origin, spacing, scalars.type, keepAlive.get());
    // A lattice that is one point thick has no cell there, and so owns nothing.
    for (int axis = 0; axis < 3; ++axis) {
      if (points[axis] == 1) continue;
      block.owned.lo[axis] = origin[axis] + box.lo[axis] * spacing[axis];
      block.owned.hi[axis] = origin[axis] + box.hi[axis] * spacing[axis];
    }
    block.keepAlive = keepAlive;
    blocks.push_back(std::move(block));
  }
}

void addLeaf(vtkDataObject* leaf, const ArrayChoice& choice, const std::vector<vdi::Box>& finer,
             std::vector<vdi::Block>& blocks) {
  if (leaf == nullptr) return;
  auto* image = vtkImageData::SafeDownCast(leaf);
  if (image == nullptr) {
    throw Error(
        ErrorCode::InvalidArgument,
        fmt::format(
            "{} can't be turned into a VDI; what can is vtkImageData, alone or in multiblock, partitioned "
            "or AMR data sets (Resample To Image makes it of anything)",
            leaf->GetClassName()));
  }
  addImage(image, choice, finer, blocks);
}

/// Blocks of a level with what the levels above it leave of them. Where every level's blocks lie is known on
/// all ranks.
void addOverlapping(vtkOverlappingAMR* amr, const ArrayChoice& choice, std::vector<vdi::Block>& blocks) {
  const auto iterator = vtkSmartPointer<vtkUniformGridAMRDataIterator>::Take(
      vtkUniformGridAMRDataIterator::SafeDownCast(amr->NewIterator()));
  unsigned int level = amr->GetNumberOfLevels();
  std::vector<vdi::Box> finer;
  for (iterator->InitTraversal(); !iterator->IsDoneWithTraversal(); iterator->GoToNextItem()) {
    if (iterator->GetCurrentLevel() != level) {
      level = iterator->GetCurrentLevel();
      finer.clear();
      for (unsigned int above = level + 1; above < amr->GetNumberOfLevels(); ++above) {
        for (unsigned int i = 0; i < amr->GetNumberOfDataSets(above); ++i) {
          double b[6];
          amr->GetBounds(above, i, b);
          finer.push_back({{b[0], b[2], b[4]}, {b[1], b[3], b[5]}});
        }
      }
    }
    addLeaf(iterator->GetCurrentDataObject(), choice, finer, blocks);
  }
}

/// Filters that pass a data set on give it a new time of modification, its arrays keep theirs.
void addIdentity(vtkDataObject* leaf, std::vector<std::uint64_t>& identity) {
  auto* image = vtkImageData::SafeDownCast(leaf);
  if (image == nullptr) {
    if (leaf != nullptr) identity.push_back(leaf->GetMTime());
    return;
  }
  const auto addPlace = [&identity](const double* values, int count) {
    for (int i = 0; i < count; ++i) identity.push_back(std::bit_cast<std::uint64_t>(values[i]));
  };
  addPlace(image->GetOrigin(), 3);
  addPlace(image->GetSpacing(), 3);
  addPlace(image->GetDirectionMatrix()->GetData(), 9);
  for (int i = 0; i < 6; ++i) identity.push_back(static_cast<std::uint64_t>(image->GetExtent()[i]));
  for (vtkDataSetAttributes* attributes : {static_cast<vtkDataSetAttributes*>(image->GetPointData()),
                                           static_cast<vtkDataSetAttributes*>(image->GetCellData())}) {
    identity.push_back(static_cast<std::uint64_t>(attributes->GetNumberOfArrays()));
    for (int i = 0; i < attributes->GetNumberOfArrays(); ++i) {
      vtkAbstractArray* array = attributes->GetAbstractArray(i);
      identity.push_back(reinterpret_cast<std::uintptr_t>(array));
      identity.push_back(array->GetMTime());
    }
    identity.push_back(reinterpret_cast<std::uintptr_t>(attributes->GetScalars()));
  }
}

constexpr int colorSamples = 1024;

}  // namespace

std::vector<vdi::Block> blocksOf(vtkDataObject* data, const ArrayChoice& choice) {
  std::vector<vdi::Block> blocks;
  auto* composite = vtkCompositeDataSet::SafeDownCast(data);
  if (composite == nullptr) {
    addLeaf(data, choice, {}, blocks);
    return blocks;
  }
  if (auto* amr = vtkOverlappingAMR::SafeDownCast(data)) {
    addOverlapping(amr, choice, blocks);
    return blocks;
  }
  const auto iterator = vtkSmartPointer<vtkCompositeDataIterator>::Take(composite->NewIterator());
  for (iterator->InitTraversal(); !iterator->IsDoneWithTraversal(); iterator->GoToNextItem()) {
    addLeaf(iterator->GetCurrentDataObject(), choice, {}, blocks);
  }
  return blocks;
}

std::vector<std::uint64_t> identityOf(vtkDataObject* data) {
  std::vector<std::uint64_t> identity;
  auto* composite = vtkCompositeDataSet::SafeDownCast(data);
  if (composite == nullptr) {
    addIdentity(data, identity);
    return identity;
  }
  // Of AMR also which parts of a level are those of another.
  if (vtkOverlappingAMR::SafeDownCast(data) != nullptr) identity.push_back(data->GetMTime());
  const auto iterator = vtkSmartPointer<vtkCompositeDataIterator>::Take(composite->NewIterator());
  for (iterator->InitTraversal(); !iterator->IsDoneWithTraversal(); iterator->GoToNextItem()) {
    identity.push_back(iterator->GetCurrentFlatIndex());
    addIdentity(iterator->GetCurrentDataObject(), identity);
  }
  return identity;
}

vdi::TransferFunction transferFunctionOf(vtkScalarsToColors* colors, vtkPiecewiseFunction* opacity,
                                         double low, double high, double unitDistance) {
  vdi::TransferFunction function;
  function.unitDistance = unitDistance;
  vtkSmartPointer<vtkScalarsToColors> map = colors;
  if (map == nullptr) {
    auto coolToWarm = vtkSmartPointer<vtkColorTransferFunction>::New();
    coolToWarm->SetColorSpaceToDiverging();
    coolToWarm->AddRGBPoint(low, 0.231373, 0.298039, 0.752941);
    coolToWarm->AddRGBPoint(0.5 * (low + high), 0.865, 0.865, 0.865);
    coolToWarm->AddRGBPoint(high, 0.705882, 0.0156863, 0.14902);
    map = coolToWarm;
  }
  if (auto* discretizable = vtkDiscretizableColorTransferFunction::SafeDownCast(map)) {
    if (opacity == nullptr) opacity = discretizable->GetScalarOpacityFunction();
    discretizable->Build();
  }
  const double* mapRange = map->GetRange();
  std::vector<double> places;
  places.reserve(colorSamples);
  for (int i = 0; i < colorSamples; ++i) {
    places.push_back(mapRange[0] + (mapRange[1] - mapRange[0]) * i / (colorSamples - 1));
  }
  if (auto* nodes = vtkColorTransferFunction::SafeDownCast(map)) {
    for (int i = 0; i < nodes->GetSize(); ++i) {
      double node[6];
      nodes->GetNodeValue(i, node);
      places.push_back(node[0]);
    }
  }
  std::sort(places.begin(), places.end());
  places.erase(std::unique(places.begin(), places.end()), places.end());
  for (const double x : places) {
    double rgb[3];
    map->GetColor(x, rgb);
    function.colors.push_back({x, glm::clamp(glm::dvec3(rgb[0], rgb[1], rgb[2]), 0.0, 1.0)});
  }
  if (opacity == nullptr || opacity->GetSize() == 0) {
    function.opacities = {{mapRange[0], 0.0}, {mapRange[1], 1.0}};
    return function;
  }
  // Between nodes the function may bend (midpoint, sharpness): sixteen samples each.
  constexpr int between = 16;
  for (int i = 0; i < opacity->GetSize(); ++i) {
    double node[4];
    double next[4];
    opacity->GetNodeValue(i, node);
    function.opacities.push_back({node[0], std::clamp(node[1], 0.0, 1.0)});
    if (i + 1 == opacity->GetSize()) break;
    opacity->GetNodeValue(i + 1, next);
    if (node[2] == 0.5 && node[3] == 0.0) continue;  // linear
    for (int k = 1; k < between; ++k) {
      const double x = node[0] + (next[0] - node[0]) * k / between;
      function.opacities.push_back({x, std::clamp(opacity->GetValue(x), 0.0, 1.0)});
    }
  }
  return function;
}

}  // namespace pv
