#include "catalyst_adaptor/scripts/VtkGrid.h"

#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkDataSetAttributes.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkTypeTraits.h>
#include <vtkUnsignedCharArray.h>

#include <array>
#include <cstddef>
#include <memory>

#include "catalyst_adaptor/Calls.h"
#include "catalyst_adaptor/StridedArray.h"
#include "catalyst_adaptor/scripts/StridedDataArray.h"

namespace vdi::catalyst {

namespace {

void markGhosts(vtkImageData* image, const vdi_catalyst_block& block) {
  // VTK's own allocation is unsuitable: when it fails, Debian's VTK ends the process.
  std::unique_ptr<unsigned char[]> marks = newMarks(block);
  if (!marks) return;
  vtkIdType index = 0;
  const auto outside = [&](int axis, int i) {
    return i < block.ghost_lo[axis] || i >= block.cells[axis] - block.ghost_hi[axis];
  };
  for (int z = 0; z < block.cells[2]; ++z) {
    for (int y = 0; y < block.cells[1]; ++y) {
      for (int x = 0; x < block.cells[0]; ++x) {
        const bool ghost = outside(0, x) || outside(1, y) || outside(2, z);
        marks[static_cast<std::size_t>(index++)] = ghost ? vtkDataSetAttributes::DUPLICATECELL : 0;
      }
    }
  }
  vtkNew<vtkUnsignedCharArray> ghosts;
  ghosts->SetName(vtkDataSetAttributes::GhostArrayName());
  ghosts->SetArray(marks.release(), image->GetNumberOfCells(), 0,
                   vtkUnsignedCharArray::VTK_DATA_ARRAY_DELETE);
  image->GetCellData()->AddArray(ghosts);
}

/// Calls `visit` with a value of VTK's type for this scalar type.
template <typename Visit>
auto withNumber(int type, Visit visit) {
  switch (type) {
    case VDI_CATALYST_U8:
      return visit(static_cast<unsigned char>(0));
    case VDI_CATALYST_I8:
      return visit(static_cast<signed char>(0));
    case VDI_CATALYST_U16:
      return visit(static_cast<unsigned short>(0));
    case VDI_CATALYST_I16:
      return visit(static_cast<short>(0));
    case VDI_CATALYST_U32:
      return visit(0U);
    case VDI_CATALYST_I32:
      return visit(0);
    case VDI_CATALYST_F32:
      return visit(0.0F);
    case VDI_CATALYST_I64:
      return visit(vtkTypeInt64{0});
    case VDI_CATALYST_U64:
      return visit(vtkTypeUInt64{0});
    default:
      return visit(0.0);
  }
}

/// Makes an array on the simulation's memory.
vtkSmartPointer<vtkDataArray> newArray(const Fields::NamedArray& named, const StridedValues& values) {
  vtkSmartPointer<vtkDataArray> array;
  withNumber(named.type, [&]<typename Number>(Number /*zero*/) {
    if (values.inOrder() && named.offset == glm::dvec3(0.0) && named.missing.empty()) {
      array.TakeReference(vtkDataArray::CreateDataArray(vtkTypeTraits<Number>::VTK_TYPE_ID));
      array->SetNumberOfComponents(values.components);
      // VTK only reads through this pointer. `save` = 1 leaves the memory to its owner.
      array->SetVoidArray(const_cast<std::byte*>(values.first), static_cast<vtkIdType>(values.scalars()), 1);
    } else {
      const auto strided = vtkSmartPointer<StridedDataArray<Number>>::New();
      strided->set(values, named.offset, named.missing);
      array = strided;
    }
  });
  array->SetName(named.name.c_str());
  return array;
}

std::array<vtkDataSetAttributes*, 2> attributesOf(vtkDataSet& image) {
  return {image.GetPointData(), image.GetCellData()};
}

/// Removes all arrays but the marks of ghost cells.
void removeArrays(vtkDataSetAttributes& attributes) {
  for (int a = attributes.GetNumberOfArrays() - 1; a >= 0; --a) {
    if (attributes.GetAbstractArray(a) != attributes.GetAbstractArray(vtkDataSetAttributes::GhostArrayName()))
      attributes.RemoveArray(a);
  }
}

}  // namespace

VtkGrid::VtkGrid(std::span<const vdi_catalyst_block> blocks)
    : data_(vtkSmartPointer<vtkPartitionedDataSet>::New()) {
  data_->SetNumberOfPartitions(static_cast<unsigned int>(blocks.size()));
  for (unsigned int i = 0; i < blocks.size(); ++i) {
    const vdi_catalyst_block& block = blocks[i];
    vtkNew<vtkImageData> image;
    image->SetDimensions(block.cells[0] + 1, block.cells[1] + 1, block.cells[2] + 1);
    image->SetOrigin(block.origin);
    image->SetSpacing(block.spacing);
    markGhosts(image, block);
    data_->SetPartition(i, image);
  }
}

void VtkGrid::update(const Fields& fields) {
  const bool areNew = shown_ != fields.changes();
  shown_.reset();
  const std::vector<Fields::NamedArray> arrays = areNew ? fields.arrays() : std::vector<Fields::NamedArray>();
  for (unsigned int i = 0; i < data_->GetNumberOfPartitions(); ++i) {
    vtkDataSet& image = *data_->GetPartition(i);
    const auto both = attributesOf(image);
    for (vtkDataSetAttributes* attributes : both) {
      if (areNew) removeArrays(*attributes);
    }
    for (const Fields::NamedArray& array : arrays) {
      if (array.blocks[i].first != nullptr)
        both[array.cells ? 1 : 0]->AddArray(newArray(array, array.blocks[i]));
    }
    for (vtkDataSetAttributes* attributes : both) {
      for (int a = 0; a < attributes->GetNumberOfArrays(); ++a) attributes->GetAbstractArray(a)->Modified();
    }
    image.Modified();
  }
  data_->Modified();
  shown_ = fields.changes();
}

}  // namespace vdi::catalyst
