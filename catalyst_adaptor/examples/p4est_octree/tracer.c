/* Transport of a drop by a vortex, on p4est's octree with a value per leaf, finer in the drop.
 *
 *     mpirun -n 4 tracer LEVELS [vdi.json]   the finest leaves are 1 / 2^LEVELS wide, say 5
 *
 * The program writes the amounts of the last leaves to tracer.raw, in p4est's order. Without vdi.json
 * it draws nothing, and the result has the same bits. Amounts are whole numbers of tiny portions, so
 * none is lost, and sums don't depend on the order in which p4est visits faces. */
#include <math.h>
#include <p8est_bits.h>
#include <p8est_extended.h>
#include <p8est_ghost.h>
#include <p8est_iterate.h>
#include <stdlib.h>

#include <vdi_catalyst.h>

enum { STEPS = 40, COARSEST = 2, ADAPT = 4 };

typedef struct {
  int64_t amount, change;
} Leaf;

static int finest;
static const double portion = 1e-15, time_step = 1.0 / 128;

static double edge(const p8est_quadrant_t* q) {
  return (double)P8EST_QUADRANT_LEN(q->level) / P8EST_ROOT_LEN;
}

static double density(const p8est_quadrant_t* q, const Leaf* leaf) {
  return (double)leaf->amount * portion / (edge(q) * edge(q) * edge(q));
}

static void fill(p8est_t* forest, p4est_topidx_t tree, p8est_quadrant_t* q) {
  (void)forest, (void)tree;
  const double half = edge(q) / 2;
  const double x = (double)q->x / P8EST_ROOT_LEN + half - 0.3;
  const double y = (double)q->y / P8EST_ROOT_LEN + half - 0.5;
  const double z = (double)q->z / P8EST_ROOT_LEN + half - 0.5;
  const double height = fmax(0.0, 1.0 - (x * x + y * y + z * z) / (0.2 * 0.2));
  const Leaf leaf = {(int64_t)(height * 8 * half * half * half / portion), 0};
  *(Leaf*)q->p.user_data = leaf;
}

/* Divides an amount among children, or sums theirs. The remainder by 8 goes to the first children. */
static void pass_on(p8est_t* forest, p4est_topidx_t tree, int before, p8est_quadrant_t* old[], int after,
                    p8est_quadrant_t* new[]) {
  (void)forest, (void)tree;
  int64_t sum = 0;
  for (int i = 0; i < before; ++i) sum += ((Leaf*)old[i]->p.user_data)->amount;
  for (int i = 0; i < after; ++i) {
    const Leaf leaf = {sum / after + (i < sum % after), 0};
    *(Leaf*)new[i]->p.user_data = leaf;
  }
}

static int is_full(p8est_t* forest, p4est_topidx_t tree, p8est_quadrant_t* q) {
  (void)forest, (void)tree;
  return density(q, q->p.user_data) > 0.02;
}

static int are_empty(p8est_t* forest, p4est_topidx_t tree, p8est_quadrant_t* q[]) {
  if (q[0]->level <= COARSEST) return 0;
  for (int i = 0; i < P8EST_CHILDREN; ++i) {
    if (is_full(forest, tree, q[i])) return 0;
  }
  return 1;
}

static void adapt(p8est_t* forest) {
  p8est_refine_ext(forest, 0, finest, is_full, NULL, pass_on);
  p8est_coarsen_ext(forest, 0, 0, are_empty, NULL, pass_on);
  p8est_balance_ext(forest, P8EST_CONNECT_FULL, NULL, pass_on);
  p8est_partition(forest, 1,
                  NULL); /* 1: siblings stay on one rank, so that coarsening doesn't depend on ranks */
}

/* Computes the upwind flow through one face, between a leaf and one leaf or four on its other side. */
static void flow(p8est_iter_face_info_t* info, void* ghosts) {
  if (info->sides.elem_count < 2) return; /* a wall */
  const p8est_iter_face_side_t* sides = (const p8est_iter_face_side_t*)info->sides.array;
  for (int i = 0; i < P8EST_HALF; ++i) {
    const p8est_quadrant_t* q[2];
    Leaf* leaf[2];
    int own[2], lower = 0;
    for (int s = 0; s < 2; ++s) {
      const p8est_iter_face_side_t* side = &sides[s];
      const int hangs = side->is_hanging != 0;
      q[s] = hangs ? side->is.hanging.quad[i] : side->is.full.quad;
      own[s] = !(hangs ? side->is.hanging.is_ghost[i] : side->is.full.is_ghost);
      const p4est_locidx_t id = hangs ? side->is.hanging.quadid[i] : side->is.full.quadid;
      leaf[s] = own[s] ? (Leaf*)q[s]->p.user_data : (Leaf*)ghosts + id;
      if (side->face % 2 == 1) lower = s; /* its upper face is this one */
    }
    const p8est_quadrant_t* fine = q[0]->level > q[1]->level ? q[0] : q[1];
    const double half = edge(fine) / 2;
    const double x = (double)fine->x / P8EST_ROOT_LEN + half - 0.5;
    const double y = (double)fine->y / P8EST_ROOT_LEN + half - 0.5;
    const double speed[3] = {-2 * y, 2 * x, 0.0};
    const double v = speed[sides[0].face / 2];
    const int from = v > 0 ? lower : 1 - lower;
    const double volume = fabs(v) * time_step * 4 * half * half;
    const int64_t moved = (int64_t)(volume * density(q[from], leaf[from]) / portion);
    if (own[from]) leaf[from]->change -= moved;
    if (own[1 - from]) leaf[1 - from]->change += moved;
    if (!sides[0].is_hanging && !sides[1].is_hanging) return;
  }
}

/* Each leaf is a block of one cell. */
static int draw(vdi_catalyst* vdi, p8est_t* forest, int step) {
  sc_array_t* leaves = &p8est_tree_array_index(forest->trees, 0)->quadrants;
  const size_t count = leaves->elem_count;
  vdi_catalyst_block* blocks = P4EST_ALLOC_ZERO(vdi_catalyst_block, count);
  double* values = P4EST_ALLOC(double, count);
  const void** pointers = P4EST_ALLOC(const void*, count);
  for (size_t i = 0; i < count; ++i) {
    const p8est_quadrant_t* q = p8est_quadrant_array_index(leaves, i);
    const int32_t at[3] = {q->x, q->y, q->z};
    for (int axis = 0; axis < 3; ++axis) {
      blocks[i].cells[axis] = 1;
      blocks[i].origin[axis] = (double)at[axis] / P8EST_ROOT_LEN;
      blocks[i].spacing[axis] = edge(q);
    }
    values[i] = density(q, q->p.user_data);
    pointers[i] = &values[i];
  }
  int code = vdi_catalyst_set_blocks(vdi, (int32_t)count, blocks);
  if (code == 0) code = vdi_catalyst_set_array(vdi, "tracer", VDI_CATALYST_F64, VDI_CATALYST_CELLS, pointers);
  if (code == 0) code = vdi_catalyst_execute(vdi, step, step * time_step);
  P4EST_FREE(blocks);
  P4EST_FREE(values);
  P4EST_FREE(pointers);
  return code;
}

static void advance(p8est_t* forest) {
  p8est_ghost_t* ghost = p8est_ghost_new(forest, P8EST_CONNECT_FACE);
  Leaf* ghosts = P4EST_ALLOC(Leaf, ghost->ghosts.elem_count);
  p8est_ghost_exchange_data(forest, ghost, ghosts);
  p8est_iterate(forest, ghost, ghosts, NULL, flow, NULL, NULL);
  sc_array_t* leaves = &p8est_tree_array_index(forest->trees, 0)->quadrants;
  for (size_t i = 0; i < leaves->elem_count; ++i) {
    Leaf* leaf = p8est_quadrant_array_index(leaves, i)->p.user_data;
    leaf->amount += leaf->change;
    leaf->change = 0;
  }
  P4EST_FREE(ghosts);
  p8est_ghost_destroy(ghost);
}

static void write_result(p8est_t* forest) {
  sc_array_t* leaves = &p8est_tree_array_index(forest->trees, 0)->quadrants;
  const size_t count = leaves->elem_count;
  int64_t* amounts = P4EST_ALLOC(int64_t, count);
  for (size_t i = 0; i < count; ++i) {
    amounts[i] = ((Leaf*)p8est_quadrant_array_index(leaves, i)->p.user_data)->amount;
  }
  MPI_File file;
  const MPI_Offset start = forest->global_first_quadrant[forest->mpirank] * (MPI_Offset)sizeof(int64_t);
  MPI_File_open(forest->mpicomm, "tracer.raw", MPI_MODE_CREATE | MPI_MODE_WRONLY, MPI_INFO_NULL, &file);
  MPI_File_write_at_all(file, start, amounts, (int)count, MPI_INT64_T, MPI_STATUS_IGNORE);
  MPI_File_close(&file);
  P4EST_FREE(amounts);
}

int main(int argc, char** argv) {
  MPI_Init(&argc, &argv);
  sc_init(MPI_COMM_WORLD, 0, 0, NULL, SC_LP_ERROR);
  p4est_init(NULL, SC_LP_ERROR);
  finest = argc > 1 ? atoi(argv[1]) : 5;
  p8est_connectivity_t* cube = p8est_connectivity_new_unitcube();
  p8est_t* forest = p8est_new_ext(MPI_COMM_WORLD, cube, 0, finest, 1, sizeof(Leaf), fill, NULL);
  adapt(forest);
  vdi_catalyst* vdi = NULL;
  int code = 0;
  if (argc > 2) code = vdi_catalyst_initialize_json(MPI_Comm_c2f(MPI_COMM_WORLD), argv[2], &vdi);
  for (int step = 1; step <= STEPS; ++step) {
    if (step % ADAPT == 0) adapt(forest);
    advance(forest);
    if (vdi != NULL && code == 0 && vdi_catalyst_wants(vdi, step, step * time_step)) {
      code = draw(vdi, forest, step);
    }
  }
  if (vdi != NULL) vdi_catalyst_finalize(vdi);
  write_result(forest);
  p8est_destroy(forest);
  p8est_connectivity_destroy(cube);
  MPI_Finalize();
  return code == 0 ? 0 : 3;
}
