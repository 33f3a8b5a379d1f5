/* What a simulation links to hand its volume to ParaView's in situ engine: C, no VTK, no MPI header.
 *
 * Life of a run, on every rank of the communicator:
 *
 *     vdi_catalyst_initialize(MPI_Comm_c2f(comm), 1, scripts, &catalyst);
 *     loop {
 *       vdi_catalyst_set_blocks(catalyst, count, blocks);          when the blocks or their pointers change
 *       vdi_catalyst_set_array(catalyst, "V", VDI_CATALYST_F32, VDI_CATALYST_POINTS, data);
 *       vdi_catalyst_execute(catalyst, step, time);
 *     }
 *     vdi_catalyst_finalize(catalyst);                              before MPI_Finalize
 *
 * All functions are collective over the communicator. None ends the process: they return VDI_CATALYST_OK or a
 * code below, the same one on all ranks, and rank 0 prints one message to standard error, not again while it
 * repeats; after an error the next step works again. Nothing is copied on the host: pointers must stay valid,
 * and their data unchanged, until vdi_catalyst_execute returns.
 *
 * Scripts are Catalyst scripts of version 2 (paraview.catalyst). They find the blocks, a
 * vtkPartitionedDataSet with one vtkImageData a block, under the name "grid":
 * TrivialProducer(registrationName="grid"). A script runs on all ranks, and what updates a pipeline is
 * collective: where a rank leaves it before an update that the others enter, they wait, as in any MPI
 * program. An exception on one rank after the last update of a step stops the step on all.
 */
#ifndef VDI_CATALYST_H
#define VDI_CATALYST_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#if defined(__GNUC__)
#define VDI_CATALYST_API __attribute__((visibility("default")))
#else
#define VDI_CATALYST_API
#endif

/* Results. */
enum {
  VDI_CATALYST_OK = 0,
  VDI_CATALYST_BAD_ARGUMENT = 1, /* a null pointer, a size below 1, an unknown type, arrays before blocks */
  VDI_CATALYST_ENGINE = 2, /* ParaView can't be loaded or started, or was started before in this process */
  VDI_CATALYST_SCRIPT = 3  /* a script, or a filter or extractor in it, failed; the others went on */
};

/* Scalar types. */
enum {
  VDI_CATALYST_U8 = 0,
  VDI_CATALYST_I8 = 1,
  VDI_CATALYST_U16 = 2,
  VDI_CATALYST_I16 = 3,
  VDI_CATALYST_U32 = 4,
  VDI_CATALYST_I32 = 5,
  VDI_CATALYST_F32 = 6,
  VDI_CATALYST_F64 = 7
};

/* Where values lie. */
enum { VDI_CATALYST_POINTS = 0, VDI_CATALYST_CELLS = 1 };

/* One block of a uniform lattice. `cells` counts cells per axis, ghost cells included; point arrays have one
 * value more per axis. `origin` is the lower corner of the first cell, ghost or not. Values lie x fastest,
 * then y, then z. Neighbours either share the points of their common face, or have ghost layers, or neither
 * (then a layer is exchanged between ranks). */
typedef struct vdi_catalyst_block {
  int32_t cells[3];
  int32_t ghost_lo[3]; /* layers of ghost cells at the lower side of each axis */
  int32_t ghost_hi[3]; /* and at the upper side */
  double origin[3];
  double spacing[3];
} vdi_catalyst_block;

typedef struct vdi_catalyst vdi_catalyst;

/* Loads ParaView, sets the environment variable VDI_PLUGIN to our plugin unless it is set, starts the engine
 * on a duplicate of the communicator (its Fortran handle) and adds the scripts, the same on all ranks; they
 * are loaded at the first step. Once a process. On failure *catalyst is null, and the other functions, given
 * null, do nothing but return VDI_CATALYST_BAD_ARGUMENT. */
VDI_CATALYST_API int vdi_catalyst_initialize(int32_t fortran_communicator, int32_t script_count,
                                             const char* const* scripts, vdi_catalyst** catalyst);

/* This rank's blocks, none included; forgets all arrays. */
VDI_CATALYST_API int vdi_catalyst_set_blocks(vdi_catalyst* catalyst, int32_t count,
                                             const vdi_catalyst_block* blocks);

/* The values of one named array: data[i] belongs to block i. Calling it again with the same name replaces the
 * pointers. */
VDI_CATALYST_API int vdi_catalyst_set_array(vdi_catalyst* catalyst, const char* name, int32_t type,
                                            int32_t association, const void* const* data);

/* Runs the scripts on the blocks as they are now. */
VDI_CATALYST_API int vdi_catalyst_execute(vdi_catalyst* catalyst, int64_t step, double time);

/* Ends the scripts and the engine and frees `catalyst`. */
VDI_CATALYST_API int vdi_catalyst_finalize(vdi_catalyst* catalyst);

/* The text of the last error on this rank; "" if there was none. Valid until the next call. */
VDI_CATALYST_API const char* vdi_catalyst_error(const vdi_catalyst* catalyst);

#ifdef __cplusplus
}
#endif

#endif
