// A pulse of a dipole beside a dielectric sphere in a metal box, by Meep:
//
//     mpirun -n 4 dipole [vdi.json]
//
// Meep divides the box into chunks, of which a rank may have several. Each is a block, with the field Ez in
// place in Meep's array: z fastest, on the cells' edges along z, behind a layer of values that other chunks
// own. The program writes the last Ez to dipole.bin. Without vdi.json it draws nothing, and the result has
// the same bits.
#include <mpi.h>

#include <cstdio>
#include <meep.hpp>
#include <memory>
#include <vector>

#include <vdi_catalyst.h>

namespace {

constexpr double side = 2.0;
constexpr double resolution = 16.0;
constexpr int steps = 120;
constexpr int chunks = 7;

double epsilon(const meep::vec& place) {
  return abs(place - meep::vec(1.2, 1.0, 1.0)) < 0.45 ? 6.0 : 1.0;
}

/// Hands over this rank's chunks.
int handOver(vdi_catalyst* vdi, const meep::fields& fields) {
  const meep::component shown = meep::Ez;
  const meep::direction axes[] = {meep::X, meep::Y, meep::Z};
  std::vector<vdi_catalyst_block> blocks;
  std::vector<const void*> values;
  std::vector<vdi_catalyst_strides> strides;
  for (int i = 0; i < fields.num_chunks; ++i) {
    const meep::fields_chunk& chunk = *fields.chunks[i];
    if (!chunk.is_mine()) continue;
    const meep::grid_volume& grid = chunk.gv;
    vdi_catalyst_block block = {{grid.nx(), grid.ny(), grid.nz()}, {0, 0, 0}, {0, 0, 0}, {}, {}};
    vdi_catalyst_strides layout = {{}, 0};
    const meep::ivec firstOwned = grid.little_owned_corner0(shown);
    for (int a = 0; a < 3; ++a) {
      // Meep counts in halves of a pixel.
      block.origin[a] = grid.little_corner().in_direction(axes[a]) * 0.5 * grid.inva;
      block.spacing[a] = grid.inva;
      layout.strides[a] = grid.stride(axes[a]) * static_cast<int64_t>(sizeof(meep::realnum));
    }
    const meep::realnum* const field = chunk.f[shown][0];  // null where the component is always 0
    blocks.push_back(block);
    values.push_back(field != nullptr ? field + grid.index(shown, firstOwned) : nullptr);
    strides.push_back(layout);
  }
  const int type = sizeof(meep::realnum) == sizeof(double) ? VDI_CATALYST_F64 : VDI_CATALYST_F32;
  // A chunk owns the upper one of two values, so its values lie on upper faces, or in the middle
  // along z.
  double offset[] = {0.0, 0.0, 0.0};
  for (int a = 0; a < 3; ++a) offset[a] = 0.5 * (1 - fields.gv.iyee_shift(shown).in_direction(axes[a]));
  int code = vdi_catalyst_set_blocks(vdi, static_cast<int>(blocks.size()), blocks.data());
  if (code == 0) code = vdi_catalyst_set_array_offset(vdi, "Ez", VDI_CATALYST_CELLS, offset);
  if (code == 0) {
    code =
        vdi_catalyst_set_array_strided(vdi, "Ez", type, VDI_CATALYST_CELLS, 1, values.data(), strides.data());
  }
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  const meep::initialize mpi(argc, argv);
  meep::verbosity = 0;
  const meep::grid_volume box = meep::vol3d(side, side, side, resolution);
  meep::structure structure(box, epsilon, meep::no_pml(), meep::identity(), chunks);
  meep::fields fields(&structure);
  fields.add_point_source(meep::Ez, meep::gaussian_src_time(1.2, 0.8), meep::vec(0.4, 1.0, 1.0));

  vdi_catalyst* vdi = nullptr;
  int code = 0;
  if (argc > 1) {
    code = vdi_catalyst_initialize_json(MPI_Comm_c2f(MPI_COMM_WORLD), argv[1], &vdi);
    if (code == 0) code = handOver(vdi, fields);
  }
  for (int step = 1; step <= steps; ++step) {
    fields.step();
    if (vdi != nullptr && code == 0) code = vdi_catalyst_execute(vdi, step, fields.time());
  }
  if (vdi != nullptr) vdi_catalyst_finalize(vdi);

  const std::unique_ptr<meep::realnum[]> all(fields.get_array_slice(box.surroundings(), meep::Ez));
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  if (rank == 0) {
    std::FILE* const file = std::fopen("dipole.bin", "wb");
    const auto count = static_cast<std::size_t>(box.nx()) * static_cast<std::size_t>(box.ny()) *
                       static_cast<std::size_t>(box.nz());
    if (file == nullptr || std::fwrite(all.get(), sizeof(meep::realnum), count, file) != count) code = 3;
    if (file != nullptr && std::fclose(file) != 0) code = 3;
  }
  return code == 0 ? 0 : 3;
}
