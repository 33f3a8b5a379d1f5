// The C interface: checks arguments, keeps the ranks together, turns blocks into a vtkPartitionedDataSet.
#include "catalyst_adaptor/vdi_catalyst.h"

#include <mpi.h>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkDataSet.h>
#include <vtkDataSetAttributes.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPartitionedDataSet.h>
#include <vtkPointData.h>
#include <vtkSmartPointer.h>
#include <vtkUnsignedCharArray.h>

#include <cfenv>
#include <cmath>
#include <cstdio>
#include <exception>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include "catalyst_adaptor/Engine.h"
#include "catalyst_adaptor/ScriptEnvironment.h"

struct vdi_catalyst {
  MPI_Comm comm = MPI_COMM_NULL;  // a duplicate
  std::unique_ptr<vdi::catalyst::Engine> engine;
  bool haveBlocks = false;
  vtkSmartPointer<vtkPartitionedDataSet> grid;  // a partition a block
  std::string error;
  std::string printed;  // so that what fails at every step is told once
};

namespace {

/// What a failing call comes to: the highest code of any rank, and the text of the lowest rank that has it
/// and something to say, on all ranks; printed by rank 0 unless it's what was printed last.
int conclude(vdi_catalyst& self, int code, const std::string& text) {
  int worst = code;
  MPI_Allreduce(MPI_IN_PLACE, &worst, 1, MPI_INT, MPI_MAX, self.comm);
  if (worst == VDI_CATALYST_OK) return worst;
  int rank = 0;
  int size = 0;
  MPI_Comm_rank(self.comm, &rank);
  MPI_Comm_size(self.comm, &size);
  // Ranks with the code and a text come first, then those with the code only, then the others.
  int speaker = rank + size * (code != worst ? 2 : text.empty() ? 1 : 0);
  MPI_Allreduce(MPI_IN_PLACE, &speaker, 1, MPI_INT, MPI_MIN, self.comm);
  speaker %= size;
  std::string message = rank == speaker ? text : "";
  int length = static_cast<int>(message.size());
  MPI_Bcast(&length, 1, MPI_INT, speaker, self.comm);
  message.resize(static_cast<std::size_t>(length));
  MPI_Bcast(message.data(), length, MPI_CHAR, speaker, self.comm);
  if (message.empty()) message = "a script failed without saying why";
  self.error = "rank " + std::to_string(speaker) + ": " + message;
  if (self.error == self.printed) return worst;
  self.printed = self.error;
  if (rank == 0) std::fprintf(stderr, "vdi_catalyst: %s\n", self.error.c_str());
  return worst;
}

/// Simulations may trap floating-point exceptions, which are ordinary in Python, VTK and drivers: none while
/// it lives.
class NoFloatingPointTraps {
 public:
  NoFloatingPointTraps() { std::feholdexcept(&before_); }
  ~NoFloatingPointTraps() { std::fesetenv(&before_); }
  NoFloatingPointTraps(const NoFloatingPointTraps&) = delete;
  NoFloatingPointTraps& operator=(const NoFloatingPointTraps&) = delete;

 private:
  std::fenv_t before_{};
};

/// Runs `work`, which returns nothing or what went wrong; that or an exception becomes `code`.
template <typename Work>
int guarded(vdi_catalyst& self, int code, Work work) {
  const NoFloatingPointTraps noTraps;
  std::optional<std::string> failure;
  try {
    if constexpr (std::is_void_v<std::invoke_result_t<Work>>) {
      work();
    } else {
      failure = work();
    }
  } catch (const std::exception& error) {
    failure = error.what();
  } catch (...) {
    failure = "an unknown exception";
  }
  return conclude(self, failure ? code : VDI_CATALYST_OK, failure.value_or(""));
}

void demand(bool good, const char* what) {
  if (!good) throw std::invalid_argument(what);
}

/// MPI_COMM_NULL if MPI isn't running or the handle is none.
MPI_Comm communicatorOf(int32_t fortranHandle) {
  int running = 0;
  int over = 0;
  MPI_Initialized(&running);
  MPI_Finalized(&over);
  if (running == 0 || over != 0) return MPI_COMM_NULL;
  const MPI_Comm comm = MPI_Comm_f2c(fortranHandle);
  return comm != nullptr ? comm : MPI_COMM_NULL;  // OpenMPI's answer to a wrong handle
}

void demandEqualCounts(MPI_Comm comm, int32_t count) {
  int32_t extremes[2] = {count, -count};
  MPI_Allreduce(MPI_IN_PLACE, extremes, 2, MPI_INT32_T, MPI_MAX, comm);
  demand(extremes[0] == -extremes[1], "the ranks give different numbers of scripts");
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

/// The values behind the pointers have changed, whether or not the pointers have.
void markModified(vtkPartitionedDataSet& grid) {
  for (unsigned int i = 0; i < grid.GetNumberOfPartitions(); ++i) {
    vtkDataSet* image = grid.GetPartition(i);
    for (vtkDataSetAttributes* attributes : {static_cast<vtkDataSetAttributes*>(image->GetPointData()),
                                             static_cast<vtkDataSetAttributes*>(image->GetCellData())}) {
      for (int a = 0; a < attributes->GetNumberOfArrays(); ++a) attributes->GetAbstractArray(a)->Modified();
    }
    image->Modified();
  }
  grid.Modified();
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
  const MPI_Comm comm = communicatorOf(fortran_communicator);
  if (comm == MPI_COMM_NULL) {
    std::fprintf(stderr, "vdi_catalyst: there is no MPI, or no communicator has this Fortran handle\n");
    return VDI_CATALYST_BAD_ARGUMENT;
  }
  auto self = std::make_unique<vdi_catalyst>();
  if (MPI_Comm_dup(comm, &self->comm) != MPI_SUCCESS) return VDI_CATALYST_BAD_ARGUMENT;
  std::vector<std::string> paths;
  int code = guarded(*self, VDI_CATALYST_BAD_ARGUMENT, [&] {
    demand(script_count >= 0 && (script_count == 0 || scripts != nullptr), "no scripts given");
    for (int i = 0; i < script_count; ++i) {
      demand(scripts[i] != nullptr, "a script's path is null");
      paths.emplace_back(scripts[i]);
    }
  });
  if (code == VDI_CATALYST_OK) {
    code = guarded(*self, VDI_CATALYST_BAD_ARGUMENT, [&] { demandEqualCounts(self->comm, script_count); });
  }
  if (code == VDI_CATALYST_OK) {
    code = guarded(*self, VDI_CATALYST_ENGINE, [] {
      vdi::catalyst::providePlugin();
      vdi::catalyst::sharePython();
    });
  }
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
    const auto grid = vtkSmartPointer<vtkPartitionedDataSet>::New();
    grid->SetNumberOfPartitions(static_cast<unsigned int>(count));
    for (int i = 0; i < count; ++i) {
      const vdi_catalyst_block& block = blocks[i];
      vtkNew<vtkImageData> image;
      image->SetDimensions(block.cells[0] + 1, block.cells[1] + 1, block.cells[2] + 1);
      image->SetOrigin(block.origin);
      image->SetSpacing(block.spacing);
      markGhosts(image, block);
      grid->SetPartition(static_cast<unsigned int>(i), image);
    }
    catalyst->grid = grid;
    catalyst->haveBlocks = true;
  });
}

int vdi_catalyst_set_array(vdi_catalyst* catalyst, const char* name, int32_t type, int32_t association,
                           const void* const* data) {
  if (catalyst == nullptr) return VDI_CATALYST_BAD_ARGUMENT;
  return guarded(*catalyst, VDI_CATALYST_BAD_ARGUMENT, [&] {
    demand(catalyst->haveBlocks, "arrays were given before blocks");
    demand(name != nullptr && *name != '\0', "an array needs a name");
    demand(association == VDI_CATALYST_POINTS || association == VDI_CATALYST_CELLS, "unknown association");
    const int vtkType = vtkTypeOf(type);
    const unsigned int count = catalyst->grid->GetNumberOfPartitions();
    demand(count == 0 || data != nullptr, "an array without data");
    for (unsigned int i = 0; i < count; ++i)
      demand(data[i] != nullptr, "an array without data for one of the blocks");
    const bool cells = association == VDI_CATALYST_CELLS;
    for (unsigned int i = 0; i < count; ++i) {
      vtkDataSet* image = catalyst->grid->GetPartition(i);
      const auto array = vtkSmartPointer<vtkDataArray>::Take(vtkDataArray::CreateDataArray(vtkType));
      array->SetName(name);
      // VTK only reads through this pointer; `save` = 1 leaves the memory the simulation's.
      array->SetVoidArray(const_cast<void*>(data[i]),
                          cells ? image->GetNumberOfCells() : image->GetNumberOfPoints(), 1);
      auto* attributes =
          cells ? static_cast<vtkDataSetAttributes*>(image->GetCellData()) : image->GetPointData();
      attributes->AddArray(array);
    }
  });
}

int vdi_catalyst_execute(vdi_catalyst* catalyst, int64_t step, double time) {
  if (catalyst == nullptr) return VDI_CATALYST_BAD_ARGUMENT;
  const int code = guarded(*catalyst, VDI_CATALYST_BAD_ARGUMENT,
                           [&] { demand(catalyst->haveBlocks, "no blocks were given yet"); });
  if (code != VDI_CATALYST_OK) return code;
  const int result = guarded(*catalyst, VDI_CATALYST_SCRIPT, [&] {
    markModified(*catalyst->grid);
    return catalyst->engine->execute(catalyst->grid, step, time);
  });
  if (result == VDI_CATALYST_OK) catalyst->printed.clear();
  return result;
}

int vdi_catalyst_finalize(vdi_catalyst* catalyst) {
  if (catalyst == nullptr) return VDI_CATALYST_BAD_ARGUMENT;
  const std::unique_ptr<vdi_catalyst> self(catalyst);
  int code = guarded(*self, VDI_CATALYST_SCRIPT, [&] { return self->engine->finish(); });
  self->grid = nullptr;
  const int ended = guarded(*self, VDI_CATALYST_ENGINE, [&] { self->engine.reset(); });
  if (code == VDI_CATALYST_OK) code = ended;
  MPI_Comm_free(&self->comm);
  return code;
}

const char* vdi_catalyst_error(const vdi_catalyst* catalyst) {
  return catalyst != nullptr ? catalyst->error.c_str() : "";
}
