/* A drop that a vortex carries and winds up, on p4est's octree with a value per leaf, finer in the drop.
 * Values follow from the places where the fluid was at the beginning.
 *
 *     mpirun -n 4 tracer LEVELS [vdi.json]   the finest leaves are 1 / 2^LEVELS wide, say 5
 *
 * The program writes the last leaves to tracer.bin. Without vdi.json it draws nothing, and the result
 * has the same bits. */
#include <math.h>
#include <p8est_bits.h>
#include <p8est_extended.h>
#include <stdlib.h>

#include <vdi_catalyst.h>

enum { STEPS = 40, COARSEST = 2, ADAPT = 4 };

static int finest;
static const double time_step = 0.1;
static double now = 0.0;

static double place(p4est_qcoord_t at) {
  return (double)at / P8EST_ROOT_LEN;
}

/* The drop's density at a place. The fluid has circled the middle, the faster the nearer to it. */
static double density(double x, double y, double z) {
  const double radius = hypot(x - 0.5, y - 0.5);
  const double angle = atan2(y - 0.5, x - 0.5) - now * exp(-4 * radius);
  const double from[3] = {radius * cos(angle) + 0.2, radius * sin(angle), z - 0.5};
  return fmax(0.0, 1.0 - 25 * (from[0] * from[0] + from[1] * from[1] + from[2] * from[2]));
}

/* A leaf's value is that of its middle. */
static void fill(p8est_t* forest, p4est_topidx_t tree, p8est_quadrant_t* q) {
  (void)forest, (void)tree;
  const p4est_qcoord_t half = P8EST_QUADRANT_LEN(q->level) / 2;
  *(double*)q->p.user_data = density(place(q->x + half), place(q->y + half), place(q->z + half));
}

/* Whether the drop is at the middle of the leaf or of one of its children. */
static int is_full(p8est_t* forest, p4est_topidx_t tree, p8est_quadrant_t* q) {
  (void)forest, (void)tree;
  const p4est_qcoord_t part = P8EST_QUADRANT_LEN(q->level) / 4;
  double sum = *(double*)q->p.user_data;
  for (int i = 0; i < P8EST_CHILDREN; ++i) {
    sum += density(place(q->x + part * (1 + 2 * (i & 1))), place(q->y + part * (1 + (i & 2))),
                   place(q->z + part * (1 + (i & 4) / 2)));
  }
  return sum > 0.0;
}

static int are_empty(p8est_t* forest, p4est_topidx_t tree, p8est_quadrant_t* q[]) {
  int any = q[0]->level <= COARSEST;
  for (int i = 0; i < P8EST_CHILDREN; ++i) any = any || is_full(forest, tree, q[i]);
  return !any;
}

/* Leaves come, go and change ranks. */
static void adapt(p8est_t* forest) {
  p8est_refine_ext(forest, 1, finest, is_full, fill, NULL);
  p8est_coarsen_ext(forest, 1, 0, are_empty, fill, NULL);
  p8est_balance_ext(forest, P8EST_CONNECT_FULL, fill, NULL);
  p8est_partition(forest, 1, NULL); /* 1: siblings stay on one rank and can be coarsened */
}

/* Each leaf is a block of one cell, whose value the adaptor reads where p4est keeps it. */
static int draw(vdi_catalyst* vdi, sc_array_t* leaves, int step) {
  const size_t count = leaves->elem_count;
  vdi_catalyst_block* blocks = P4EST_ALLOC_ZERO(vdi_catalyst_block, count);
  const void** values = P4EST_ALLOC(const void*, count);
  for (size_t i = 0; i < count; ++i) {
    const p8est_quadrant_t* q = p8est_quadrant_array_index(leaves, i);
    const p4est_qcoord_t corner[3] = {q->x, q->y, q->z};
    for (int axis = 0; axis < 3; ++axis) {
      blocks[i].cells[axis] = 1;
      blocks[i].origin[axis] = place(corner[axis]);
      blocks[i].spacing[axis] = place(P8EST_QUADRANT_LEN(q->level));
    }
    values[i] = q->p.user_data;
  }
  int code = vdi_catalyst_set_blocks(vdi, (int32_t)count, blocks);
  if (code == 0) code = vdi_catalyst_set_array(vdi, "tracer", VDI_CATALYST_F64, VDI_CATALYST_CELLS, values);
  if (code == 0) code = vdi_catalyst_execute(vdi, step, now);
  P4EST_FREE(blocks);
  P4EST_FREE(values);
  return code;
}

int main(int argc, char** argv) {
  MPI_Init(&argc, &argv);
  p4est_init(NULL, SC_LP_ERROR);
  finest = argc > 1 ? atoi(argv[1]) : 5;
  p8est_connectivity_t* cube = p8est_connectivity_new_unitcube();
  p8est_t* forest = p8est_new_ext(MPI_COMM_WORLD, cube, 0, COARSEST, 1, sizeof(double), fill, NULL);
  vdi_catalyst* vdi = NULL;
  int code = 0;
  if (argc > 2) code = vdi_catalyst_initialize_json(MPI_Comm_c2f(MPI_COMM_WORLD), argv[2], &vdi);
  for (int step = 1; step <= STEPS; ++step) {
    now = step * time_step;
    sc_array_t* leaves = &p8est_tree_array_index(forest->trees, 0)->quadrants;
    for (size_t i = 0; i < leaves->elem_count; ++i) fill(forest, 0, p8est_quadrant_array_index(leaves, i));
    if (step % ADAPT == 1) adapt(forest);
    if (vdi != NULL && code == 0 && vdi_catalyst_wants(vdi, step, now)) code = draw(vdi, leaves, step);
  }
  if (vdi != NULL) vdi_catalyst_finalize(vdi);
  p8est_save_ext("tracer.bin", forest, 1, 0); /* with the values, and without the division into ranks */
  p8est_destroy(forest);
  p8est_connectivity_destroy(cube);
  MPI_Finalize();
  return code == 0 ? 0 : 3;
}
