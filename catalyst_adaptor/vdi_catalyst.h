/* The interface that a simulation calls to make VDIs of its volume, by ParaView's in situ engine and scripts,
 * or by a JSON text without ParaView. It is C and needs neither VTK nor an MPI header.
 *
 * The calls of a run, on every rank of the communicator:
 *
 *     vdi_catalyst_initialize(MPI_Comm_c2f(comm), 1, scripts, &catalyst);
 *     loop {
 *       feed = vdi_catalyst_parameter_f64(catalyst, "feed", 0.037, 0.0, 0.1);     viewers may change it
 *       vdi_catalyst_set_blocks(catalyst, count, blocks);          when the blocks or their pointers change
 *       vdi_catalyst_set_array(catalyst, "V", VDI_CATALYST_F32, VDI_CATALYST_POINTS, data);
 *       vdi_catalyst_set_particles(catalyst, "density", &particles);     makes an array of cells of them
 *       if (vdi_catalyst_wants(catalyst, step, time))               or at each step
 *         vdi_catalyst_execute(catalyst, step, time);
 *     }
 *     vdi_catalyst_finalize(catalyst);                              before MPI_Finalize
 *
 * All functions but vdi_catalyst_error and vdi_catalyst_set_stream are collective over the communicator: each
 * rank makes all calls in the same order, even a rank without blocks (count 0, null pointers).
 *
 * The calls of a handle come one after another, from any thread. A call that begins before another one of the
 * same handle has returned, in another thread, a signal's handler or a script, does nothing and returns
 * VDI_CATALYST_BUSY, even vdi_catalyst_finalize. Such a call hasn't met those of other ranks: make it again
 * later. The process prints this once. Two handles, of scripts and of a JSON text, may be used by two threads
 * at once if MPI provides MPI_THREAD_MULTIPLE.
 *
 * No call ends the process on purpose; the exceptions are below. The functions return
 * VDI_CATALYST_OK or a code below, the same one on all ranks, and rank 0 prints a message to standard error.
 * Rank 0 prints a repeated message in full only once. A step that fails again gets one line, because its
 * files are missing. After an error, the next step works again, with the blocks and arrays from before.
 *
 * Calls copy structures, names, strides and arrays of pointers: these may go when the call returns. Calls
 * borrow the values of arrays, and particles' positions, weights and lengths: vdi_catalyst_execute reads them
 * where they are, so they must stay valid and unchanged until it returns. The host holds copies of only the
 * layers beside blocks, and of whole blocks if the blocks' scalar types differ. Arrays made from particles
 * take 4 bytes per cell.
 *
 * Pointers to values and particles may lead to memory of CUDA: cudaMalloc's, managed, of pools and mapped,
 * also block by block beside pointers to the host's. vdi_catalyst_execute copies what a frame needs to the
 * host, once in a step, and nothing at other steps; memory for the copies stays from step to step. It first
 * waits for the work that was queued on the stream of vdi_catalyst_set_stream. CUDA is asked only if the
 * process has loaded libcuda.so.1. Memory of a HIP or Level Zero device is refused with
 * VDI_CATALYST_BAD_ARGUMENT, as are values that reach beyond their allocation. If memory can't be read any
 * more at a step, on the host or on a GPU, or CUDA fails, the step fails with VDI_CATALYST_SCRIPT.
 *
 * Scripts are Catalyst scripts: Python files for ParaView's module paraview.catalyst. (Catalyst 2, Kitware's
 * C interface, is another way to hand over data: docs/catalyst-guide.md.) They find the blocks, a
 * vtkPartitionedDataSet with one vtkImageData per block, under the name "grid":
 * TrivialProducer(registrationName="grid"). A script runs on all ranks, and updates of a pipeline are
 * collective. If one rank's script ends or fails before an update of VolumetricDepthImage that the others
 * enter, or enters a different one, the update fails on all ranks, and so does the step. Only in ParaView's
 * own collective filters and views do the others wait, as in any MPI program.
 *
 * The process stays the simulation's. When a call returns, the following are as they were before
 * it: the handlers of signals, the calling thread's signal mask and floating-point environment
 * (traps, rounding, flags), the locale, the environment variables, the working directory, the umask
 * and the soft limits of resources. At the next step, scripts find the variables again that they
 * have set. During a call, a signal finds the simulation's handler, unless a script sets another
 * one. SIGPIPE and SIGXFSZ, which a file beyond the size limit raises,
 * are ignored if they would end the process.
 *
 * The following events still end the process, because ParaView, Python or a library leaves no
 * choice: a script that calls os._exit or os.abort, or crashes in one of its modules; an allocation
 * that fails in ParaView, or in a filter or writer that ParaView calls (Debian's VTK aborts); an X
 * server that goes away while a view is drawn (Xlib exits); a view that is drawn without a display
 * by methods of its render window or SMProxy instead of paraview.simple; a crash of a driver.
 *
 * None of these events ends the process if frames are made in processes of their own: by "isolation" in a
 * JSON text, or by VDI_ISOLATION=process in the first rank's environment. Then vdi_catalyst_execute copies
 * the values of a wanted step, which the simulation may change when the call returns, and the frame is made
 * meanwhile. The code of a frame that fails is returned by a later call, the same one on all ranks. If a
 * process dies, all calls return VDI_CATALYST_ENGINE from then on, or processes start again
 * (docs/catalyst-guide.md). */
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
  VDI_CATALYST_BAD_ARGUMENT = 1, /* a null pointer or a finalized handle, a size below 1 or too large to
                                  * count, an unknown type, arrays or a step before blocks, an offset beyond
                                  * half a cell, a step below 0 or (with scripts) above INT32_MAX, steps
                                  * that differ between ranks, a time that isn't finite */
  VDI_CATALYST_ENGINE = 2, /* ParaView can't be loaded or started, or was started before in this process; a
                            * JSON run finds no Vulkan device, or another JSON run goes on; the processes
                            * that make the frames can't be started, or have died */
  VDI_CATALYST_SCRIPT = 3, /* a script, or a filter or extractor in it, failed; the others went on. JSON: the
                            * text or a file that it names is wrong, or a frame couldn't be made or written */
  VDI_CATALYST_BUSY = 4    /* another call of this handle hasn't returned yet. Only this rank knows of it */
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

/* Associations of values. */
enum { VDI_CATALYST_POINTS = 0, VDI_CATALYST_CELLS = 1 };

/* One block of a uniform lattice. `cells` counts cells per axis, ghost cells included, and is at least 1;
 * point arrays have one value more per axis. `origin` is the lower corner of the first cell, ghost or not,
 * and so the position of the first point, in world units. `spacing` is the size of a cell in world units,
 * above 0; for a VDI, it lies in 1e-30 .. 1e30, and the block within 1e12 spacings of 0. Values lie x
 * fastest, then y, then z.
 *
 * Neighbours are blocks of any rank and any spacing. They may share the points of their common face, or end
 * one cell apart (points), or meet at a face (cells). Ranks exchange the values that a block needs of its
 * neighbours, whether it has ghost layers or not. A neighbour's values replace ghost values wherever it has
 * cells of its own. Ghost layers therefore count beyond the domain only, as on periodic or mirrored
 * sides. There, values straight beside a block are read. Those at edges and corners (beyond the
 * block along two or three axes) may be unset: they are never shown, and the values there are
 * continued from the layers' faces. No ghost value counts in an automatic range of colours.
 *
 * Blocks of different spacing may overlap: the finest is shown. Blocks of equal spacing must not overlap,
 * except by ghost layers announced as such. An overlap by more than a thousandth of a cell is an error that
 * names both blocks. */
typedef struct vdi_catalyst_block {
  int32_t cells[3];
  int32_t ghost_lo[3]; /* layers of ghost cells at the lower side of each axis */
  int32_t ghost_hi[3]; /* and at the upper side */
  double origin[3];
  double spacing[3];
} vdi_catalyst_block;

typedef struct vdi_catalyst vdi_catalyst;

/* Loads ParaView, starts the engine on a duplicate of the communicator (its Fortran handle), loads
 * our plugin and adds the scripts. These are the same on all ranks, and are loaded at the first
 * step. Scripts need not load the plugin: those that ParaView saves work as they are. They find its
 * path in os.environ["VDI_PLUGIN"]: the value of that environment variable or, unless it is set,
 * the plugin of this installation.
 *
 * Without scripts (count 0) it succeeds, and the first rank prints that no step will make anything.
 *
 * This returns VDI_CATALYST_SCRIPT if a script is missing or isn't Python, and if a script loads another
 * plugin (LoadPlugin at its top level) that is missing. After a failure *catalyst is null, and the other
 * functions, given null, only return VDI_CATALYST_BAD_ARGUMENT. The process may try again on the same ranks
 * unless ParaView itself didn't start. After a success, the process can't call it again. */
VDI_CATALYST_API int vdi_catalyst_initialize(int32_t fortran_communicator, int32_t script_count,
                                             const char* const* scripts, vdi_catalyst** catalyst);

/* A script with arguments, which paraview.catalyst.get_args() returns in it. */
typedef struct vdi_catalyst_pipeline {
  const char* file;
  int32_t argument_count;
  const char* const* arguments;
} vdi_catalyst_pipeline;

/* As vdi_catalyst_initialize, for scripts with arguments. */
VDI_CATALYST_API int vdi_catalyst_initialize_pipelines(int32_t fortran_communicator, int32_t script_count,
                                                       const vdi_catalyst_pipeline* scripts,
                                                       vdi_catalyst** catalyst);

/* Replaces vdi_catalyst_initialize in runs without scripts, ParaView or Python, which a JSON text describes.
 * `json` is the text, or the name of a file with it. The first rank's text counts, and that rank alone reads
 * files. "{\"field\": \"V\", \"every\": 10}" writes vdi_000000.vdi, vdi_000010.vdi and so on from the array
 * V. docs/vdi-run.schema.json has all fields; `vdi check FILE` finds mistakes before the run.
 *
 * The other functions are the same, with these differences: a step may be any number from 0 on, blocks with
 * ghost layers take no more memory than others, and a frame that fails is VDI_CATALYST_SCRIPT. For a mistake
 * in the text, this function returns VDI_CATALYST_SCRIPT and reports its place. It does the same if files of
 * another run exist and the text doesn't say how to treat them. Without a Vulkan device it returns
 * VDI_CATALYST_ENGINE. After a failure *catalyst is null. A process can have one such run at a time, with or
 * without scripts beside it. */
VDI_CATALYST_API int vdi_catalyst_initialize_json(int32_t fortran_communicator, const char* json,
                                                  vdi_catalyst** catalyst);

/* Sets this rank's blocks, possibly none, and forgets all arrays. Blocks with ghost layers take a
 * byte per cell. */
VDI_CATALYST_API int vdi_catalyst_set_blocks(vdi_catalyst* catalyst, int32_t count,
                                             const vdi_catalyst_block* blocks);

/* Sets the values of one named array: data[i] belongs to block i, and is null if the block lacks the array.
 * Pictures of the array leave out such a block. An array that all blocks of all ranks lack is an error once
 * it is to be shown. Another call with the same name replaces the pointers. */
VDI_CATALYST_API int vdi_catalyst_set_array(vdi_catalyst* catalyst, const char* name, int32_t type,
                                            int32_t association, const void* const* data);

/* The layout of the values of one block, in bytes: component c of value (x, y, z) lies at the block's pointer
 * + x * strides[0] + y * strides[1] + z * strides[2] + c * component_stride. So the pointer refers
 * to the block's first value, wherever in an allocation that lies. Layers before it, and padding,
 * are never read. Strides may be 0 or negative, and need not be multiples of the scalar's size. */
typedef struct vdi_catalyst_strides {
  int64_t strides[3];
  int64_t component_stride; /* unused for one component */
} vdi_catalyst_strides;

/* As vdi_catalyst_set_array, for values in another layout: interleaved with others, padded, z fastest, or
 * parts of a larger allocation. strides[i] and data[i] belong to block i. `components` is from 1 to
 * 16. With more than one, the array is one of vectors. A run shows their magnitude, a component,
 * the phase of two components, the real and the imaginary part, or two or four together as colours
 * and opacities. For only one component, pass its first value's address and components = 1.
 *
 * Values are read where they are, in any layout: a run without scripts never copies them on the host, nor
 * does VolumetricDepthImage in a script. If a filter of ParaView's own asks for a pointer to values
 * in a layout other than that of vdi_catalyst_set_array, it gets a copy, which is made at that
 * moment. */
VDI_CATALYST_API int vdi_catalyst_set_array_strided(vdi_catalyst* catalyst, const char* name, int32_t type,
                                                    int32_t association, int32_t components,
                                                    const void* const* data,
                                                    const vdi_catalyst_strides* strides);

/* Shifts the values of an array from the points or the centres of cells by offset[axis] cells along each
 * axis, from -0.5 to 0.5, as on staggered grids. The offset is the same on all ranks. For example, values of
 * cells with the offset {-0.5, 0, 0} lie on the lower x faces of their cells. Blocks stay where they are;
 * beyond a block's values, its neighbours' values count; at the domain's end, the last values
 * continue. An offset belongs to an association and a name, and may come before its array;
 * vdi_catalyst_set_blocks forgets it. In scripts, VolumetricDepthImage follows it, but ParaView's
 * own filters don't know it. */
VDI_CATALYST_API int vdi_catalyst_set_array_offset(vdi_catalyst* catalyst, const char* name,
                                                   int32_t association, const double offset[3]);

/* Makes numbers stand for missing values of an array, as the fill values of netCDF files do: a value that
 * equals one of them, once that is rounded to the array's type, is transparent, with all that would be
 * interpolated with it, and counts in no range and no condition. A vector is missing where a shown component
 * is. `count` is 0 to 64; each call replaces the numbers before, and they are equal on all ranks. They belong
 * to an association and a name, and may come before the array; vdi_catalyst_set_blocks forgets them. Values
 * of 8 and 16 bits then take 4 bytes each on the device, and integers of 32 bits get doubles' range. NaN is
 * missing in any case. In scripts, VolumetricDepthImage leaves missing values out; ParaView's own filters
 * find NaN in arrays of floating-point numbers, and integers as they are. */
VDI_CATALYST_API int vdi_catalyst_set_array_missing(vdi_catalyst* catalyst, const char* name,
                                                    int32_t association, int32_t count, const double* values);

/* The value of a cell that particles are deposited on. */
enum {
  VDI_CATALYST_SUM = 0,    /* the weight in the cell */
  VDI_CATALYST_DENSITY = 1 /* the weight in the cell, divided by its volume */
};

/* A rank's particles, possibly none. Particle i has its coordinate along an axis at positions[axis] +
 * i * position_stride bytes, its weight at weights + i * weight_stride, and its smoothing length h at
 * lengths + i * length_stride. Strides may be negative, and need not be multiples of the number's size.
 * A weight_stride or length_stride of 0 means that all particles have the first number. Types are
 * VDI_CATALYST_F32 or VDI_CATALYST_F64. Interleaved doubles x, y, z have positions {p, p + 1, p + 2} and
 * stride 24. */
typedef struct vdi_catalyst_particles {
  int64_t count;
  int32_t kind; /* VDI_CATALYST_SUM or VDI_CATALYST_DENSITY, the same on all ranks */
  int32_t position_type;
  const void* positions[3];
  int64_t position_stride;
  const void* weights; /* null: each particle weighs 1 */
  int64_t weight_stride;
  const void* lengths; /* null: cloud in cell for all particles */
  int64_t length_stride;
  int32_t weight_type;
  int32_t length_type;
  int32_t periodic[3]; /* per axis: not 0 if the blocks of all ranks are one period of it; the same on all */
} vdi_catalyst_particles;

/* Makes an array of cells from particles, of type VDI_CATALYST_F32. Scripts, runs without one and their
 * conditions find it under `name`, which is the same on all ranks, as they find other arrays. Each
 * vdi_catalyst_execute that needs the array makes it anew, from the particles as they are then. So pointers
 * must stay valid until that call returns, but no call is needed at each step.
 * vdi_catalyst_set_array for cells of the same name replaces the particles, just as particles
 * replace such an array. vdi_catalyst_set_blocks forgets them.
 *
 * Particles may lie in blocks of any rank. The spacing of the block that owns the position, which is the
 * finest one there, decides how far a particle's weight spreads:
 *
 * - Without a smoothing length, cloud in cell applies: the weight fills a box of the spacing's size around
 *   the position. Each cell gets the share of the box that lies in it.
 * - With a smoothing length h, the cubic spline M4 with support 2 h in three dimensions (Monaghan 1992)
 *   applies, at the centres of cells. If h is below 0.75 of the spacing's largest component, cloud in cell
 *   applies: at that length both spread equally wide, and a shorter kernel could miss all centres.
 *
 * No weight is lost: the shares of each particle are divided by their sum over all cells that blocks own.
 * Near a face of the domain, the weight that would lie beyond it therefore goes to the cells on
 * this side. Ghost cells get the values of their owners. Cells that finer blocks hide get the mean
 * of the cells that hide them. The result is the same for any distribution of blocks and particles
 * over ranks, to within rounding to f32.
 *
 * Along a periodic axis, positions are wrapped into the period, which is the extent of all ranks' blocks
 * without ghost layers, and weight that would lie beyond a face enters at the opposite one. Ghost cells there
 * get the values of the cells that they repeat.
 *
 * Particles outside all blocks (blocks own their lower faces, not their upper ones), and those whose position
 * or weight isn't finite, are left out. Those whose h is NaN, infinite, 0 or negative are deposited by cloud
 * in cell. Rank 0 prints a line with their numbers the first time that an array has such particles. Values
 * beyond the range of f32 make vdi_catalyst_execute fail with VDI_CATALYST_SCRIPT.
 *
 * This returns VDI_CATALYST_BAD_ARGUMENT for a negative count, null positions, unknown types, strides that
 * lead beyond the address space, and names or kinds that differ between ranks. With scripts, the first
 * deposit opens a Vulkan device of its own; without one, vdi_catalyst_execute returns VDI_CATALYST_SCRIPT. */
VDI_CATALYST_API int vdi_catalyst_set_particles(vdi_catalyst* catalyst, const char* name,
                                                const vdi_catalyst_particles* particles);

/* The CUDA stream (a cudaStream_t or CUstream) on which this rank's values are written: a step that reads
 * values first waits for the work that was queued on it, for VDI_CUDA_PATIENCE seconds at most (300 by
 * default), then the step fails. When vdi_catalyst_execute returns, the values may change, in any stream.
 * Null, as at first: the default stream of each context that has values, which waits for the blocking
 * streams; and values on the host are read without a wait. The stream must live until another is set or the
 * run ends. Not collective: it returns VDI_CATALYST_BAD_ARGUMENT on this rank if the process hasn't loaded
 * CUDA. */
VDI_CATALYST_API int vdi_catalyst_set_stream(vdi_catalyst* catalyst, void* stream);

/* Returns whether a script will do anything at this step: 1 if it will or if that is unknown, 0 if not; the
 * same on all ranks. After 0, the simulation need neither prepare its values nor call vdi_catalyst_execute.
 * With scripts the result is 1
 *   - if a script isn't loaded yet, as before the first step;
 *   - if a script defines catalyst_execute, which runs at each step;
 *   - if the trigger of an extractor is due;
 *   - where scripts run in a process of their own, also while that process is at work and hasn't answered.
 * In a run without a script it is 1
 *   - if a frame is due by step, time or clock, whether or not "when", "max_share" and "max_host_mib" will
 *     permit it;
 *   - at each step if viewers may steer.
 * It is 0 for a null or finalized handle and for a step that vdi_catalyst_execute refuses, and while another
 * call of the handle is under way. */
VDI_CATALYST_API int vdi_catalyst_wants(vdi_catalyst* catalyst, int64_t step, double time);

/* Makes what the scripts or the JSON text ask for at this step, of the blocks, arrays and particles as they
 * are now. `step` is the same on all ranks, and at least 0. With scripts it is at most INT32_MAX, because
 * ParaView counts and names files by such numbers. `time` is the simulation's, in any unit. Returns
 * VDI_CATALYST_BAD_ARGUMENT for other steps, times that aren't finite, and before vdi_catalyst_set_blocks,
 * VDI_CATALYST_SCRIPT if a script or a frame fails, and VDI_CATALYST_ENGINE if ParaView can't have the blocks
 * or the frames' processes have died. */
VDI_CATALYST_API int vdi_catalyst_execute(vdi_catalyst* catalyst, int64_t step, double time);

/* A number that viewers may change while the simulation runs, if a script lets them (VDIStream's Steer) or a
 * run without one does ("steer" of its stream). The first call declares its name, of 1 to 64 letters, digits,
 * "_", "-" and "."; its value until a viewer sets another; and its bounds, both included. Each call returns
 * the value in force, the first rank's on all ranks. Only vdi_catalyst_execute changes it, so all calls
 * between two steps return the same value. Later calls ignore value and bounds.
 *
 * A run has 64 parameters at most. Bounds of the second function lie within 2^53 of 0. The functions return
 * `value` for a null or finalized handle, and after an error (VDI_CATALYST_BUSY, too), which
 * vdi_catalyst_error describes: an invalid name, bounds that aren't finite, a value outside them, another
 * type than before, or ranks that ask for different parameters. After a success, vdi_catalyst_error returns
 * "". */
VDI_CATALYST_API double vdi_catalyst_parameter_f64(vdi_catalyst* catalyst, const char* name, double value,
                                                   double low, double high);
VDI_CATALYST_API int64_t vdi_catalyst_parameter_i64(vdi_catalyst* catalyst, const char* name, int64_t value,
                                                    int64_t low, int64_t high);

/* Ends the scripts and the engine, and frees `catalyst`. A second call only returns
 * VDI_CATALYST_BAD_ARGUMENT. After MPI_Finalize, all functions that return a code return this one, and
 * vdi_catalyst_finalize prints a message. In a process that the simulation forks, vdi_catalyst_finalize does
 * nothing and returns 0, and the other functions with a code return VDI_CATALYST_BAD_ARGUMENT: a run belongs
 * to the process that began it. */
VDI_CATALYST_API int vdi_catalyst_finalize(vdi_catalyst* catalyst);

/* The text of the handle's last error on this rank; "" if there was none, if a parameter was asked for since
 * then, and for a finalized handle. After a call of this thread that returned VDI_CATALYST_BUSY, and while
 * another call is under way, it says so. For null it is the reason why this thread's last initialising or
 * finalizing failed; "" if it didn't. Not collective. The library owns the text, which is valid until this
 * thread's next call. */
VDI_CATALYST_API const char* vdi_catalyst_error(const vdi_catalyst* catalyst);

#ifdef __cplusplus
}
#endif

#endif
