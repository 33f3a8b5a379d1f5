/* What a simulation links to make VDIs of its volume, by ParaView's in situ engine and scripts, or by a JSON
 * text and without ParaView: C, no VTK, no MPI header.
 *
 * Life of a run, on every rank of the communicator:
 *
 *     vdi_catalyst_initialize(MPI_Comm_c2f(comm), 1, scripts, &catalyst);
 *     loop {
 *       feed = vdi_catalyst_parameter_f64(catalyst, "feed", 0.037, 0.0, 0.1);     what viewers may change
 *       vdi_catalyst_set_blocks(catalyst, count, blocks);          when the blocks or their pointers change
 *       vdi_catalyst_set_array(catalyst, "V", VDI_CATALYST_F32, VDI_CATALYST_POINTS, data);
 *       if (vdi_catalyst_wants(catalyst, step, time))               or at each step
 *         vdi_catalyst_execute(catalyst, step, time);
 *     }
 *     vdi_catalyst_finalize(catalyst);                              before MPI_Finalize
 *
 * All functions are collective over the communicator. None ends the process: they return VDI_CATALYST_OK or a
 * code below, the same one on all ranks, and rank 0 prints a message to standard error. What repeats is
 * printed in full once; a step that fails is told each time, then in one line, for its files are missing.
 * After an error the next step works again, and blocks and arrays are those of before. Values are
 * used where they are: pointers must stay valid, and their data unchanged, until vdi_catalyst_execute
 * returns. The host holds copies of the layers beside blocks only, and of whole blocks where the scalar
 * types of blocks differ.
 *
 * Scripts are Catalyst scripts of version 2 (paraview.catalyst). They find the blocks, a
 * vtkPartitionedDataSet with one vtkImageData a block, under the name "grid":
 * TrivialProducer(registrationName="grid"). A script runs on all ranks, and what updates a pipeline is
 * collective. Where a rank's script ends or fails before an update of VolumetricDepthImage that the others
 * enter, or comes with another one, the update fails on all and so does the step. Only in ParaView's own
 * collective filters and views the others wait, as in any MPI program.
 *
 * The process stays the simulation's. When a call returns, these are as before it: the handlers of signals,
 * the calling thread's signal mask and floating-point environment (traps, rounding, flags), the locale, the
 * environment variables, the working directory, the umask and the soft limits of resources. Scripts find the
 * variables that they have set again at the next step. While a call lasts, a signal finds the simulation's
 * handler, unless a script sets another one, and SIGPIPE is ignored where it would end the process.
 *
 * What still ends the process, since ParaView, Python or a library does it without asking: a script's
 * os._exit, os.abort or a crash in a module of its; memory that ParaView itself asks for in vain (Debian's
 * VTK aborts); an X server that goes away while a view is drawn (Xlib exits), and a view that is drawn
 * without a display past paraview.simple, by methods of its render window or SMProxy; a crash of a driver.
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
  VDI_CATALYST_BAD_ARGUMENT = 1, /* a null pointer or a finalized handle, a size below 1 or beyond counting,
                                    an unknown type, arrays before blocks, a step that's no int */
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
  VDI_CATALYST_F64 = 7,
  VDI_CATALYST_I64 = 8,
  VDI_CATALYST_U64 = 9
};

/* Where values lie. */
enum { VDI_CATALYST_POINTS = 0, VDI_CATALYST_CELLS = 1 };

/* One block of a uniform lattice. `cells` counts cells per axis, ghost cells included; point arrays have one
 * value more per axis. `origin` is the lower corner of the first cell, ghost or not. Values lie x fastest,
 * then y, then z.
 *
 * Neighbours are blocks of any rank and any spacing. They may share the points of their common face,
 * or end one cell apart (points), or meet at a face (cells). What a block needs of its neighbours'
 * values is exchanged, whether it has ghost layers or not. Its own ghost layers are used beside blocks
 * of equal spacing.
 *
 * Blocks of different spacing may overlap: the finest is shown. Blocks of equal spacing may not, except
 * for ghost layers announced as such. By more than a thousandth of a cell it is an error that names both
 * blocks. */
typedef struct vdi_catalyst_block {
  int32_t cells[3];
  int32_t ghost_lo[3]; /* layers of ghost cells at the lower side of each axis */
  int32_t ghost_hi[3]; /* and at the upper side */
  double origin[3];
  double spacing[3];
} vdi_catalyst_block;

typedef struct vdi_catalyst vdi_catalyst;

/* Loads ParaView, starts the engine on a duplicate of the communicator (its Fortran handle), loads our plugin
 * and adds the scripts, the same on all ranks; they are loaded at the first step. Scripts need not load the
 * plugin: those that ParaView saves work as they are. They find its path in os.environ["VDI_PLUGIN"]: what
 * the environment says or, unless it is set, the plugin of this installation.
 *
 * A script that is missing or isn't Python, and another plugin that's missing where it loads one (LoadPlugin
 * at its top level), are VDI_CATALYST_SCRIPT here. After a failure *catalyst is null, and the other
 * functions, given null, do nothing but return VDI_CATALYST_BAD_ARGUMENT. The process may try again on the
 * same ranks unless ParaView itself didn't start. Once this has succeeded, it can't be called again in the
 * process. */
VDI_CATALYST_API int vdi_catalyst_initialize(int32_t fortran_communicator, int32_t script_count,
                                             const char* const* scripts, vdi_catalyst** catalyst);

/* Instead of vdi_catalyst_initialize: makes what a JSON text asks for, without scripts, ParaView or Python.
 * `json` is the text, or the name of a file with it; the first rank's counts, and it alone reads files.
 * "{\"field\": \"V\", \"every\": 10}" writes vdi_000010.vdi and so on of the array V.
 * docs/vdi-run.schema.json has all fields; `vdi check FILE` finds mistakes before the run.
 *
 * The other functions are the same, but for these: a step may be any number from 0 on, blocks with ghost
 * layers take no more memory than others, and a frame that fails is VDI_CATALYST_SCRIPT. Of a text with a
 * mistake VDI_CATALYST_SCRIPT is returned here, and the place of the mistake is told. So it is where files of
 * another run exist and the text doesn't say what becomes of them. Without a Vulkan device it's
 * VDI_CATALYST_ENGINE. After a failure *catalyst is null. One such run can go on in a process at a time,
 * beside scripts or without them. */
VDI_CATALYST_API int vdi_catalyst_initialize_json(int32_t fortran_communicator, const char* json,
                                                  vdi_catalyst** catalyst);

/* This rank's blocks, none included; forgets all arrays. Blocks with ghost layers take a byte a cell. */
VDI_CATALYST_API int vdi_catalyst_set_blocks(vdi_catalyst* catalyst, int32_t count,
                                             const vdi_catalyst_block* blocks);

/* The values of one named array: data[i] belongs to block i. Calling it again with the same name replaces the
 * pointers. */
VDI_CATALYST_API int vdi_catalyst_set_array(vdi_catalyst* catalyst, const char* name, int32_t type,
                                            int32_t association, const void* const* data);

/* Where the values of one block lie, in bytes: component c of value (x, y, z) at the block's pointer +
 * x * strides[0] + y * strides[1] + z * strides[2] + c * component_stride. So the pointer is to the block's
 * first value, wherever in an allocation that is: layers before it, and what is padded, are never read.
 * Strides may be 0 or negative, and need not be multiples of the scalar's size. */
typedef struct vdi_catalyst_strides {
  int64_t strides[3];
  int64_t component_stride; /* isn't used for one component */
} vdi_catalyst_strides;

/* As vdi_catalyst_set_array, for values that lie otherwise: interleaved with others, padded, z fastest, parts
 * of a larger allocation. strides[i] and data[i] belong to block i. With `components` > 1, from 1 to 16, an
 * array of vectors: VolumetricDepthImage shows their magnitude. For one component of vectors, pass its first
 * value's address and components = 1.
 *
 * Values that lie as vdi_catalyst_set_array takes them, components side by side, are used where they are.
 * Others are copied to memory of ours by each vdi_catalyst_execute that a script wants; it is taken here. */
VDI_CATALYST_API int vdi_catalyst_set_array_strided(vdi_catalyst* catalyst, const char* name, int32_t type,
                                                    int32_t association, int32_t components,
                                                    const void* const* data,
                                                    const vdi_catalyst_strides* strides);

/* Whether a script will do anything at this step: 1 if so or if it can't be told, 0 if not, the same on all
 * ranks. Then the simulation need neither prepare its values nor call vdi_catalyst_execute. It's 1 where a
 * script wasn't loaded yet, as before the first step; where one defines catalyst_execute, which runs at each
 * step; and where the trigger of an extractor is due. Without a script it's 1 where a frame is due by step,
 * time or clock, whether or not the data and the share of wall time will let it be made, and at each step
 * where viewers may steer. 0 for a null or finalized handle and for a step that vdi_catalyst_execute
 * refuses. */
VDI_CATALYST_API int vdi_catalyst_wants(vdi_catalyst* catalyst, int64_t step, double time);

/* Runs the scripts on the blocks as they are now. `step` is the same on all ranks, from 0 to INT32_MAX, since
 * ParaView counts and names files so; others are VDI_CATALYST_BAD_ARGUMENT each time. */
VDI_CATALYST_API int vdi_catalyst_execute(vdi_catalyst* catalyst, int64_t step, double time);

/* A number that viewers may change while the simulation runs, where a script lets them (VDIStream's Steer) or
 * a run without one ("steer" of its stream).
 * The first call declares it: its name, of 1 to 64 letters, digits, "_", "-" and "."; its value until a
 * viewer sets another; its bounds, both included. Each call returns the value in force, the first rank's on
 * all ranks. It changes in vdi_catalyst_execute alone, so all calls between two steps return the same one.
 * Later calls ignore value and bounds.
 *
 * 64 parameters at most. Bounds of the second function lie within 2^53 of 0. The functions return `value` for
 * a null or finalized handle, and where vdi_catalyst_error says what's wrong: a name, bounds that aren't
 * finite, a value out of them, another type than before, or ranks that ask for different ones. */
VDI_CATALYST_API double vdi_catalyst_parameter_f64(vdi_catalyst* catalyst, const char* name, double value,
                                                   double low, double high);
VDI_CATALYST_API int64_t vdi_catalyst_parameter_i64(vdi_catalyst* catalyst, const char* name, int64_t value,
                                                    int64_t low, int64_t high);

/* Ends the scripts and the engine and frees `catalyst`; a second call does nothing but return
 * VDI_CATALYST_BAD_ARGUMENT. So does one after MPI_Finalize, as all other functions then, and says so. */
VDI_CATALYST_API int vdi_catalyst_finalize(vdi_catalyst* catalyst);

/* The text of the last error on this rank; "" if there was none. Valid until the next call. */
VDI_CATALYST_API const char* vdi_catalyst_error(const vdi_catalyst* catalyst);

#ifdef __cplusplus
}
#endif

#endif
