/* A drop that a vortex carries and winds up, on p4est's octree with a value per leaf, finer in the drop.
 * Values follow from the places where the fluid was at the beginning.
 *
 *     mpirun -n 4 tracer [vdi.json] */
#include <math.h>
#include <p8est_bits.h>
#include <p8est_extended.h>

#include <vdi_catalyst.h>

enum { STEPS = 40, COARSEST = 2, FINEST = 5 }; /* a leaf of level L is 1 / 2^L wide */
static double now = 0.0;

/* The drop's density at x, y and z quarters of a leaf's width beyond its corner. The fluid has circled the
 * middle, the faster the nearer to it. */
static double density(const p8est_quadrant_t* q, int x, int y, int z) {
  const double root = P8EST_ROOT_LEN, quarter = P8EST_QUADRANT_LEN(q->level) / 4;
  const double at[3] = {(q->x + x * quarter) / root - 0.5, (q->y + y * quarter) / root - 0.5,
                        (q->z + z * quarter) / root - 0.5};
  const double radius = hypot(at[0], at[1]);
  const double angle = atan2(at[1], at[0]) - now * exp(-4 * radius);
  const double from[3] = {radius * cos(angle) + 0.2, radius * sin(angle), at[2]};
  return fmax(0.0, 1.0 - 25 * (from[0] * from[0] + from[1] * from[1] + from[2] * from[2]));
}

/* A leaf's value is that of its middle. */
static void fill(p8est_t* forest, p4est_topidx_t tree, p8est_quadrant_t* q) {
  (void)forest, (void)tree;
  *(double*)q->p.user_data = density(q, 2, 2, 2);
}

/* Whether the drop is at the middle of the leaf or of one of its children. */
static int is_full(p8est_t* forest, p4est_topidx_t tree, p8est_quadrant_t* q) {
  (void)forest, (void)tree;
  double sum = density(q, 2, 2, 2);
  for (int i = 0; i < P8EST_CHILDREN; ++i) sum += density(q, 1 + 2 * (i & 1), 1 + (i & 2), 1 + (i & 4) / 2);
  return sum > 0.0;
}

/* Leaves come, go and change ranks from step to step. */
static p8est_t* plant(p8est_connectivity_t* cube) {
  p8est_t* forest = p8est_new_ext(MPI_COMM_WORLD, cube, 0, COARSEST, 1, sizeof(double), fill, NULL);
  p8est_refine_ext(forest, 1, FINEST, is_full, fill, NULL);
  p8est_balance(forest, P8EST_CONNECT_FULL, fill);
  p8est_partition(forest, 0, NULL);
  return forest;
}

/* Each leaf is a block of one cell, whose value the adaptor reads where p4est keeps it. */
static void draw(vdi_catalyst* vdi, sc_array_t* leaves, int step) {
  const size_t count = leaves->elem_count;
  vdi_catalyst_block* blocks = P4EST_ALLOC(vdi_catalyst_block, count);
  const void** values = P4EST_ALLOC(const void*, count);
  for (size_t i = 0; i < count; ++i) {
    const p8est_quadrant_t* q = p8est_quadrant_array_index(leaves, i);
    const double unit = 1.0 / P8EST_ROOT_LEN, size = unit * P8EST_QUADRANT_LEN(q->level);
    blocks[i] = (vdi_catalyst_block){
        .cells = {1, 1, 1}, .origin = {q->x * unit, q->y * unit, q->z * unit}, .spacing = {size, size, size}};
    values[i] = q->p.user_data;
  }
  vdi_catalyst_set_blocks(vdi, (int32_t)count, blocks);
  vdi_catalyst_set_array(vdi, "tracer", VDI_CATALYST_F64, VDI_CATALYST_CELLS, values);
  vdi_catalyst_execute(vdi, step, now);
  P4EST_FREE(blocks);
  P4EST_FREE(values);
}

int main(int argc, char** argv) {
  MPI_Init(&argc, &argv);
  p4est_init(NULL, SC_LP_ERROR);
  p8est_connectivity_t* cube = p8est_connectivity_new_unitcube();
  vdi_catalyst* vdi = NULL; /* while it is null, calls do nothing */
  if (argc > 1) vdi_catalyst_initialize_json(MPI_Comm_c2f(MPI_COMM_WORLD), argv[1], &vdi);
  for (int step = 1; step <= STEPS; ++step) {
    now = step * 0.1;
    p8est_t* forest = plant(cube);
    sc_array_t* leaves = &p8est_tree_array_index(forest->trees, 0)->quadrants;
    if (vdi_catalyst_wants(vdi, step, now)) draw(vdi, leaves, step);
    /* The file has the values, but not the division into ranks. */
    if (step == STEPS) p8est_save_ext("tracer.bin", forest, 1, 0);
    p8est_destroy(forest);
  }
  vdi_catalyst_finalize(vdi);
  p8est_connectivity_destroy(cube);
  MPI_Finalize();
}
