/* Scroll waves in an excitable medium, after Barkley, on PETSc's DMDA with two unknowns per point:
 *
 *     du/dt = laplacian(u) + u (1 - u) (u - (v + b) / a) / e,   dv/dt = u - v
 *
 *     mpirun -n 4 scroll_waves [vdi.json] [PETSc's options, such as -da_grid_x 64]
 *
 * A code that solves by TS calls vdi_catalyst_execute in the function that it passes to TSMonitorSet. */
#include <petscdmda.h>

#include <vdi_catalyst.h>

typedef struct {
  PetscScalar u, v;
} Cell;

static const double spacing = 0.8, time_step = 0.02, a = 0.75, b = 0.06, e = 0.02;

/* The medium is excited on one side and refractory below, so the front's edge curls. The front is
 * askew, so the scroll bends. */
static Cell initial(const DMDALocalInfo* box, int x, int y, int z) {
  return (Cell){4 * x + z < 3 * box->mx - box->mx / 2 ? 1.0 : 0.0, 2 * y < box->my ? 0.4 : 0.0};
}

static Cell advanced(Cell*** now, int x, int y, int z) {
  const PetscScalar u = now[z][y][x].u, v = now[z][y][x].v;
  const PetscScalar sum = now[z][y][x - 1].u + now[z][y][x + 1].u + now[z][y - 1][x].u + now[z][y + 1][x].u +
                          now[z - 1][y][x].u + now[z + 1][y][x].u;
  const PetscScalar reaction = u * (1.0 - u) * (u - (v + b) / a) / e;
  return (Cell){u + time_step * ((sum - 6.0 * u) / (spacing * spacing) + reaction), v + time_step * (u - v)};
}

/* Both unknowns lie interleaved in the local vector, with ghosts around them, whose corners a star leaves
 * unset. The adaptor reads them in place, without the ghosts. */
static void hand_over(vdi_catalyst* vdi, const DMDALocalInfo* box, Cell*** now) {
  const int type = sizeof(PetscReal) == sizeof(double) ? VDI_CATALYST_F64 : VDI_CATALYST_F32;
  const vdi_catalyst_block block = {.cells = {box->xm, box->ym, box->zm},
                                    .origin = {box->xs * spacing, box->ys * spacing, box->zs * spacing},
                                    .spacing = {spacing, spacing, spacing}};
  const int64_t cell = sizeof(Cell);
  const vdi_catalyst_strides strides = {{cell, cell * box->gxm, cell * box->gxm * box->gym}, 0};
  const Cell* first = &now[box->zs][box->ys][box->xs];
  const void *u = &first->u, *v = &first->v;
  vdi_catalyst_set_blocks(vdi, 1, &block);
  vdi_catalyst_set_array_strided(vdi, "u", type, VDI_CATALYST_CELLS, 1, &u, &strides);
  vdi_catalyst_set_array_strided(vdi, "v", type, VDI_CATALYST_CELLS, 1, &v, &strides);
}

int main(int argc, char** argv) {
  DM grid;
  DMDALocalInfo box;
  Vec global, local;
  Cell ***now, ***next;
  vdi_catalyst* vdi = NULL; /* as long as it is null, calls do nothing */
  PetscCall(PetscInitialize(&argc, &argv, NULL, NULL));
  const DMBoundaryType mirror = DM_BOUNDARY_MIRROR;
  PetscCall(DMDACreate3d(PETSC_COMM_WORLD, mirror, mirror, mirror, DMDA_STENCIL_STAR, 32, 32, 32,
                         PETSC_DECIDE, PETSC_DECIDE, PETSC_DECIDE, 2, 1, NULL, NULL, NULL, &grid));
  PetscCall(DMSetFromOptions(grid));
  PetscCall(DMSetUp(grid));
  PetscCall(DMDAGetLocalInfo(grid, &box));
  PetscCall(DMCreateGlobalVector(grid, &global));
  PetscCall(DMCreateLocalVector(grid, &local));
  PetscCall(DMDAVecGetArray(grid, local, &now));
  if (argc > 1 && argv[1][0] != '-')
    vdi_catalyst_initialize_json(MPI_Comm_c2f(PETSC_COMM_WORLD), argv[1], &vdi);
  hand_over(vdi, &box, now);
  for (int step = 0; step <= 600; ++step) {
    PetscCall(DMDAVecGetArray(grid, global, &next));
    for (int z = box.zs; z < box.zs + box.zm; ++z)
      for (int y = box.ys; y < box.ys + box.ym; ++y)
        for (int x = box.xs; x < box.xs + box.xm; ++x)
          next[z][y][x] = step == 0 ? initial(&box, x, y, z) : advanced(now, x, y, z);
    PetscCall(DMDAVecRestoreArray(grid, global, &next));
    PetscCall(DMGlobalToLocal(grid, global, INSERT_VALUES, local));
    vdi_catalyst_execute(vdi, step, step * time_step);
  }
  vdi_catalyst_finalize(vdi);
  PetscViewer file;
  PetscCall(PetscViewerBinaryOpen(PETSC_COMM_WORLD, "scroll_waves.bin", FILE_MODE_WRITE, &file));
  PetscCall(VecView(global, file));
  PetscCall(PetscViewerDestroy(&file));
  PetscCall(DMDAVecRestoreArray(grid, local, &now));
  PetscCall(VecDestroy(&local));
  PetscCall(VecDestroy(&global));
  PetscCall(DMDestroy(&grid));
  PetscCall(PetscFinalize());
}
