// A pulse of a dipole beside a dielectric sphere in a metal box, by Meep:
//
//     mpirun -n 4 dipole [vdi.json]
//
// Meep divides the box into chunks, of which a rank may have several. Each is a block, with the field Ez in
// place in Meep's array: z fastest, on the cells' edges along z, behind a layer of values that other chunks
// own.
#include <mpi.h>

#include <fstream>
#include <meep.hpp>
#include <memory>
#include <vector>

#include <vdi_catalyst.h>

namespace {

double epsilon(const meep::vec& place) {
  return abs(place - meep::vec(1.2, 1.0, 1.0)) < 0.45 ? 6.0 : 1.0;
}

/// Hands over this rank's chunks.
void handOver(vdi_catalyst* vdi, const meep::fields& fields) {
  const meep::component shown = meep::Ez;
  const meep::direction axes[] = {meep::X, meep::Y, meep::Z};
  std::vector<vdi_catalyst_block> blocks;
  std::vector<const void*> values;
  std::vector<vdi_catalyst_strides> strides;
  for (int i = 0; i < fields.num_chunks; ++i) {
    const meep::fields_chunk& chunk = *fields.chunks[i];
    if (!chunk.is_mine()) continue;
    const meep::grid_volume& grid = chunk.gv;
    vdi_catalyst_block block = {{grid.nx(), grid.ny(), grid.nz()}, {}, {}, {}, {}};
    vdi_catalyst_strides layout = {};
    for (int a = 0; a < 3; ++a) {
      // Meep counts in halves of a pixel.
      block.origin[a] = grid.little_corner().in_direction(axes[a]) * 0.5 * grid.inva;
      block.spacing[a] = grid.inva;
      layout.strides[a] = grid.stride(axes[a]) * static_cast<int64_t>(sizeof(meep::realnum));
    }
    const meep::realnum* const field = chunk.f[shown][0];  // null where the component is always 0
    const auto first = grid.index(shown, grid.little_owned_corner0(shown));
    blocks.push_back(block);
    values.push_back(field != nullptr ? field + first : nullptr);
    strides.push_back(layout);
  }
  // A chunk owns the upper one of two values, so its values lie on upper faces, or in the middle along z.
  double offset[3];
  for (int a = 0; a < 3; ++a) offset[a] = 0.5 * (1 - fields.gv.iyee_shift(shown).in_direction(axes[a]));
  const int type = sizeof(meep::realnum) == sizeof(double) ? VDI_CATALYST_F64 : VDI_CATALYST_F32;
  vdi_catalyst_set_blocks(vdi, static_cast<int>(blocks.size()), blocks.data());
  vdi_catalyst_set_array_offset(vdi, "Ez", VDI_CATALYST_CELLS, offset);
  vdi_catalyst_set_array_strided(vdi, "Ez", type, VDI_CATALYST_CELLS, 1, values.data(), strides.data());
}

}  // namespace

int main(int argc, char** argv) {
  const meep::initialize mpi(argc, argv);
  meep::verbosity = 0;
  const meep::grid_volume box = meep::vol3d(2.0, 2.0, 2.0, 16.0);  // sides, pixels per unit
  meep::structure structure(box, epsilon, meep::no_pml(), meep::identity(), 7);
  meep::fields fields(&structure);
  fields.add_point_source(meep::Ez, meep::gaussian_src_time(1.2, 0.8), meep::vec(0.4, 1.0, 1.0));

  vdi_catalyst* vdi = nullptr;  // while it is null, calls do nothing
  if (argc > 1) vdi_catalyst_initialize_json(MPI_Comm_c2f(MPI_COMM_WORLD), argv[1], &vdi);
  handOver(vdi, fields);
  for (int step = 1; step <= 120; ++step) {
    fields.step();
    vdi_catalyst_execute(vdi, step, fields.time());
  }
  vdi_catalyst_finalize(vdi);

  const std::unique_ptr<meep::realnum[]> all(fields.get_array_slice(box.surroundings(), meep::Ez));
  if (meep::am_master()) {
    std::ofstream("dipole.bin", std::ios::binary)
        .write(reinterpret_cast<const char*>(all.get()),
               sizeof(meep::realnum) * box.nx() * box.ny() * box.nz());
  }
}
