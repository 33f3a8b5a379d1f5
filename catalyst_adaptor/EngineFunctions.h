/* The functions through which libvdi_catalyst.so, which a simulation links, calls the engine that it loads:
 * libvdi_catalyst_engine.so for scripts, libvdi_catalyst_json.so for runs without one, and
 * libvdi_catalyst_isolated.so for either in processes of their own. */
#ifndef VDI_CATALYST_ENGINE_FUNCTIONS_H
#define VDI_CATALYST_ENGINE_FUNCTIONS_H

#include "catalyst_adaptor/vdi_catalyst.h"

#ifdef __cplusplus
extern "C" {
#endif

/* One entry for each function of vdi_catalyst.h, with the same contract. libvdi_catalyst.so passes only live
 * handles, and makes one call of a handle at a time. `error` also takes null, for this thread's last error of
 * any handle, also of one that is gone: its text is valid until the thread's next call. Of the first five
 * entries, the engine for scripts has the first three, the engine for JSON runs the last two, and the
 * isolated engine the first two and initialize_json. These entries get a valid communicator, and a null
 * *catalyst. In the isolated engine they return VDI_CATALYST_NOT_ISOLATED, on all ranks, for a run that
 * another engine has to carry out in this process.
 *
 * `make_frames_of_pipelines` and `make_frames_of_json` are initialize_pipelines and initialize_json in the
 * processes that make an isolated run's frames. If `goes_on`, earlier processes have made a part of the run,
 * whose files stay. `set_clock`, which may be null, sets the time, in seconds since the run's start, that
 * counts for the next step. `log_left_out`, which may be null, notes in the log, on the first rank, that the
 * simulation didn't hand over a step, because two earlier frames were still to be made. Neither is
 * collective. `refuse` and `end_run`, which only the engine for scripts has, are the functions below.
 * `wanted_steps`, which only the engine for scripts has, sets wanted[i] to what `wants` returns
 * for the step first + i at any time, for i from 0 to count - 1, in one reduction. */
typedef struct vdi_catalyst_functions {
  int (*initialize)(int32_t, int32_t, const char* const*, vdi_catalyst**);
  int (*initialize_pipelines)(int32_t, int32_t, const vdi_catalyst_pipeline*, vdi_catalyst**);
  int (*make_frames_of_pipelines)(int32_t, int32_t, const vdi_catalyst_pipeline*, vdi_catalyst**);
  int (*initialize_json)(int32_t, const char*, vdi_catalyst**);
  int (*make_frames_of_json)(int32_t, const char*, int goes_on, vdi_catalyst**);
  int (*set_blocks)(vdi_catalyst*, int32_t, const vdi_catalyst_block*);
  int (*set_array)(vdi_catalyst*, const char*, int32_t, int32_t, const void* const*);
  int (*set_array_strided)(vdi_catalyst*, const char*, int32_t, int32_t, int32_t, const void* const*,
                           const vdi_catalyst_strides*);
  int (*set_array_offset)(vdi_catalyst*, const char*, int32_t, const double*);
  int (*set_array_missing)(vdi_catalyst*, const char*, int32_t, int32_t, const double*);
  int (*set_particles)(vdi_catalyst*, const char*, const vdi_catalyst_particles*);
  int (*set_stream)(vdi_catalyst*, void*);
  int (*wants)(vdi_catalyst*, int64_t, double);
  void (*wanted_steps)(vdi_catalyst*, int64_t first, int32_t count, uint8_t* wanted);
  int (*execute)(vdi_catalyst*, int64_t, double);
  double (*parameter_f64)(vdi_catalyst*, const char*, double, double, double);
  int64_t (*parameter_i64)(vdi_catalyst*, const char*, int64_t, int64_t, int64_t);
  int (*refuse)(vdi_catalyst*, const char*);
  int (*finalize)(vdi_catalyst*);
  int (*end_run)(vdi_catalyst*);
  const char* (*error)(const vdi_catalyst*);
  void (*set_clock)(vdi_catalyst*, double);
  void (*log_left_out)(vdi_catalyst*, int64_t, double);
} vdi_catalyst_functions;

/* An engine's only symbol. Its name contains the version, so a library of another version lacks it. */
#define VDI_CATALYST_ENGINE_FUNCTIONS vdi_catalyst_engine_functions_12
#define VDI_CATALYST_ENGINE_SYMBOL "vdi_catalyst_engine_functions_12"
enum { VDI_CATALYST_NOT_ISOLATED = -1 };
VDI_CATALYST_API extern const vdi_catalyst_functions VDI_CATALYST_ENGINE_FUNCTIONS;

/* libvdi_catalyst.so exports these for the program in which the isolated engine makes frames
 * (isolated/process). They call the engine's entries of the same names. */
VDI_CATALYST_API int vdi_catalyst_make_frames_of_pipelines(int32_t fortran_communicator, int32_t script_count,
                                                           const vdi_catalyst_pipeline* scripts,
                                                           vdi_catalyst** catalyst);
VDI_CATALYST_API int vdi_catalyst_make_frames_of_json(int32_t fortran_communicator, const char* json,
                                                      int goes_on, vdi_catalyst** catalyst);
VDI_CATALYST_API void vdi_catalyst_wanted_steps(vdi_catalyst* catalyst, int64_t first, int32_t count,
                                                uint8_t* wanted);
VDI_CATALYST_API void vdi_catalyst_set_clock(vdi_catalyst* catalyst, double seconds);
VDI_CATALYST_API void vdi_catalyst_log_left_out(vdi_catalyst* catalyst, int64_t step, double time);

/* And these for the module pv_vdi.catalyst. A rank that can't make a call of blocks, arrays or particles that
 * the others make calls vdi_catalyst_refuse in its place: all ranks get VDI_CATALYST_BAD_ARGUMENT and the
 * reason. vdi_catalyst_end_run is vdi_catalyst_finalize, except that ParaView stays for another run of
 * scripts on the same ranks. */
VDI_CATALYST_API int vdi_catalyst_refuse(vdi_catalyst* catalyst, const char* reason);
VDI_CATALYST_API int vdi_catalyst_end_run(vdi_catalyst* catalyst);

#ifdef __cplusplus
}
#endif

#endif
