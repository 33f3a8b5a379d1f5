// A simulation of which one rank runs out of memory within the adaptor. In each call, some allocations of the
// adaptor's own code fail, one at a time. The call must report the failure on all ranks, or do
// without the memory. The process goes on, no rank is left waiting, and the next call works.
//
// catalyst_allocations [growth [script]]: after allocation n, allocation growth * n + 1 fails; 1.0 tries all.
// Without a script the run is described by JSON. VDI_TEST_RANK is the rank that fails, the last one by
// default.
#include <dlfcn.h>
#include <mpi.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <string_view>

#include "catalyst_adaptor/vdi_catalyst.h"
#include "tests/AllocationOperators.h"

namespace {

std::atomic<std::int64_t> toGo{0};  // the allocation that fails; 0: none does
std::atomic<bool> hasFailed = false;

/// Whether the code at the address belongs to the adaptor, not to MPI or a driver.
bool isAdaptors(const void* address) {
  Dl_info info;
  return ::dladdr(address, &info) != 0 && info.dli_fname != nullptr &&
         std::string_view(info.dli_fname).find("libvdi_catalyst_") != std::string_view::npos;
}

}  // namespace

// The engines, which are loaded later, use the operators that call this, because the program's symbols come
// first.
void* vdi::test::allocate(std::size_t bytes, const void* caller) noexcept {
  if (toGo > 0 && isAdaptors(caller) && --toGo == 0) {
    hasFailed = true;
    return nullptr;
  }
  return std::malloc(bytes > 0 ? bytes : 1);
}

namespace {

constexpr const char* json =
    R"({"field": "density_of_the_particles", "when": {"max": "V", "above": 0}, "resolution": [32, 24],
        "output": {"vdi": "step_{timestep:06d}.vdi", "png": "step_{timestep:06d}.png", "latest": true},
        "existing": "overwrite", "log": {"json": "run.jsonl", "text": "run.log"}})";
const char* script = nullptr;
vdi_catalyst* catalyst = nullptr;
std::int64_t step = 0;
int wrong = 0;
int failures = 0;
int rank = 0;
int ranks = 1;
int failing = 0;

bool onAnyRank(bool here) {
  int any = here ? 1 : 0;
  MPI_Allreduce(MPI_IN_PLACE, &any, 1, MPI_INT, MPI_MAX, MPI_COMM_WORLD);
  return any != 0;
}

void expect(bool holds, const char* call, std::int64_t allocation, const char* what) {
  if (holds) return;
  ++wrong;
  std::fprintf(stderr, "%s, allocation %lld: %s\n", call, static_cast<long long>(allocation), what);
}

/// Repeats the call with one failing allocation at a time, until none of its allocations is left to fail.
/// With `once`, for a call that succeeds only once in a process, it ends at the first success.
template <typename Call>
void tryAll(const char* name, double growth, Call call, bool once = false) {
  for (std::int64_t n = 1;; n = static_cast<std::int64_t>(static_cast<double>(n) * growth) + 1) {
    hasFailed = false;
    if (rank == failing) toGo = n;
    int code = VDI_CATALYST_OK;
    try {
      code = call();
    } catch (...) {
      expect(false, name, n, "an exception reached the simulation");
    }
    toGo = 0;
    hasFailed = onAnyRank(hasFailed);
    expect(onAnyRank(code != VDI_CATALYST_OK) == (code != VDI_CATALYST_OK), name, n, "some ranks succeeded");
    if (code != VDI_CATALYST_OK) {
      ++failures;
      expect(hasFailed, name, n, "it failed, although no allocation did");
      if (catalyst != nullptr)
        expect(*vdi_catalyst_error(catalyst) != '\0', name, n, "a failure without a text");
      expect(once || call() == VDI_CATALYST_OK, name, n, "the next call failed, too");
    }
    if (!hasFailed || (once && code == VDI_CATALYST_OK)) return;
  }
}

int initialize() {
  if (catalyst != nullptr) (void)vdi_catalyst_finalize(catalyst);
  const MPI_Fint comm = MPI_Comm_c2f(MPI_COMM_WORLD);
  if (script != nullptr) return vdi_catalyst_initialize(comm, 1, &script, &catalyst);
  return vdi_catalyst_initialize_json(comm, json, &catalyst);
}

int execute() {
  static const bool isIsolated = std::getenv("VDI_ISOLATION") != nullptr;  // frames are made later
  ++step;
  const int code = vdi_catalyst_execute(catalyst, step, 0.5 * static_cast<double>(step));
  const std::string number = std::to_string(1000000 + step).substr(1);
  MPI_Barrier(MPI_COMM_WORLD);
  for (const char* end : {".vdi", ".png"}) {
    if (rank != 0 || isIsolated) break;
    if (script != nullptr && std::string_view(end) == ".png") break;
    const bool isThere = std::filesystem::remove("step_" + number + end);
    expect(isThere || code != VDI_CATALYST_OK, "execute", step, "a file is missing without an error");
  }
  return code;
}

void setAll() {
  // Blocks of two levels on each rank, so that ranks exchange layers within levels and between them.
  constexpr int size = 8;
  static std::array<float, size * size * size> values;
  static std::array<double, 30> places;
  values.fill(1.0F);
  values[0] = 0.5F;
  for (std::size_t i = 0; i < places.size(); ++i) places[i] = 0.25 * static_cast<double>(i);
  const double z = rank * size;
  const std::array<vdi_catalyst_block, 2> blocks{
      {{{size, size, size}, {0, 0, 0}, {0, 0, 0}, {0, 0, z}, {1, 1, 1}},
       {{size, size, size}, {0, 0, 0}, {0, 0, 0}, {size, 0, z}, {0.5, 0.5, 1}}}};
  tryAll("set_blocks", 1.0, [&] { return vdi_catalyst_set_blocks(catalyst, blocks.size(), blocks.data()); });
  const std::array<const void*, 2> data{values.data(), values.data()};
  tryAll("set_array", 1.0, [&] {
    return vdi_catalyst_set_array(catalyst, "V", VDI_CATALYST_F32, VDI_CATALYST_CELLS, data.data());
  });
  const std::array<double, 3> offset{0.25, 0.0, 0.0};
  tryAll("set_array_offset", 1.0, [&] {
    return vdi_catalyst_set_array_offset(catalyst, "an_array_of_a_longer_name", VDI_CATALYST_CELLS,
                                         offset.data());
  });
  vdi_catalyst_particles particles{};
  particles.count = 10;
  particles.kind = VDI_CATALYST_DENSITY;
  particles.position_type = VDI_CATALYST_F64;
  particles.position_stride = 3 * sizeof(double);
  for (std::size_t axis = 0; axis < 3; ++axis) particles.positions[axis] = places.data() + axis;
  tryAll("set_particles", 1.0,
         [&] { return vdi_catalyst_set_particles(catalyst, "density_of_the_particles", &particles); });
}

}  // namespace

int main(int argc, char** argv) {
  MPI_Init(&argc, &argv);
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Comm_size(MPI_COMM_WORLD, &ranks);
  const char* const chosen = std::getenv("VDI_TEST_RANK");
  failing = chosen != nullptr ? std::atoi(chosen) : ranks - 1;
  const char* folder = std::getenv("VDI_OUTPUT");
  if (folder != nullptr && ::chdir(folder) != 0) MPI_Abort(MPI_COMM_WORLD, 2);
  const double few = argc > 1 ? std::atof(argv[1]) : 1.3;
  if (argc > 2) script = argv[2];
  tryAll("initialize", few, initialize, script != nullptr);  // ParaView starts once in a process
  if (catalyst == nullptr) MPI_Abort(MPI_COMM_WORLD, 3);
  setAll();
  expect(execute() == VDI_CATALYST_OK, "the first step", 0, "it failed");
  tryAll("execute", few, execute);
  if (rank == failing) toGo = 5;
  const int code = vdi_catalyst_finalize(catalyst);
  toGo = 0;
  expect(code == VDI_CATALYST_OK || code == VDI_CATALYST_ENGINE, "finalize", 1, "an unknown code");
  expect(failures > 10, "all calls", failures, "too few failed");
  if (rank == 0) std::fprintf(stderr, "%d calls failed because memory ran out\n", failures);
  const bool isWrong = onAnyRank(wrong != 0);
  MPI_Finalize();
  return isWrong ? 1 : 0;
}
