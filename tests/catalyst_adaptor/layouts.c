/* A simulation whose field lies in memory as real codes' fields do. Arguments: a JSON text or the name of a
 * script, the cells along each axis, the layouts' names, which are the arrays' names too, separated by
 * commas, and the number of steps. Each rank has a part, which MPI_Dims_create determines. All
 * bytes that belong to no value are NaN. Odd ranks lack the array "partial", and have one of
 * another name instead of "elsewhere". If the first name begins with "star_mirror" or
 * "star_periodic", blocks have a ghost layer on all sides, also beyond the domain. Only the layers
 * straight beyond the domain's faces have values. Those between blocks, and those at edges and
 * corners, which PETSc's DMDA leaves unset with a star stencil, hold 1e30 if the name ends in
 * "_huge", 0 if it ends in "_zero", and otherwise NaN. The process takes the same memory for each
 * layout, which shows how much the adaptor takes. It prints the bytes of the field. Exit status 0 if
 * all went well. */
#include <math.h>
#include <mpi.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "catalyst_adaptor/vdi_catalyst.h"
#include "tests/catalyst_adaptor/expect.h"

enum { PAD = 5, MOST = 16 };

/* One array: cell (x, y, z) lies at first + x * strides[0] + ... */
typedef struct {
  const char* name;
  int type;
  int components;
  vdi_catalyst_strides strides;
  char* first;
  double offset[3];
  int is_partial; /* odd ranks lack it */
} array;

static char* pool = NULL;
static size_t used = 0;
static size_t capacity = 0;

static char* take(int64_t bytes) {
  char* memory = pool + used;
  used += (size_t)(bytes + 63) / 64 * 64;
  if (used > capacity) abort();
  return memory;
}

/* `cells`: of the rank's block, ghosts included. */
static array lay(const char* name, const int32_t* cells) {
  array a = {name, VDI_CATALYST_F32, 1, {{0, 0, 0}, 0}, NULL, {0.0, 0.0, 0.0}, 0};
  const int64_t nx = cells[0];
  const int64_t ny = cells[1];
  const int64_t nz = cells[2];
  int64_t unit = sizeof(float);
  if (strcmp(name, "dof2") == 0) unit = 2 * sizeof(float); /* the second of two unknowns, as of a DMDA */
  if (strcmp(name, "complex") == 0 || strcmp(name, "pair") == 0) {
    a.type = VDI_CATALYST_F64;
    a.components = 2;
    a.strides.component_stride = sizeof(double);
    unit = 2 * sizeof(double);
  }
  if (strcmp(name, "angle") == 0) a.type = VDI_CATALYST_F64, unit = sizeof(double);
  if (strcmp(name, "integers") == 0) a.type = VDI_CATALYST_I64, unit = sizeof(int64_t);
  if (strcmp(name, "integers_as_f64") == 0) a.type = VDI_CATALYST_F64, unit = sizeof(double);
  if (strcmp(name, "staggered") == 0) a.offset[0] = -0.5;
  if (strcmp(name, "staggered_thrice") == 0) a.offset[0] = -0.5, a.offset[1] = 0.5, a.offset[2] = -0.25;
  a.is_partial = strcmp(name, "partial") == 0;
  const int64_t row = strcmp(name, "padded") == 0 ? nx + PAD : nx; /* the leading extent of a Fortran array */
  if (strcmp(name, "z_fastest") == 0) {                            /* as Meep's */
    a.strides.strides[2] = unit;
    a.strides.strides[1] = nz * unit;
    a.strides.strides[0] = ny * nz * unit;
    a.first = take(nx * ny * nz * unit);
  } else {
    a.strides.strides[0] = unit;
    a.strides.strides[1] = row * unit;
    a.strides.strides[2] = row * ny * unit;
    a.first = take(row * ny * nz * unit);
  }
  if (strcmp(name, "dof2") == 0) a.first += sizeof(float);
  return a;
}

/* The field, in a domain of unit size, at a time. */
static double field(double x, double y, double z, double t) {
  return sin(9.0 * x + t) * cos(7.0 * y) + 0.5 * sin(8.0 * z - 0.5 * t);
}

static void store(const array* a, const int32_t* at, double value) {
  char* to = a->first;
  for (int axis = 0; axis < 3; ++axis) to += at[axis] * a->strides.strides[axis];
  const float f32 = (float)value;
  const int64_t i64 = (int64_t)(1e12 * value);
  double f64[2] = {value, 0.0};
  if (a->components == 2) f64[0] = 2.0 * cos(value), f64[1] = 2.0 * sin(value);
  if (strcmp(a->name, "angle") == 0) f64[0] = atan2(2.0 * sin(value), 2.0 * cos(value));
  if (strcmp(a->name, "integers_as_f64") == 0) f64[0] = (double)i64;
  if (a->type == VDI_CATALYST_F32) memcpy(to, &f32, sizeof f32);
  if (a->type == VDI_CATALYST_F64) memcpy(to, f64, (size_t)a->components * sizeof(double));
  if (a->type == VDI_CATALYST_I64) memcpy(to, &i64, sizeof i64);
}

/* The values of ghost layers that nobody sets in this layout. */
static double garbage_of(const char* name) {
  if (strstr(name, "_huge") != NULL) return 1e30;
  return strstr(name, "_zero") != NULL ? 0.0 : NAN;
}

/* The index of the cell whose value a cell of the ghost layer beyond the domain has, or `index` itself. */
static int32_t source_of(int32_t index, int n, int is_periodic) {
  if (index >= 0 && index < n) return index;
  if (is_periodic) return (index + n) % n;
  return index < 0 ? -index : 2 * (n - 1) - index;
}

static int set_array(vdi_catalyst* catalyst, const array* a, int rank) {
  const void* data[] = {a->is_partial && rank % 2 == 1 ? NULL : a->first};
  const int cells = VDI_CATALYST_CELLS;
  return (vdi_catalyst_set_array_offset(catalyst, a->name, cells, a->offset) != VDI_CATALYST_OK) +
         (vdi_catalyst_set_array_strided(catalyst, a->name, a->type, cells, a->components, data,
                                         &a->strides) != VDI_CATALYST_OK);
}

static int is_taken(vdi_catalyst* catalyst, const char* name, int association, const double* offset) {
  return vdi_catalyst_set_array_offset(catalyst, name, association, offset) != VDI_CATALYST_BAD_ARGUMENT;
}

static int bad_offsets(vdi_catalyst* catalyst) {
  const double zero[] = {0.0, 0.0, 0.0};
  const double far[] = {0.0, 0.6, 0.0};
  const double none[] = {0.0, NAN, 0.0};
  return is_taken(catalyst, "V", VDI_CATALYST_CELLS, far) +
         is_taken(catalyst, "V", VDI_CATALYST_CELLS, none) + is_taken(catalyst, "V", 7, zero) +
         is_taken(catalyst, "", VDI_CATALYST_CELLS, none) + is_taken(catalyst, "V", VDI_CATALYST_CELLS, NULL);
}

/* This rank's part of a domain of n cells along each axis, with the ghost layer around it. */
typedef struct {
  int n;
  int32_t first[3];
  int32_t cells[3];
  int ghosts;
  int is_periodic;
} part;

static part part_of(int rank, int ranks, int n, const char* layout) {
  part own = {n, {0}, {0}, strncmp(layout, "star_", 5) == 0, strncmp(layout, "star_periodic", 13) == 0};
  int split[3] = {0, 0, 0};
  MPI_Dims_create(ranks, 3, split);
  const int32_t at_rank[3] = {rank % split[0], rank / split[0] % split[1], rank / split[0] / split[1]};
  for (int axis = 0; axis < 3; ++axis) {
    const int32_t begin = at_rank[axis] * n / split[axis];
    own.first[axis] = begin - own.ghosts;
    own.cells[axis] = (at_rank[axis] + 1) * n / split[axis] - begin + 2 * own.ghosts;
  }
  return own;
}

/* The field's value in a cell. Cells of the ghost layer have it only straight beyond the domain's faces. */
static void simulate_cell(const part* own, const array* a, const int32_t* at, double t) {
  double place[3];
  int outside = 0;
  int is_between = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const int32_t index = own->first[axis] + at[axis];
    const int is_ghost = at[axis] < own->ghosts || at[axis] >= own->cells[axis] - own->ghosts;
    outside += is_ghost;
    is_between = is_between || (is_ghost && index >= 0 && index < own->n);
    const int32_t source = source_of(index, own->n, own->is_periodic);
    place[axis] = (source + 0.5 + a->offset[axis]) * (1.0 / own->n);
  }
  const int is_set = outside == 0 || (outside == 1 && !is_between);
  store(a, at, is_set ? field(place[0], place[1], place[2], t) : garbage_of(a->name));
}

static void simulate(const part* own, const array* a, double t) {
  int32_t at[3];
  for (at[2] = 0; at[2] < own->cells[2]; ++at[2]) {
    for (at[1] = 0; at[1] < own->cells[1]; ++at[1]) {
      for (at[0] = 0; at[0] < own->cells[0]; ++at[0]) simulate_cell(own, a, at, t);
    }
  }
}

int main(int argc, char** argv) {
  int rank = 0;
  int ranks = 0;
  begin(&argc, &argv, &rank, &ranks);
  if (argc != 5) MPI_Abort(MPI_COMM_WORLD, 2);
  const part own = part_of(rank, ranks, atoi(argv[2]), argv[3]);
  const int32_t* cells = own.cells;

  array arrays[MOST];
  int count = 0;
  int names = 1;
  for (const char* c = argv[3]; *c != '\0'; ++c) names += *c == ',';
  capacity = (size_t)names *
             (2 * sizeof(double) * (size_t)(cells[0] + PAD) * (size_t)cells[1] * (size_t)cells[2] + 64);
  pool = malloc(capacity);
  if (pool == NULL) MPI_Abort(MPI_COMM_WORLD, 4);
  memset(pool, 0xFF, capacity);
  for (char* name = strtok(argv[3], ","); name != NULL && count < MOST; name = strtok(NULL, ","))
    arrays[count++] = lay(name, cells);
  for (int i = 0; i < count; ++i) {
    if (rank % 2 == 1 && strcmp(arrays[i].name, "elsewhere") == 0) arrays[i].name = "another";
  }

  vdi_catalyst* catalyst = NULL;
  int wrong = initialize_any(argv[1], &catalyst) != VDI_CATALYST_OK;
  const double h = 1.0 / own.n;
  const int ghosts = own.ghosts;
  const vdi_catalyst_block block = {{cells[0], cells[1], cells[2]},
                                    {ghosts, ghosts, ghosts},
                                    {ghosts, ghosts, ghosts},
                                    {own.first[0] * h, own.first[1] * h, own.first[2] * h},
                                    {h, h, h}};
  wrong += vdi_catalyst_set_blocks(catalyst, 1, &block) != VDI_CATALYST_OK;
  for (int i = 0; i < count; ++i) wrong += set_array(catalyst, &arrays[i], rank);
  wrong += bad_offsets(catalyst);

  for (int step = 0; step < atoi(argv[4]); ++step) {
    for (int i = 0; i < count; ++i) simulate(&own, &arrays[i], 0.3 * step);
    wrong += vdi_catalyst_execute(catalyst, step, 0.1 * step) != VDI_CATALYST_OK;
  }
  wrong += vdi_catalyst_finalize(catalyst) != VDI_CATALYST_OK;
  if (rank == 0) printf("%zu\n", (size_t)cells[0] * (size_t)cells[1] * (size_t)cells[2] * sizeof(float));
  free(pool);
  return end(wrong);
}
