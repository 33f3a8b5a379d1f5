// The C interface for scripts. It checks arguments, keeps the ranks together, and turns blocks into a
// vtkPartitionedDataSet.
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

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <glm/glm.hpp>
#include <limits>
#include <map>
#include <memory>
#include <new>
#include <optional>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "catalyst_adaptor/Calls.h"
#include "catalyst_adaptor/Deposits.h"
#include "catalyst_adaptor/Engine.h"
#include "catalyst_adaptor/Parameters.h"
#include "catalyst_adaptor/ScriptEnvironment.h"
#include "catalyst_adaptor/Scripts.h"
#include "catalyst_adaptor/StridedArray.h"
#include "catalyst_adaptor/StridedDataArray.h"

struct vdi_catalyst : vdi::catalyst::Calls {
  std::unique_ptr<vdi::catalyst::Engine> engine;
  bool haveBlocks = false;
  vtkSmartPointer<vtkPartitionedDataSet> grid;  // one partition per block
  /// The arrays of `grid` by association and name, one entry for each block. A block that lacks the array has
  /// a null `first`.
  struct Array {
    int type = VDI_CATALYST_F64;
    std::vector<vdi::catalyst::StridedValues> blocks;
  };
  std::map<std::pair<int, std::string>, Array> arrays;
  std::map<std::pair<int, std::string>, glm::dvec3> offsets;  // in cells; none: 0
  std::vector<vdi_catalyst_block> blocks;
  std::uint64_t blocksVersion = 0;  // changes with the blocks; equal on all ranks
  std::map<std::string, vdi::catalyst::ParticleArray> particles;    // of the same names on all ranks
  std::map<std::string, vdi::catalyst::DepositedValues> deposited;  // the memory of arrays made of them
  std::unique_ptr<vdi::catalyst::DeviceDeposits> deposits;
};

namespace {

using vdi::catalyst::checkBlock;
using vdi::catalyst::guarded;
using vdi::catalyst::guardedTogether;
using vdi::catalyst::isStep;
using vdi::catalyst::require;
using vdi::catalyst::requireEqual;

/// The living handle, of which a process has one at a time. Any other handle has been finalized, and must not
/// be read.
vdi_catalyst*& alive() {
  static vdi_catalyst* handle = nullptr;
  return handle;
}

bool usable(const vdi_catalyst* catalyst) {
  return catalyst != nullptr && catalyst == alive();
}

void markGhosts(vtkImageData* image, const vdi_catalyst_block& block) {
  bool any = false;
  for (int axis = 0; axis < 3; ++axis) any = any || block.ghost_lo[axis] > 0 || block.ghost_hi[axis] > 0;
  if (!any) return;
  const vtkIdType count = image->GetNumberOfCells();
  // VTK's own allocation won't do: when it fails, Debian's VTK ends the process.
  std::unique_ptr<unsigned char[]> marks(new (std::nothrow) unsigned char[static_cast<std::size_t>(count)]);
  if (!marks) {
    throw std::runtime_error("no memory for the marks of a block's ghost cells: " + std::to_string(count) +
                             " bytes");
  }
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
  ghosts->SetArray(marks.release(), count, 0, vtkUnsignedCharArray::VTK_DATA_ARRAY_DELETE);
  image->GetCellData()->AddArray(ghosts);
}

/// Tells VTK that the values have changed, whether or not the pointers to them have.
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
    case VDI_CATALYST_I64:
      return VTK_TYPE_INT64;
    case VDI_CATALYST_U64:
      return VTK_TYPE_UINT64;
    default:
      throw std::invalid_argument("unknown scalar type");
  }
}

/// An engine whose vdi_catalyst_initialize failed after its start, for example because of a script. The next
/// call takes it, because ParaView starts once in a process. It is never deleted: that needs MPI, which is
/// gone at the process's end.
vdi::catalyst::Engine*& spareEngine() {
  static vdi::catalyst::Engine* engine = nullptr;
  return engine;
}

/// Takes the spare engine or a new one. All ranks check whether they can before any of them starts.
int takeEngine(vdi_catalyst& self) {
  using vdi::catalyst::Engine;
  std::string plugin;
  const int code = guarded(self, VDI_CATALYST_ENGINE, [&] {
    if (spareEngine() != nullptr ? !spareEngine()->runsOn(self.comm) : Engine::wasStarted()) {
      throw std::runtime_error(spareEngine() != nullptr
                                   ? "ParaView was started before in this process, on another communicator"
                                   : "ParaView's in situ engine starts only once in a process");
    }
    plugin = vdi::catalyst::pluginFile();
    vdi::catalyst::sharePython();
  });
  if (code != VDI_CATALYST_OK) return code;
  return guarded(self, VDI_CATALYST_ENGINE, [&] {
    self.grid = vtkSmartPointer<vtkPartitionedDataSet>::New();
    self.engine.reset(std::exchange(spareEngine(), nullptr));
    if (!self.engine) self.engine = std::make_unique<Engine>(MPI_Comm_c2f(self.comm), plugin);
  });
}

using vdi::catalyst::Script;
using vdi::catalyst::scriptsOf;

void sayIfNothingIsMade(const vdi_catalyst& self, const std::vector<Script>& scripts) {
  int rank = 0;
  MPI_Comm_rank(self.comm, &rank);
  if (rank == 0 && scripts.empty())
    std::fprintf(stderr, "vdi_catalyst: no scripts were given, so no step will make anything\n");
}

constexpr int maxComponents = 16;

void requireArray(const vdi_catalyst& self, const char* name, int association, const void* const* data) {
  require(self.haveBlocks, "arrays were given before blocks");
  require(name != nullptr && *name != '\0', "an array needs a name");
  require(association == VDI_CATALYST_POINTS || association == VDI_CATALYST_CELLS, "unknown association");
  const unsigned int count = self.grid->GetNumberOfPartitions();
  require(count == 0 || data != nullptr, "an array without data");
}

/// Calls `visit` with a number of the type that VTK has for it.
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
vtkSmartPointer<vtkDataArray> newArray(const char* name, int type, const vdi::catalyst::StridedValues& values,
                                       const glm::dvec3& offset) {
  vtkSmartPointer<vtkDataArray> array;
  if (values.inOrder() && offset == glm::dvec3(0.0)) {
    array.TakeReference(vtkDataArray::CreateDataArray(vtkTypeOf(type)));
    array->SetNumberOfComponents(values.components);
    // VTK only reads through this pointer. `save` = 1 leaves the memory to its owner.
    array->SetVoidArray(const_cast<std::byte*>(values.first), static_cast<vtkIdType>(values.scalars()), 1);
  } else {
    withNumber(type, [&](auto number) {
      const auto strided = vtkSmartPointer<vdi::catalyst::StridedDataArray<decltype(number)>>::New();
      strided->set(values, offset);
      array = strided;
    });
  }
  array->SetName(name);
  return array;
}

vdi::catalyst::StridedValues stridedValues(vtkDataSet& block, int type, int association, int components,
                                           const void* data, const vdi_catalyst_strides& strides) {
  vdi::catalyst::StridedValues values;
  values.first = static_cast<const std::byte*>(data);
  const int fewer = association == VDI_CATALYST_CELLS ? 1 : 0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto at = static_cast<std::size_t>(axis);
    values.counts[at] = vtkImageData::SafeDownCast(&block)->GetDimensions()[axis] - fewer;
    values.strides[at] = strides.strides[axis];
  }
  values.components = components;
  values.componentStride = components > 1 ? strides.component_stride : 0;
  values.scalarBytes = static_cast<std::size_t>(vtkDataArray::GetDataTypeSize(vtkTypeOf(type)));
  return values;
}

vdi_catalyst_strides stridesInOrder(vtkDataSet& block, int type, int association) {
  const vdi_catalyst_strides none{};
  const auto values = stridedValues(block, type, association, 1, nullptr, none);
  const auto scalar = static_cast<std::int64_t>(values.scalarBytes);
  return {{scalar, scalar * values.counts[0], scalar * values.counts[0] * values.counts[1]}, scalar};
}

/// VTK's arrays of all blocks; null for a block that lacks the array.
std::vector<vtkSmartPointer<vtkDataArray>> arraysOf(const char* name, const vdi_catalyst::Array& array,
                                                    const glm::dvec3& offset) {
  std::vector<vtkSmartPointer<vtkDataArray>> made;
  for (const vdi::catalyst::StridedValues& values : array.blocks)
    made.push_back(values.first != nullptr ? newArray(name, array.type, values, offset) : nullptr);
  return made;
}

void putIntoGrid(vdi_catalyst& self, const char* name, int association,
                 const std::vector<vtkSmartPointer<vtkDataArray>>& arrays) {
  for (unsigned int i = 0; i < arrays.size(); ++i) {
    vtkDataSet* image = self.grid->GetPartition(i);
    auto* attributes = association == VDI_CATALYST_CELLS
                           ? static_cast<vtkDataSetAttributes*>(image->GetCellData())
                           : image->GetPointData();
    if (arrays[i] != nullptr) {
      attributes->AddArray(arrays[i]);
    } else {
      attributes->RemoveArray(name);
    }
  }
}

glm::dvec3 offsetOf(const vdi_catalyst& self, const char* name, int association) {
  const auto found = self.offsets.find({association, name});
  return found != self.offsets.end() ? found->second : glm::dvec3(0.0);
}

/// `strides` is null for values in order.
int setAnyArray(vdi_catalyst& self, const char* name, int type, int association, int components,
                const void* const* data, const vdi_catalyst_strides* strides) {
  // Memory is allocated before the ranks agree, so that all of them have the array or none.
  std::map<std::pair<int, std::string>, vdi_catalyst::Array> fresh;
  std::vector<vtkSmartPointer<vtkDataArray>> made;
  const int code = guarded(self, VDI_CATALYST_BAD_ARGUMENT, [&] {
    requireArray(self, name, association, data);
    require(components >= 1 && components <= maxComponents, "the number of components must be 1 to 16");
    (void)vtkTypeOf(type);
    vdi_catalyst::Array& array = fresh[{association, name}];
    array.type = type;
    for (unsigned int i = 0; i < self.grid->GetNumberOfPartitions(); ++i) {
      vtkDataSet& image = *self.grid->GetPartition(i);
      const vdi_catalyst_strides given =
          strides != nullptr ? strides[i] : stridesInOrder(image, type, association);
      const auto values = stridedValues(image, type, association, components, data[i], given);
      require(values.first == nullptr || values.reachable(), "strides that lead beyond the address space");
      array.blocks.push_back(values);
    }
    made = arraysOf(name, array, offsetOf(self, name, association));
  });
  if (code != VDI_CATALYST_OK) return code;
  putIntoGrid(self, name, association, made);
  const auto& key = fresh.begin()->first;
  self.arrays.erase(key);
  if (association == VDI_CATALYST_CELLS) {
    self.particles.erase(key.second);
    self.deposited.erase(key.second);
  }
  self.arrays.merge(fresh);
  return code;
}

/// Makes the arrays of all particles. Collective.
void depositAll(vdi_catalyst& self, std::int64_t step) {
  if (!self.deposits)
    self.deposits = std::make_unique<vdi::catalyst::DeviceDeposits>(MPI_Comm_c2f(self.comm));
  for (const auto& [name, particles] : self.particles) {
    vdi::catalyst::DepositedValues values =
        self.deposits->make(name, particles, self.blocksVersion, self.blocks, step);
    for (unsigned int i = 0; i < self.grid->GetNumberOfPartitions(); ++i) {
      vtkDataSet* image = self.grid->GetPartition(i);
      const auto inOrder = stridedValues(*image, VDI_CATALYST_F32, VDI_CATALYST_CELLS, 1, values[i].get(),
                                         stridesInOrder(*image, VDI_CATALYST_F32, VDI_CATALYST_CELLS));
      image->GetCellData()->AddArray(newArray(name.c_str(), VDI_CATALYST_F32, inOrder,
                                              offsetOf(self, name.c_str(), VDI_CATALYST_CELLS)));
    }
    // This comes last, because until now the grid has used the memory that is replaced here.
    self.deposited[name] = std::move(values);
  }
}

/// Makes the arrays of all particles if a script will do anything at the step.
int depositIfWanted(vdi_catalyst& self, std::int64_t step, double time) {
  if (self.particles.empty()) return VDI_CATALYST_OK;
  int wanted = self.engine->wants(static_cast<int>(step), time) ? 1 : 0;
  MPI_Allreduce(MPI_IN_PLACE, &wanted, 1, MPI_INT, MPI_MAX, self.comm);
  if (wanted == 0) return VDI_CATALYST_OK;
  return guardedTogether(
      self, VDI_CATALYST_SCRIPT, [&] { depositAll(self, step); }, step);
}

/// `given`: the files alone, or with arguments.
template <typename Given>
int initialize(int32_t fortran_communicator, int32_t script_count, const Given* given,
               vdi_catalyst** catalyst) {
  const vdi::catalyst::PythonLock lock;
  // Loader.c has checked that MPI runs and that the handle is a communicator's, and *catalyst is null.
  std::unique_ptr<vdi_catalyst> self;
  int code = vdi::catalyst::makeHandle(fortran_communicator, self);
  if (code != VDI_CATALYST_OK) return code;
  std::vector<Script> scripts;
  code = guarded(*self, VDI_CATALYST_BAD_ARGUMENT, [&] { scripts = scriptsOf(script_count, given); });
  if (code == VDI_CATALYST_OK) {
    code = guarded(*self, VDI_CATALYST_BAD_ARGUMENT, [&] {
      requireEqual(self->comm, script_count, "the ranks give different numbers of scripts");
    });
  }
  if (code == VDI_CATALYST_OK) code = takeEngine(*self);
  if (code == VDI_CATALYST_OK) {
    code = guarded(*self, VDI_CATALYST_SCRIPT, [&] {
      for (const Script& script : scripts) self->engine->check(script.file);
    });
  }
  if (code == VDI_CATALYST_OK)
    code = guarded(*self, VDI_CATALYST_ENGINE, [&] { self->engine->loadPlugin(); });
  if (code == VDI_CATALYST_OK)
    code = guarded(*self, VDI_CATALYST_SCRIPT, [&] { self->engine->add(scripts); });
  if (code != VDI_CATALYST_OK) {
    spareEngine() = self->engine.release();
    MPI_Comm_free(&self->comm);
    return code;
  }
  sayIfNothingIsMade(*self, scripts);
  *catalyst = alive() = self.release();
  return VDI_CATALYST_OK;
}

}  // namespace

int vdi_catalyst_initialize(int32_t fortran_communicator, int32_t script_count, const char* const* scripts,
                            vdi_catalyst** catalyst) {
  return initialize(fortran_communicator, script_count, scripts, catalyst);
}

int vdi_catalyst_initialize_pipelines(int32_t fortran_communicator, int32_t script_count,
                                      const vdi_catalyst_pipeline* scripts, vdi_catalyst** catalyst) {
  return initialize(fortran_communicator, script_count, scripts, catalyst);
}

int vdi_catalyst_set_blocks(vdi_catalyst* catalyst, int32_t count, const vdi_catalyst_block* blocks) {
  if (!usable(catalyst)) return VDI_CATALYST_BAD_ARGUMENT;
  const vdi::catalyst::PythonLock lock;
  const auto grid = vtkSmartPointer<vtkPartitionedDataSet>::New();
  std::vector<vdi_catalyst_block> copies;
  const int code = guarded(*catalyst, VDI_CATALYST_BAD_ARGUMENT, [&] {
    require(count >= 0 && (count == 0 || blocks != nullptr), "no blocks given");
    for (int i = 0; i < count; ++i) checkBlock(blocks[i]);
    copies.assign(blocks, blocks + count);
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
  });
  if (code != VDI_CATALYST_OK) return code;  // all ranks keep the blocks that they have
  catalyst->grid = grid;
  catalyst->arrays.clear();
  catalyst->offsets.clear();
  catalyst->blocks = std::move(copies);
  ++catalyst->blocksVersion;
  catalyst->particles.clear();
  catalyst->deposited.clear();
  catalyst->haveBlocks = true;
  return code;
}

int vdi_catalyst_set_array(vdi_catalyst* catalyst, const char* name, int32_t type, int32_t association,
                           const void* const* data) {
  if (!usable(catalyst)) return VDI_CATALYST_BAD_ARGUMENT;
  const vdi::catalyst::PythonLock lock;
  return setAnyArray(*catalyst, name, type, association, 1, data, nullptr);
}

int vdi_catalyst_set_array_strided(vdi_catalyst* catalyst, const char* name, int32_t type,
                                   int32_t association, int32_t components, const void* const* data,
                                   const vdi_catalyst_strides* strides) {
  if (!usable(catalyst)) return VDI_CATALYST_BAD_ARGUMENT;
  const vdi::catalyst::PythonLock lock;
  const bool isMissing = strides == nullptr && catalyst->grid->GetNumberOfPartitions() > 0;
  const int code = guarded(*catalyst, VDI_CATALYST_BAD_ARGUMENT,
                           [&] { require(!isMissing, "a strided array without strides"); });
  if (code != VDI_CATALYST_OK) return code;
  return setAnyArray(*catalyst, name, type, association, components, data, strides);
}

int vdi_catalyst_set_array_offset(vdi_catalyst* catalyst, const char* name, int32_t association,
                                  const double offset[3]) {
  if (!usable(catalyst)) return VDI_CATALYST_BAD_ARGUMENT;
  const vdi::catalyst::PythonLock lock;
  std::map<std::pair<int, std::string>, glm::dvec3> fresh;
  std::vector<vtkSmartPointer<vtkDataArray>> made;
  const int code = guarded(*catalyst, VDI_CATALYST_BAD_ARGUMENT, [&] {
    require(catalyst->haveBlocks, "an offset was given before blocks");
    vdi::catalyst::checkOffset(name, association, offset);
    fresh[{association, name}] = {offset[0], offset[1], offset[2]};
    const auto array = catalyst->arrays.find({association, name});
    if (array != catalyst->arrays.end())
      made = arraysOf(name, array->second, {offset[0], offset[1], offset[2]});
  });
  if (code != VDI_CATALYST_OK) return code;
  catalyst->offsets.erase(fresh.begin()->first);
  catalyst->offsets.merge(fresh);
  putIntoGrid(*catalyst, name, association, made);
  return code;
}

int vdi_catalyst_set_particles(vdi_catalyst* catalyst, const char* name,
                               const vdi_catalyst_particles* particles) {
  if (!usable(catalyst)) return VDI_CATALYST_BAD_ARGUMENT;
  const vdi::catalyst::PythonLock lock;
  vdi::catalyst::ParticleArray array;
  std::map<std::string, vdi::catalyst::ParticleArray> fresh;
  std::pair<int, std::string> replaced;
  int code = guarded(*catalyst, VDI_CATALYST_BAD_ARGUMENT, [&] {
    require(catalyst->haveBlocks, "particles were given before blocks");
    require(name != nullptr && *name != '\0', "an array needs a name");
    array = vdi::catalyst::particleArrayOf(particles);
    fresh[name] = array;
    replaced = {VDI_CATALYST_CELLS, name};
  });
  if (code == VDI_CATALYST_OK) {
    code = guarded(*catalyst, VDI_CATALYST_BAD_ARGUMENT, [&] {
      requireEqual(catalyst->comm, vdi::catalyst::identityOf(name, array.kind),
                   "the ranks give particles of different names or kinds");
    });
  }
  if (code != VDI_CATALYST_OK) return code;
  for (unsigned int i = 0; i < catalyst->grid->GetNumberOfPartitions(); ++i)
    catalyst->grid->GetPartition(i)->GetCellData()->RemoveArray(name);
  catalyst->arrays.erase(replaced);
  catalyst->deposited.erase(replaced.second);
  catalyst->particles.erase(replaced.second);
  catalyst->particles.merge(fresh);
  return code;
}

int vdi_catalyst_wants(vdi_catalyst* catalyst, int64_t step, double time) {
  if (!usable(catalyst)) return 0;
  const vdi::catalyst::PythonLock lock;
  int wants = isStep(step) && catalyst->engine->wants(static_cast<int>(step), time) ? 1 : 0;
  MPI_Allreduce(MPI_IN_PLACE, &wants, 1, MPI_INT, MPI_MAX, catalyst->comm);
  return wants;
}

int vdi_catalyst_execute(vdi_catalyst* catalyst, int64_t step, double time) {
  if (!usable(catalyst)) return VDI_CATALYST_BAD_ARGUMENT;
  const vdi::catalyst::PythonLock lock;
  int code = guarded(
      *catalyst, VDI_CATALYST_BAD_ARGUMENT,
      [&] {
        require(catalyst->haveBlocks, "no blocks were given yet");
        vdi::catalyst::requireStep(step);
      },
      step);
  if (code == VDI_CATALYST_OK) {
    code = guarded(
        *catalyst, VDI_CATALYST_BAD_ARGUMENT,
        [&] { requireEqual(catalyst->comm, step, "the ranks give different steps"); }, step);
  }
  if (code != VDI_CATALYST_OK) return code;
  code = depositIfWanted(*catalyst, step, time);
  if (code != VDI_CATALYST_OK) return code;
  const int result = guarded(
      *catalyst, VDI_CATALYST_SCRIPT,
      [&] {
        markModified(*catalyst->grid);
        return catalyst->engine->execute(catalyst->grid, static_cast<int>(step), time);
      },
      step);
  if (result == VDI_CATALYST_OK) catalyst->printed.clear();
  return result;
}

double vdi_catalyst_parameter_f64(vdi_catalyst* catalyst, const char* name, double value, double low,
                                  double high) {
  if (!usable(catalyst)) return value;
  return vdi::catalyst::inForce(*catalyst, catalyst->engine->parameters(), name, value, low, high);
}

int64_t vdi_catalyst_parameter_i64(vdi_catalyst* catalyst, const char* name, int64_t value, int64_t low,
                                   int64_t high) {
  if (!usable(catalyst)) return value;
  return vdi::catalyst::inForce(*catalyst, catalyst->engine->parameters(), name, value, low, high);
}

int vdi_catalyst_finalize(vdi_catalyst* catalyst) {
  if (!usable(catalyst)) return VDI_CATALYST_BAD_ARGUMENT;
  const vdi::catalyst::PythonLock lock;
  const std::unique_ptr<vdi_catalyst> self(std::exchange(alive(), nullptr));
  int code = guarded(*self, VDI_CATALYST_SCRIPT, [&] { return self->engine->finish(); });
  self->grid = nullptr;
  self->deposits.reset();
  const int ended = guarded(*self, VDI_CATALYST_ENGINE, [&] { self->engine.reset(); });
  if (code == VDI_CATALYST_OK) code = ended;
  MPI_Comm_free(&self->comm);
  return code;
}

const char* vdi_catalyst_error(const vdi_catalyst* catalyst) {
  return usable(catalyst) ? catalyst->error.c_str() : "";
}
