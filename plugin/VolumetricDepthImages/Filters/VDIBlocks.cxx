#include "VDIBlocks.h"

#include <fmt/format.h>
#include <vtkCellData.h>
#include <vtkCompositeDataIterator.h>
#include <vtkCompositeDataSet.h>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkMatrix3x3.h>
#include <vtkPointData.h>
#include <vtkSmartPointer.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <type_traits>

#include "plugin/VolumetricDepthImages/StridedSource.h"
#include "vdi/core/BitCast.h"
#include "vdi/core/ComponentValues.h"
#include "vdi/core/Error.h"

namespace pv {

namespace {

using vdi::Error;
using vdi::ErrorCode;

/// An array's values in memory, and their owner.
struct Memory {
  vdi::ComponentArray values;
  glm::dvec3 offset{0.0};  // in cells
  vtkSmartPointer<vtkDataArray> owner;
};

/// The library's type for a VTK type; nullopt unless that is a number of 8 to 64 bits.
std::optional<vdi::ComponentType> componentTypeOf(int vtkType, int bytes) {
  using Type = vdi::ComponentType;
  switch (vtkType) {
    case VTK_FLOAT:
      return Type::F32;
    case VTK_DOUBLE:
      return Type::F64;
    case VTK_CHAR:
      return std::is_signed_v<char> ? Type::I8 : Type::U8;
    case VTK_SIGNED_CHAR:
      return Type::I8;
    case VTK_UNSIGNED_CHAR:
      return Type::U8;
    case VTK_SHORT:
      return Type::I16;
    case VTK_UNSIGNED_SHORT:
      return Type::U16;
    case VTK_INT:
    case VTK_LONG:
    case VTK_LONG_LONG:
    case VTK_ID_TYPE:
      return bytes == 8 ? Type::I64 : Type::I32;
    case VTK_UNSIGNED_INT:
    case VTK_UNSIGNED_LONG:
    case VTK_UNSIGNED_LONG_LONG:
      return bytes == 8 ? Type::U64 : Type::U32;
    default:
      return std::nullopt;
  }
}

/// The values of a lattice of `counts`. Copies an array whose type or memory layout the library can't read.
Memory memoryOf(vtkDataArray* array, const glm::ivec3& counts) {
  if (const auto* source = dynamic_cast<const StridedSource*>(array);
      source != nullptr && source->counts() == counts)
    return {source->memory(), source->offset(), array};
  vtkSmartPointer<vtkDataArray> owner = array;
  std::optional<vdi::ComponentType> type = componentTypeOf(array->GetDataType(), array->GetDataTypeSize());
  if (!type || !array->HasStandardMemoryLayout()) {
    owner = vtkSmartPointer<vtkDataArray>::Take(
        vtkDataArray::CreateDataArray(type ? array->GetDataType() : VTK_DOUBLE));
    owner->DeepCopy(array);
    if (!type) type = vdi::ComponentType::F64;
  }
  const auto scalar = static_cast<std::int64_t>(vdi::sizeOf(*type));
  const int components = owner->GetNumberOfComponents();
  return {
      {static_cast<const std::byte*>(owner->GetVoidPointer(0)),
       vdi::packedStrides(counts, vdi::sizeOf(*type)) * std::int64_t{components}, *type, components, scalar},
      glm::dvec3(0.0),
      owner};
}

void requireComponent(vtkDataArray* array, int component) {
  const std::string issue = vdi::componentIssue(component, array->GetNumberOfComponents());
  if (!issue.empty())
    throw Error(ErrorCode::InvalidArgument, "the array " + issue, array->GetName() ? array->GetName() : "");
}

/// Throws if the array has fewer values than the lattice.
void requireLength(vtkDataArray* array, const glm::ivec3& values, const std::string& block) {
  const vtkIdType needed = vtkIdType{values.x} * values.y * values.z;
  if (array->GetNumberOfTuples() >= needed) return;
  throw Error(ErrorCode::InvalidArgument,
              fmt::format("the array '{}' has {} values instead of {} x {} x {}",
                          array->GetName() != nullptr ? array->GetName() : "", array->GetNumberOfTuples(),
                          values.x, values.y, values.z),
              block);
}

/// The lattice of an image, along the image's own axes.
struct Lattice {
  glm::ivec3 points;
  glm::ivec3 cells;
};

/// The image's axes among the world's.
struct Axes {
  glm::ivec3 of{0, 1, 2};        // the image's axis along each of the world's
  glm::bvec3 isReversed{false};  // whether indices fall along that axis of the world

  template <typename T>
  glm::vec<3, T> permuted(const glm::vec<3, T>& v) const {
    return {v[of.x], v[of.y], v[of.z]};
  }
  /// Per axis of the world, negative along reversed axes.
  template <typename T>
  glm::vec<3, T> directed(const glm::vec<3, T>& v) const {
    return glm::mix(permuted(v), -permuted(v), isReversed);
  }
  /// A box of an image of `counts` values, or cells, in indices along the world's axes.
  vdi::IndexBox placed(const vdi::IndexBox& box, const glm::ivec3& counts) const {
    const glm::ivec3 size = permuted(counts);
    const glm::ivec3 lo = permuted(box.lo);
    const glm::ivec3 hi = permuted(box.hi);
    return {glm::mix(lo, size - hi, isReversed), glm::mix(hi, size - lo, isReversed)};
  }
};

/// The axes of an image whose direction matrix permutes and mirrors them; nullopt if it rotates by other
/// angles.
std::optional<Axes> axesOf(vtkImageData* image) {
  constexpr double rounding = 1e-6;  // as files in single precision have it
  Axes axes;
  for (int row = 0; row < 3; ++row) {
    int along = 0;
    for (int column = 0; column < 3; ++column) {
      const double share = image->GetDirectionMatrix()->GetElement(row, column);
      if (std::abs(share) <= rounding) continue;
      if (std::abs(std::abs(share) - 1.0) > rounding) return std::nullopt;
      ++along;
      axes.of[row] = column;
      axes.isReversed[row] = share * image->GetSpacing()[column] < 0.0;
    }
    if (along != 1) return std::nullopt;
  }
  const bool isPermutation = axes.of.x != axes.of.y && axes.of.y != axes.of.z && axes.of.x != axes.of.z;
  return isPermutation ? std::optional(axes) : std::nullopt;
}

/// The values by indices along the world's axes.
void turn(Memory& memory, const Axes& axes, const glm::ivec3& counts) {
  vdi::ComponentArray& values = memory.values;
  for (int axis = 0; axis < 3; ++axis) {
    const int own = axes.of[axis];
    if (axes.isReversed[axis]) values.first += (counts[own] - 1) * values.strides[own];
  }
  values.strides = axes.directed(values.strides);
  memory.offset = axes.directed(memory.offset);
}

/// The image's flags; null if there are none. Throws if the image has more points or cells than flags.
const unsigned char* flagsOf(vtkUnsignedCharArray* ghosts, const glm::ivec3& values,
                             const std::string& block) {
  if (ghosts == nullptr) return nullptr;
  requireLength(ghosts, values, block);
  return ghosts->GetPointer(0);
}

/// The cells and values that an image's vtkGhostType excludes.
struct Blanking {
  std::vector<vdi::IndexBox> own;     // drawn cells, as disjoint boxes
  std::vector<vdi::IndexBox> masked;  // meaningless values
};

constexpr unsigned char cellsNotDrawn = vtkDataSetAttributes::DUPLICATECELL |
                                        vtkDataSetAttributes::REFINEDCELL | vtkDataSetAttributes::HIDDENCELL;
constexpr unsigned char cellsWithoutMeaning =
    vtkDataSetAttributes::REFINEDCELL | vtkDataSetAttributes::HIDDENCELL;

/// By VTK's rules, a cell isn't drawn if it is a duplicate, refined or hidden, or if one of its points is
/// hidden. A point's value is meaningless if the point is hidden, or if all cells around it are refined or
/// hidden.
Blanking blankingOf(vtkImageData* image, const Lattice& lattice, bool ofCells, const std::string& block) {
  const vdi::IndexBox cells{glm::ivec3(0), lattice.cells};
  const vdi::IndexBox points{glm::ivec3(0), lattice.points};
  const unsigned char* cellFlags = flagsOf(image->GetCellGhostArray(), lattice.cells, block);
  const unsigned char* pointFlags = flagsOf(image->GetPointGhostArray(), lattice.points, block);
  const auto any = [](const unsigned char* flags, std::size_t count, unsigned char wanted) {
    return flags != nullptr &&
           std::any_of(flags, flags + count, [wanted](unsigned char flag) { return (flag & wanted) != 0; });
  };
  const bool hiddenPoints = any(pointFlags, points.count(), vtkDataSetAttributes::HIDDENPOINT);
  if (!hiddenPoints && !any(cellFlags, cells.count(), cellsNotDrawn)) return {{cells}, {}};
  std::vector<bool> drawn(cells.count(), true);
  std::vector<bool> meaning(cells.count(), true);
  for (std::size_t i = 0; cellFlags != nullptr && i < drawn.size(); ++i) {
    drawn[i] = (cellFlags[i] & cellsNotDrawn) == 0;
    meaning[i] = (cellFlags[i] & cellsWithoutMeaning) == 0;
  }
  const auto forEach = [](const vdi::IndexBox& box, auto visit) {
    for (int z = box.lo.z; z < box.hi.z; ++z) {
      for (int y = box.lo.y; y < box.hi.y; ++y) {
        for (int x = box.lo.x; x < box.hi.x; ++x) visit(glm::ivec3(x, y, z));
      }
    }
  };
  const auto cellsAround = [&](const glm::ivec3& point) {
    return vdi::IndexBox{point - 1, point + 1}.intersection(cells);
  };
  const auto isHidden = [&](const glm::ivec3& point) {
    return hiddenPoints && (pointFlags[points.position(point)] & vtkDataSetAttributes::HIDDENPOINT) != 0;
  };
  forEach(hiddenPoints ? points : vdi::IndexBox(), [&](const glm::ivec3& point) {
    if (!isHidden(point)) return;
    forEach(cellsAround(point), [&](const glm::ivec3& cell) {
      drawn[cells.position(cell)] = false;
      meaning[cells.position(cell)] = false;
    });
  });
  std::vector<bool> masked(ofCells ? cells.count() : points.count(), false);
  if (ofCells) {
    for (std::size_t i = 0; i < masked.size(); ++i) masked[i] = !meaning[i];
  } else {
    forEach(points, [&](const glm::ivec3& point) {
      bool touched = false;
      forEach(cellsAround(point),
              [&](const glm::ivec3& cell) { touched = touched || meaning[cells.position(cell)]; });
      masked[points.position(point)] = isHidden(point) || !touched;
    });
  }
  return {vdi::coverWithBoxes(cells.hi, std::move(drawn)),
          vdi::coverWithBoxes(ofCells ? cells.hi : points.hi, std::move(masked))};
}

void addImage(vtkImageData* image, const ArrayChoice& choice, const std::string& name,
              std::vector<vdi::Block>& blocks) {
  if (image->GetNumberOfPoints() == 0) return;
  const std::optional<Axes> axes = axesOf(image);
  if (!axes) {
    throw Error(ErrorCode::InvalidArgument,
                "images rotated by other than right angles (a direction matrix) can't be handled; resample "
                "them first, as by Resample To Image",
                name);
  }
  auto* attributes =
      choice.cells ? static_cast<vtkDataSetAttributes*>(image->GetCellData()) : image->GetPointData();
  vtkDataArray* array =
      choice.name.empty() ? attributes->GetScalars() : attributes->GetArray(choice.name.c_str());
  if (array == nullptr) return;  // the block lacks it
  int extent[6];
  image->GetExtent(extent);
  const glm::ivec3 low{extent[0], extent[2], extent[4]};
  const glm::ivec3 high{extent[1], extent[3], extent[5]};
  const Lattice lattice{high - low + 1, glm::max(high - low, glm::ivec3(1))};
  const auto& [points, cells] = lattice;
  const glm::dvec3 spacing = glm::abs(
      axes->permuted(glm::dvec3(image->GetSpacing()[0], image->GetSpacing()[1], image->GetSpacing()[2])));
  const glm::dvec3 first(axes->placed({low, high}, glm::ivec3(0)).lo);  // the lowest point, from the origin
  const glm::dvec3 origin =
      glm::dvec3(image->GetOrigin()[0], image->GetOrigin()[1], image->GetOrigin()[2]) + first * spacing;
  // An image that is one point thick has a layer of cells around these points.
  const glm::dvec3 thin(glm::equal(axes->permuted(points), glm::ivec3(1)));
  const glm::dvec3 corner = origin - 0.5 * thin * spacing;
  requireLength(array, choice.cells ? cells : points, name);
  requireComponent(array, choice.component);
  const glm::ivec3 counts = choice.cells ? cells : points;
  Memory memory = memoryOf(array, counts);
  memory.values.missing.insert(memory.values.missing.end(), choice.missing.begin(), choice.missing.end());
  Blanking blanking = blankingOf(image, lattice, choice.cells, name);
  turn(memory, *axes, counts);
  const void* const data = memory.values.first;
  const glm::ivec3 dims = axes->permuted(counts);
  vdi::Block block = choice.cells ? vdi::Block::fromCells(dims, corner, spacing, vdi::ScalarType::U8, data)
                                  : vdi::Block::fromPoints(dims, origin, spacing, vdi::ScalarType::U8, data);
  block.moveValues(memory.offset);
  block.nearest = choice.nearest;
  const bool isOne = memory.values.components == 1;
  vdi::showComponent(block, memory.values, isOne ? vdi::magnitude : choice.component);
  // The deleter's copy of the smart pointer keeps the array alive.
  block.keepAlive = std::shared_ptr<const void>(
      block.data, [array = memory.owner](const void*) mutable { array = nullptr; });
  for (vdi::IndexBox& box : blanking.masked) box = axes->placed(box, counts);
  if (!blanking.masked.empty())
    block.masked = std::make_shared<std::vector<vdi::IndexBox>>(std::move(blanking.masked));
  for (const vdi::IndexBox& drawn : blanking.own) {
    const vdi::IndexBox box = axes->placed(drawn, cells);
    // Points in one plane have no cell across it. If all images' do, the library makes a sheet of them.
    for (int axis = 0; axis < 3; ++axis) {
      if (thin[axis] != 0.0) continue;
      block.owned.lo[axis] = origin[axis] + box.lo[axis] * spacing[axis];
      block.owned.hi[axis] = origin[axis] + box.hi[axis] * spacing[axis];
    }
    blocks.push_back(block);
  }
}

void addLeaf(vtkDataObject* leaf, const ArrayChoice& choice, const std::string& name,
             std::vector<vdi::Block>& blocks) {
  if (leaf == nullptr) return;
  auto* image = vtkImageData::SafeDownCast(leaf);
  if (image == nullptr) {
    throw Error(
        ErrorCode::InvalidArgument,
        fmt::format(
            "{} can't be turned into a VDI; use vtkImageData, alone or in multiblock, partitioned or AMR "
            "data sets (Resample To Image converts other data)",
            leaf->GetClassName()));
  }
  addImage(image, choice, name, blocks);
}

/// Uses the arrays' modification times: a filter that passes a data set on changes only the data set's own.
/// No two arrays ever have one time, while a new array may lie where a freed one lay.
void addIdentity(vtkDataObject* leaf, std::vector<std::uint64_t>& identity) {
  auto* image = vtkImageData::SafeDownCast(leaf);
  if (image == nullptr) {
    if (leaf != nullptr) identity.push_back(leaf->GetMTime());
    return;
  }
  const auto addPlace = [&identity](const double* values, int count) {
    for (int i = 0; i < count; ++i) identity.push_back(vdi::bit_cast<std::uint64_t>(values[i]));
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
      identity.push_back(array->GetMTime());
      identity.push_back(array == attributes->GetScalars() ? 1 : 0);
    }
  }
}

}  // namespace

std::vector<vdi::Block> blocksOf(vtkDataObject* data, const ArrayChoice& choice) {
  std::vector<vdi::Block> blocks;
  auto* composite = vtkCompositeDataSet::SafeDownCast(data);
  if (composite == nullptr) {
    addLeaf(data, choice, "the image", blocks);
    return blocks;
  }
  const auto iterator = vtkSmartPointer<vtkCompositeDataIterator>::Take(composite->NewIterator());
  for (iterator->InitTraversal(); !iterator->IsDoneWithTraversal(); iterator->GoToNextItem()) {
    addLeaf(iterator->GetCurrentDataObject(), choice,
            fmt::format("block {} of {}", iterator->GetCurrentFlatIndex(), data->GetClassName()), blocks);
  }
  return blocks;
}

int componentsOf(vtkDataObject* data, const ArrayChoice& choice) {
  const auto componentsIn = [&choice](vtkDataObject* leaf) {
    auto* image = vtkImageData::SafeDownCast(leaf);
    if (image == nullptr) return 0;
    vtkDataSetAttributes* attributes =
        choice.cells ? static_cast<vtkDataSetAttributes*>(image->GetCellData()) : image->GetPointData();
    vtkDataArray* array =
        choice.name.empty() ? attributes->GetScalars() : attributes->GetArray(choice.name.c_str());
    return array != nullptr ? array->GetNumberOfComponents() : 0;
  };
  auto* composite = vtkCompositeDataSet::SafeDownCast(data);
  if (composite == nullptr) return componentsIn(data);
  int most = 0;
  const auto iterator = vtkSmartPointer<vtkCompositeDataIterator>::Take(composite->NewIterator());
  for (iterator->InitTraversal(); !iterator->IsDoneWithTraversal(); iterator->GoToNextItem())
    most = std::max(most, componentsIn(iterator->GetCurrentDataObject()));
  return most;
}

std::vector<std::uint64_t> identityOf(vtkDataObject* data) {
  std::vector<std::uint64_t> identity;
  auto* composite = vtkCompositeDataSet::SafeDownCast(data);
  if (composite == nullptr) {
    addIdentity(data, identity);
    return identity;
  }
  const auto iterator = vtkSmartPointer<vtkCompositeDataIterator>::Take(composite->NewIterator());
  for (iterator->InitTraversal(); !iterator->IsDoneWithTraversal(); iterator->GoToNextItem()) {
    identity.push_back(iterator->GetCurrentFlatIndex());
    addIdentity(iterator->GetCurrentDataObject(), identity);
  }
  return identity;
}

}  // namespace pv
