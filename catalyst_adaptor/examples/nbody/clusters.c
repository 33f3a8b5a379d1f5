/* Two star clusters that fall into each other: gravity summed directly over all pairs.
 *
 *     mpirun -n 4 clusters [vdi.json]
 *
 * Each rank computes the pull on some of the stars and hands these over, with a slab of a lattice. A star
 * may lie in any rank's slab. The adaptor makes the density in the cells of all slabs. */
#include <math.h>
#include <mpi.h>
#include <stdio.h>
#include <string.h>

#include <vdi_catalyst.h>

enum { STARS = 600, CELLS = 32 /* of the lattice per axis */ };
static const double time_step = 0.02, mass = 1.0 / STARS;
static double position[STARS][3], velocity[STARS][3], pull[STARS][3]; /* each rank has all stars */

/* Stars fill two balls, densest in the middle, that turn and approach each other. */
static void place(int star) {
  const double side = star < STARS / 2 ? -1.0 : 1.0;
  const double height = 2.0 * fmod(star * 0.8192, 1.0) - 1.0, angle = 2.4 * star;
  const double radius = 0.45 * fmod(star * 0.6711, 1.0), across = radius * sqrt(1.0 - height * height);
  const double offset[3] = {across * cos(angle), across * sin(angle), radius * height};
  const double center[3] = {0.8 * side, 0.2 * side, 0.0};
  const double speed[3] = {-0.4 * side - 2.0 * offset[1], 2.0 * offset[0], 0.1 * side};
  for (int axis = 0; axis < 3; ++axis) position[star][axis] = center[axis] + offset[axis];
  for (int axis = 0; axis < 3; ++axis) velocity[star][axis] = speed[axis];
}

static void add_pulls(int star) {
  for (int other = 0; other < STARS; ++other) {
    double d[3], square = 0.05 * 0.05;
    for (int axis = 0; axis < 3; ++axis) d[axis] = position[other][axis] - position[star][axis];
    for (int axis = 0; axis < 3; ++axis) square += d[axis] * d[axis];
    for (int axis = 0; axis < 3; ++axis) pull[star][axis] += mass / (square * sqrt(square)) * d[axis];
  }
}

/* Hands over the stars from `first` to before `end`, and the slab between two layers of the lattice. */
static void hand_over(vdi_catalyst* vdi, int first, int end, int bottom, int top) {
  const double h = 4.0 / CELLS;
  const vdi_catalyst_block slab = {
      .cells = {CELLS, CELLS, top - bottom}, .origin = {-2.0, -2.0, bottom * h - 2.0}, .spacing = {h, h, h}};
  const vdi_catalyst_particles stars = {
      .count = end - first,
      .kind = VDI_CATALYST_DENSITY,
      .position_type = VDI_CATALYST_F64,
      .positions = {&position[first][0], &position[first][1], &position[first][2]},
      .position_stride = sizeof position[first],
      .weight_type = VDI_CATALYST_F64,
      .weights = &mass}; /* with a stride of 0: all stars have this mass */
  vdi_catalyst_set_blocks(vdi, 1, &slab);
  vdi_catalyst_set_particles(vdi, "density", &stars);
}

int main(int argc, char** argv) {
  int rank, ranks;
  MPI_Init(&argc, &argv);
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Comm_size(MPI_COMM_WORLD, &ranks);
  const int first = STARS * rank / ranks, end = STARS * (rank + 1) / ranks;
  for (int star = 0; star < STARS; ++star) place(star);

  vdi_catalyst* vdi = NULL; /* while it is null, calls do nothing */
  if (argc > 1) vdi_catalyst_initialize_json(MPI_Comm_c2f(MPI_COMM_WORLD), argv[1], &vdi);
  hand_over(vdi, first, end, CELLS * rank / ranks, CELLS * (rank + 1) / ranks);
  for (int step = 1; step <= 60; ++step) {
    memset(pull, 0, sizeof pull);
    for (int star = first; star < end; ++star) add_pulls(star);
    MPI_Allreduce(MPI_IN_PLACE, pull, 3 * STARS, MPI_DOUBLE, MPI_SUM, MPI_COMM_WORLD);
    for (int star = 0; star < STARS; ++star) {
      for (int axis = 0; axis < 3; ++axis) {
        velocity[star][axis] += time_step * pull[star][axis];
        position[star][axis] += time_step * velocity[star][axis];
      }
    }
    vdi_catalyst_execute(vdi, step, step * time_step); /* reads the stars where they are */
  }
  vdi_catalyst_finalize(vdi);

  FILE* file = rank == 0 ? fopen("clusters.raw", "wb") : NULL;
  if (file != NULL) {
    fwrite(position, sizeof position, 1, file);
    fclose(file);
  }
  MPI_Finalize();
}
