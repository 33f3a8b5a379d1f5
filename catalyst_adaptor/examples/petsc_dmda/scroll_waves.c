/* Scroll waves in an excitable medium, after Barkley, on PETSc's DMDA with two unknowns per point:
 *
 *     du/dt = laplacian(u) + u (1 - u) (u - (v + b) / a) / e,   dv/dt = u - v
 *
 *     mpirun -n 4 scroll_waves [vdi.json] [PETSc's options, such as -da_grid_x 64]
 *
 * The program writes the last u and v to scroll_waves.bin. Without vdi.json it draws nothing, and the
 * result has the same bits. A code that solves by TS calls vdi_catalyst_execute in the function
 * that it passes to TSMonitorSet. */
#include <math.h>
#include <petscdmda.h>

#include <vdi_catalyst.h>

enum { STEPS = 600 };

typedef struct {
  PetscScalar u, v;
} Cell;

static const double spacing = 0.8, time_step = 0.02;

static void start(const DMDALocalInfo* box, Cell*** next) {
  for (int z = box->zs; z < box->zs + box->zm; ++z) {
    for (int y = box->ys; y < box->ys + box->ym; ++y) {
      for (int x = box->xs; x < box->xs + box->xm; ++x) {
        /* The medium is excited on one side and refractory below, so the front's edge curls. The front
         * is askew, so the scroll bends. */
        next[z][y][x].u = 4 * x + z < 3 * box->mx - box->mx / 2 ? 1.0 : 0.0;
        next[z][y][x].v = 2 * y < box->my ? 0.4 : 0.0;
      }
    }
  }
}

static void advance(const DMDALocalInfo* box, Cell*** now, Cell*** next) {
  const double a = 0.75, b = 0.06, e = 0.02;
  for (int z = box->zs; z < box->zs + box->zm; ++z) {
    for (int y = box->ys; y < box->ys + box->ym; ++y) {
      for (int x = box->xs; x < box->xs + box->xm; ++x) {
        const PetscScalar u = now[z][y][x].u;
        const PetscScalar v = now[z][y][x].v;
        const PetscScalar sum = now[z][y][x - 1].u + now[z][y][x + 1].u + now[z][y - 1][x].u +
                                now[z][y + 1][x].u + now[z - 1][y][x].u + now[z + 1][y][x].u;
        const PetscScalar reaction = u * (1.0 - u) * (u - (v + b) / a) / e;
        next[z][y][x].u = u + time_step * ((sum - 6.0 * u) / (spacing * spacing) + reaction);
        next[z][y][x].v = v + time_step * (u - v);
      }
    }
  }
}

/* Hands over both unknowns in place in the local vector: interleaved, and without the ghosts around
 * them. PETSc leaves the corners of a star's ghosts unset; the adaptor asks the neighbours itself. */
static int hand_over(vdi_catalyst* vdi, const DMDALocalInfo* box, Cell*** now) {
  const int type = sizeof(PetscReal) == sizeof(double) ? VDI_CATALYST_F64 : VDI_CATALYST_F32;
  const vdi_catalyst_block block = {{box->xm, box->ym, box->zm},
                                    {0, 0, 0},
                                    {0, 0, 0},
                                    {box->xs * spacing, box->ys * spacing, box->zs * spacing},
                                    {spacing, spacing, spacing}};
  const int64_t cell = sizeof(Cell);
  const vdi_catalyst_strides strides = {{cell, cell * box->gxm, cell * box->gxm * box->gym}, 0};
  const Cell* first = &now[box->zs][box->ys][box->xs];
  const void* u = &first->u;
  const void* v = &first->v;
  int code = vdi_catalyst_set_blocks(vdi, 1, &block);
  if (code == 0) code = vdi_catalyst_set_array_strided(vdi, "u", type, VDI_CATALYST_CELLS, 1, &u, &strides);
  if (code == 0) code = vdi_catalyst_set_array_strided(vdi, "v", type, VDI_CATALYST_CELLS, 1, &v, &strides);
  return code;
}

int main(int argc, char** argv) {
  PetscCall(PetscInitialize(&argc, &argv, NULL, NULL));
  DM grid;
  Vec global, local;
  Cell ***now, ***next;
  DMDALocalInfo box;
  const DMBoundaryType mirror = DM_BOUNDARY_MIRROR;
  PetscCall(DMDACreate3d(PETSC_COMM_WORLD, mirror, mirror, mirror, DMDA_STENCIL_STAR, 32, 32, 32,
                         PETSC_DECIDE, PETSC_DECIDE, PETSC_DECIDE, 2, 1, NULL, NULL, NULL, &grid));
  PetscCall(DMSetFromOptions(grid));
  PetscCall(DMSetUp(grid));
  PetscCall(DMDAGetLocalInfo(grid, &box));
  PetscCall(DMCreateGlobalVector(grid, &global));
  PetscCall(DMCreateLocalVector(grid, &local));
  PetscCall(VecSet(local, NAN)); /* corners keep NAN, which would show */
  PetscCall(DMDAVecGetArray(grid, local, &now));

  vdi_catalyst* vdi = NULL;
  int code = 0;
  if (argc > 1 && argv[1][0] != '-') {
    code = vdi_catalyst_initialize_json(MPI_Comm_c2f(PETSC_COMM_WORLD), argv[1], &vdi);
    if (code == 0) code = hand_over(vdi, &box, now);
  }
  PetscCall(DMDAVecGetArray(grid, global, &next));
  start(&box, next);
  PetscCall(DMDAVecRestoreArray(grid, global, &next));
  for (int step = 1; step <= STEPS; ++step) {
    PetscCall(DMGlobalToLocal(grid, global, INSERT_VALUES, local));
    if (vdi != NULL && code == 0) code = vdi_catalyst_execute(vdi, step - 1, (step - 1) * time_step);
    PetscCall(DMDAVecGetArray(grid, global, &next));
    advance(&box, now, next);
    PetscCall(DMDAVecRestoreArray(grid, global, &next));
  }
  if (vdi != NULL) vdi_catalyst_finalize(vdi);

  PetscViewer file;
  PetscCall(PetscViewerBinaryOpen(PETSC_COMM_WORLD, "scroll_waves.bin", FILE_MODE_WRITE, &file));
  PetscCall(VecView(global, file));
  PetscCall(PetscViewerDestroy(&file));
  PetscCall(DMDAVecRestoreArray(grid, local, &now));
  PetscCall(VecDestroy(&local));
  PetscCall(VecDestroy(&global));
  PetscCall(DMDestroy(&grid));
  PetscCall(PetscFinalize());
  return code == 0 ? 0 : 3;
}
