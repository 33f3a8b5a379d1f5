// The C interface: checks arguments, keeps the ranks together, turns blocks into a vtkPartitionedDataSet.
#include "catalyst_adaptor/vdi_catalyst.h"

#include <mpi.h>
#include <vtkAOSDataArrayTemplate.h>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPartitionedDataSet.h>
#include <vtkPointData.h>
#include <vtkSmartPointer.h>
#include <vtkUnsignedCharArray.h>

#include <cmath>
#include <cstdio>
#include <exception>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "catalyst_adaptor/Engine.h"

struct vdi_catalyst {
  MPI_Comm comm = MPI_COMM_NULL;  // a duplicate
  std::unique_ptr<vdi::catalyst::Engine> engine;
  std::vector<vdi_catalyst_block> blocks;
  bool haveBlocks = false;
  vtkSmartPointer<vtkPartitionedDataSet> grid;
  std::string error;
};

namespace {

/// What a failing call comes to: the highest code of any rank, and the text of the lowest rank that has it,
/// on all ranks; printed by rank 0.
int conclude(vdi_catalyst& self, int code, const std::string& text) {
  int worst = code;
  MPI_Allreduce(MPI_IN_PLACE, &worst, 1, MPI_INT, MPI_MAX, self.comm);
  if (worst == VDI_CATALYST_OK) return worst;
  int rank = 0;
  int size = 0;
  MPI_Comm_rank(self.comm, &rank);
  MPI_Comm_size(self.comm, &size);
  int speaker = code == worst ? rank : size;
  MPI_Allreduce(MPI_IN_PLACE, &speaker, 1, MPI_INT, MPI_MIN, self.comm);
  std::string message = rank == speaker ? text : "";
  int length = static_cast<int>(message.size());
  MPI_Bcast(&length, 1, MPI_INT, speaker, self.comm);
  message.resize(static_cast<std::size_t>(length));
  MPI_Bcast(message.data(), length, MPI_CHAR, speaker, self.comm);
  self.error = "rank " + std::to_string(speaker) + ": " + message;
  if (rank == 0) std::fprintf(stderr, "vdi_catalyst: %s\n", self.error.c_str());
  return worst;
}

/// Runs `work`; an exception becomes `code`.
template <typename Work>
int guarded(vdi_catalyst& self, int code, Work work) {
  int result = VDI_CATALYST_OK;
  std::string text;
  try {
    work();
  } catch (const std::exception& error) {
    result = code;
    text = error.what();
  } catch (...) {
    result = code;
    text = "an unknown exception";
  }
  return conclude(self, result, text);
}

void demand(bool good, const char* what) {
  if (!good) throw std::invalid_argument(what);
}

void checkBlock(const vdi_catalyst_block& block) {
  for (int axis = 0; axis < 3; ++axis) {
    demand(block.cells[axis] >= 1, "a block needs at least one cell per axis");
    demand(block.ghost_lo[axis] >= 0 && block.ghost_hi[axis] >= 0, "ghost layers can't be negative");
    demand(block.ghost_lo[axis] + block.ghost_hi[axis] < block.cells[axis],
           "a block of nothing but ghost cells");
    demand(std::isfinite(block.spacing[axis]) && block.spacing[axis] > 0.0, "spacing must be finite and > 0");
    demand(std::isfinite(block.origin[axis]), "the origin must be finite");
  }
}

void markGhosts(vtkImageData* image, const vdi_catalyst_block& block) {
  bool any = false;
  for (int axis = 0; axis < 3; ++axis) any = any || block.ghost_lo[axis] > 0 || block.ghost_hi[axis] > 0;
  if (!any) return;
  vtkNew<vtkUnsignedCharArray> ghosts;
  ghosts->SetName(vtkDataSetAttributes::GhostArrayName());
  ghosts->SetNumberOfTuples(image->GetNumberOfCells());
  vtkIdType index = 0;
  const auto outside = [&](int axis, int i) {
    return i < block.ghost_lo[axis] || i >= block.cells[axis] - block.ghost_hi[axis];
  };
  for (int z = 0; z < block.cells[2]; ++z) {
    for (int y = 0; y < block.cells[1]; ++y) {
      for (int x = 0; x < block.cells[0]; ++x) {
        const bool ghost = outside(0, x) || outside(1, y) || outside(2, z);
        ghosts->SetValue(index++, ghost ? vtkDataSetAttributes::DUPLICATECELL : 0);
      }
    }
  }
  image->GetCellData()->AddArray(ghosts);
}

int vtkTypeOf(int type) {
  switch (type) {
    case VDI_CATALYST_U8:
      return VTK_UNSIGNED_CHAR;
    case VDI_CATALYST_I8:
      return VTK_SIGNED_CHAR;
    case VDI_CATALYST_U16:
      return VTK_UNSIGNED_SHORT;
    case VDI_CATALYST_I16:
      return VTK_SHORT;
    case VDI_CATALYST_U32:
      return VTK_UNSIGNED_INT;
    case VDI_CATALYST_I32:
      return VTK_INT;
    case VDI_CATALYST_F32:
      return VTK_FLOAT;
    case VDI_CATALYST_F64:
      return VTK_DOUBLE;
    default:
      throw std::invalid_argument("unknown scalar type");
  }
}

}  // namespace

int vdi_catalyst_initialize(int32_t fortran_communicator, int32_t script_count, const char* const* scripts,
                            vdi_catalyst** catalyst) {
  if (catalyst == nullptr) return VDI_CATALYST_BAD_ARGUMENT;
  *catalyst = nullptr;
  auto self = std::make_unique<vdi_catalyst>();
  if (MPI_Comm_dup(MPI_Comm_f2c(fortran_communicator), &self->comm) != MPI_SUCCESS)
    return VDI_CATALYST_BAD_ARGUMENT;
  std::vector<std::string> paths;
  int code = guarded(*self, VDI_CATALYST_BAD_ARGUMENT, [&] {
    demand(script_count >= 0 && (script_count == 0 || scripts != nullptr), "no scripts given");
    for (int i = 0; i < script_count; ++i) {
      demand(scripts[i] != nullptr, "a script's path is null");
      paths.emplace_back(scripts[i]);
    }
  });
  if (code == VDI_CATALYST_OK) {
    code = guarded(*self, VDI_CATALYST_ENGINE, [&] {
      self->engine = std::make_unique<vdi::catalyst::Engine>(MPI_Comm_c2f(self->comm), paths);
      self->grid = vtkSmartPointer<vtkPartitionedDataSet>::New();
    });
  }
  if (code != VDI_CATALYST_OK) {
    self->engine.reset();
    MPI_Comm_free(&self->comm);
    return code;
  }
  *catalyst = self.release();
  return VDI_CATALYST_OK;
}

int vdi_catalyst_set_blocks(vdi_catalyst* catalyst, int32_t count, const vdi_catalyst_block* blocks) {
  if (catalyst == nullptr) return VDI_CATALYST_BAD_ARGUMENT;
  return guarded(*catalyst, VDI_CATALYST_BAD_ARGUMENT, [&] {
    demand(count >= 0 && (count == 0 || blocks != nullptr), "no blocks given");
    for (int i = 0; i < count; ++i) checkBlock(blocks[i]);
    catalyst->blocks.assign(blocks, blocks + count);
    catalyst->haveBlocks = true;
    catalyst->grid = vtkSmartPointer<vtkPartitionedDataSet>::New();
    catalyst->grid->SetNumberOfPartitions(static_cast<unsigned int>(count));
    for (int i = 0; i < count; ++i) {
      const vdi_catalyst_block& block = blocks[i];
      vtkNew<vtkImageData> image;
      image->SetDimensions(block.cells[0] + 1, block.cells[1] + 1, block.cells[2] + 1);
      image->SetOrigin(block.origin);
      image->SetSpacing(block.spacing);
      markGhosts(image, block);
      catalyst->grid->SetPartition(static_cast<unsigned int>(i), image);
    }
  });
}

int vdi_catalyst_set_array(vdi_catalyst* catalyst, const char* name, int32_t type, int32_t association,
                           const void* const* data) {
  if (catalyst == nullptr) return VDI_CATALYST_BAD_ARGUMENT;
  return guarded(*catalyst, VDI_CATALYST_BAD_ARGUMENT, [&] {
    demand(catalyst->haveBlocks, "arrays were given before blocks");
    demand(name != nullptr && *name != '\0', "an array needs a name");
    demand(association == VDI_CATALYST_POINTS || association == VDI_CATALYST_CELLS, "unknown association");
    demand(catalyst->blocks.empty() || data != nullptr, "an array without data");
    for (std::size_t i = 0; i < catalyst->blocks.size(); ++i) {
      demand(data[i] != nullptr, "an array without data for one of the blocks");
      auto* image = vtkImageData::SafeDownCast(catalyst->grid->GetPartition(static_cast<unsigned int>(i)));
      const bool cells = association == VDI_CATALYST_CELLS;
      const auto array = vtkSmartPointer<vtkDataArray>::Take(vtkDataArray::CreateDataArray(vtkTypeOf(type)));
      array->SetName(name);
      array->SetNumberOfComponents(1);
      // VTK only reads through this pointer; `save` = 1 leaves the memory the simulation's.
      array->SetVoidArray(const_cast<void*>(data[i]),
                          cells ? image->GetNumberOfCells() : image->GetNumberOfPoints(), 1);
      auto* attributes =
          cells ? static_cast<vtkDataSetAttributes*>(image->GetCellData()) : image->GetPointData();
      attributes->AddArray(array);
      image->Modified();
    }
  });
}

int vdi_catalyst_execute(vdi_catalyst* catalyst, int64_t step, double time) {
  if (catalyst == nullptr) return VDI_CATALYST_BAD_ARGUMENT;
  const int code = guarded(*catalyst, VDI_CATALYST_BAD_ARGUMENT,
                           [&] { demand(catalyst->haveBlocks, "no blocks were given yet"); });
  if (code != VDI_CATALYST_OK) return code;
  return guarded(*catalyst, VDI_CATALYST_SCRIPT, [&] {
    // The values behind the pointers have changed, whether or not the pointers have.
    for (unsigned int i = 0; i < catalyst->grid->GetNumberOfPartitions(); ++i)
      catalyst->grid->GetPartition(i)->Modified();
    catalyst->grid->Modified();
    const std::string failure = catalyst->engine->execute(catalyst->grid, step, time);
    if (!failure.empty()) throw std::runtime_error(failure);
  });
}

int vdi_catalyst_finalize(vdi_catalyst* catalyst) {
  if (catalyst == nullptr) return VDI_CATALYST_BAD_ARGUMENT;
  const std::unique_ptr<vdi_catalyst> self(catalyst);
  self->grid = nullptr;
  const int code = guarded(*self, VDI_CATALYST_ENGINE, [&] { self->engine.reset(); });
  MPI_Comm_free(&self->comm);
  return code;
}

const char* vdi_catalyst_error(const vdi_catalyst* catalyst) {
  return catalyst != nullptr ? catalyst->error.c_str() : "";
}
