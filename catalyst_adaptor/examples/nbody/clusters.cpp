// Two star clusters that fall into each other: gravity summed directly over all pairs.
//
//     mpirun -n 4 clusters [vdi.json]
//
// The program writes the last positions to clusters.raw. Without vdi.json it draws nothing, and the
// result has the same bits. Each rank hands over the stars that it moves, and a slab of a lattice, which
// is independent of them. The adaptor makes the density in the cells of all slabs.
#include <mpi.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include <vdi_catalyst.h>

namespace {

constexpr int stars = 600;
constexpr int steps = 60;
constexpr int cells = 32;  // per axis of the lattice
constexpr double size = 4.0;
constexpr double spacing = size / cells;
constexpr double timeStep = 0.02;
constexpr double mass = 1.0 / stars;

using Vector = std::array<double, 3>;

/// Numbers from -1 to 1, the same on all ranks and all machines.
double random() {
  static std::uint64_t state = 1;
  state = state * 6364136223846793005U + 1442695040888963407U;
  return static_cast<double>(state >> 11U) / static_cast<double>(1ULL << 52U) - 1.0;
}

void place(std::vector<Vector>& positions, std::vector<Vector>& velocities) {
  for (int star = 0; star < stars; ++star) {
    const double side = star < stars / 2 ? -1.0 : 1.0;
    Vector p{};
    do {
      for (double& x : p) x = random();
    } while (p[0] * p[0] + p[1] * p[1] + p[2] * p[2] > 1.0);
    const double radius = 0.35 * (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]) + 0.1;
    positions.push_back({side * 0.8 + radius * p[0], side * 0.2 + radius * p[1], radius * p[2]});
    velocities.push_back({-side * 0.4 - 0.8 * p[1], 0.8 * p[0], side * 0.1});
  }
}

/// Sums in the stars' order on every rank, so that the last bits are the same on any number of ranks.
Vector acceleration(const std::vector<Vector>& positions, const Vector& at) {
  Vector sum{};
  for (const Vector& other : positions) {
    const Vector d{other[0] - at[0], other[1] - at[1], other[2] - at[2]};
    const double square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2] + 0.05 * 0.05;
    const double factor = mass / (square * std::sqrt(square));
    for (std::size_t axis = 0; axis < 3; ++axis) sum[axis] += factor * d[axis];
  }
  return sum;
}

/// Hands over this rank's slab of the lattice, and its `count` stars, whose memory stays the same.
int handOver(const char* json, int rank, int ranks, const Vector* mine, int count, vdi_catalyst** vdi) {
  const int first = cells * rank / ranks;
  const int last = cells * (rank + 1) / ranks;
  int code = vdi_catalyst_initialize_json(MPI_Comm_c2f(MPI_COMM_WORLD), json, vdi);
  const vdi_catalyst_block block = {{cells, cells, last - first},
                                    {0, 0, 0},
                                    {0, 0, 0},
                                    {-size / 2, -size / 2, -size / 2 + first * spacing},
                                    {spacing, spacing, spacing}};
  if (code == VDI_CATALYST_OK) code = vdi_catalyst_set_blocks(*vdi, 1, &block);
  vdi_catalyst_particles particles{};
  particles.count = count;
  particles.kind = VDI_CATALYST_DENSITY;
  particles.position_type = VDI_CATALYST_F64;
  for (std::size_t axis = 0; axis < 3; ++axis) particles.positions[axis] = mine->data() + axis;
  particles.position_stride = sizeof(Vector);
  particles.weights = &mass;  // a stride of 0: all stars have this mass
  particles.weight_type = VDI_CATALYST_F64;
  if (code == VDI_CATALYST_OK) code = vdi_catalyst_set_particles(*vdi, "density", &particles);
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  MPI_Init(&argc, &argv);
  int rank = 0;
  int ranks = 1;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Comm_size(MPI_COMM_WORLD, &ranks);
  std::vector<int> counts;  // each rank's count of numbers: 3 per star
  std::vector<int> starts;
  for (int i = 0; i < ranks; ++i) {
    starts.push_back(3 * (stars * i / ranks));
    counts.push_back(3 * (stars * (i + 1) / ranks) - starts.back());
  }
  std::vector<Vector> positions;
  std::vector<Vector> velocities;
  place(positions, velocities);

  const auto own = static_cast<std::size_t>(rank);
  vdi_catalyst* vdi = nullptr;
  int code = VDI_CATALYST_OK;
  Vector* mine = &positions[static_cast<std::size_t>(starts[own] / 3)];
  if (argc > 1) code = handOver(argv[1], rank, ranks, mine, counts[own] / 3, &vdi);
  for (int step = 1; step <= steps; ++step) {
    for (int i = starts[own] / 3; i < (starts[own] + counts[own]) / 3; ++i) {
      const auto star = static_cast<std::size_t>(i);
      const Vector pull = acceleration(positions, positions[star]);
      for (std::size_t axis = 0; axis < 3; ++axis) velocities[star][axis] += timeStep * pull[axis];
    }
    for (int i = starts[own] / 3; i < (starts[own] + counts[own]) / 3; ++i) {
      const auto star = static_cast<std::size_t>(i);
      for (std::size_t axis = 0; axis < 3; ++axis) positions[star][axis] += timeStep * velocities[star][axis];
    }
    MPI_Allgatherv(MPI_IN_PLACE, 0, MPI_DOUBLE, positions.data(), counts.data(), starts.data(), MPI_DOUBLE,
                   MPI_COMM_WORLD);
    // The stars' memory is the same at each step, so there is nothing to hand over again.
    if (vdi != nullptr && code == VDI_CATALYST_OK) code = vdi_catalyst_execute(vdi, step, step * timeStep);
  }
  if (vdi != nullptr) vdi_catalyst_finalize(vdi);

  MPI_File file = MPI_FILE_NULL;
  MPI_File_open(MPI_COMM_WORLD, "clusters.raw", MPI_MODE_CREATE | MPI_MODE_WRONLY, MPI_INFO_NULL, &file);
  MPI_File_write_at_all(file, starts[own] * static_cast<MPI_Offset>(sizeof(double)), mine->data(),
                        counts[own], MPI_DOUBLE, MPI_STATUS_IGNORE);
  MPI_File_close(&file);
  MPI_Finalize();
  return code == VDI_CATALYST_OK ? 0 : 3;
}
