/* The functions through which libvdi_catalyst.so, which a simulation links, calls the engine that it loads:
 * libvdi_catalyst_engine.so for scripts, libvdi_catalyst_json.so for runs without one. */
#ifndef VDI_CATALYST_ENGINE_FUNCTIONS_H
#define VDI_CATALYST_ENGINE_FUNCTIONS_H

#include "catalyst_adaptor/vdi_catalyst.h"

#ifdef __cplusplus
extern "C" {
#endif

/* One entry for each function of vdi_catalyst.h, with the same contract. An engine has the first two or the
 * third. Those get a valid communicator, and a null *catalyst. */
typedef struct vdi_catalyst_functions {
  int (*initialize)(int32_t, int32_t, const char* const*, vdi_catalyst**);
  int (*initialize_pipelines)(int32_t, int32_t, const vdi_catalyst_pipeline*, vdi_catalyst**);
  int (*initialize_json)(int32_t, const char*, vdi_catalyst**);
  int (*set_blocks)(vdi_catalyst*, int32_t, const vdi_catalyst_block*);
  int (*set_array)(vdi_catalyst*, const char*, int32_t, int32_t, const void* const*);
  int (*set_array_strided)(vdi_catalyst*, const char*, int32_t, int32_t, int32_t, const void* const*,
                           const vdi_catalyst_strides*);
  int (*set_array_offset)(vdi_catalyst*, const char*, int32_t, const double*);
  int (*set_particles)(vdi_catalyst*, const char*, const vdi_catalyst_particles*);
  int (*wants)(vdi_catalyst*, int64_t, double);
  int (*execute)(vdi_catalyst*, int64_t, double);
  double (*parameter_f64)(vdi_catalyst*, const char*, double, double, double);
  int64_t (*parameter_i64)(vdi_catalyst*, const char*, int64_t, int64_t, int64_t);
  int (*finalize)(vdi_catalyst*);
  const char* (*error)(const vdi_catalyst*);
} vdi_catalyst_functions;

/* An engine's only symbol. Its name contains the version, so a library of another version lacks it. */
#define VDI_CATALYST_ENGINE_FUNCTIONS vdi_catalyst_engine_functions_6
#define VDI_CATALYST_ENGINE_SYMBOL "vdi_catalyst_engine_functions_6"
VDI_CATALYST_API extern const vdi_catalyst_functions VDI_CATALYST_ENGINE_FUNCTIONS;

#ifdef __cplusplus
}
#endif

#endif
