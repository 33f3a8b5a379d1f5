#include "catalyst_adaptor/EngineFunctions.h"

const vdi_catalyst_functions VDI_CATALYST_ENGINE_FUNCTIONS = {
    vdi_catalyst_initialize,
    vdi_catalyst_initialize_pipelines,
    nullptr,
    nullptr,
    vdi_catalyst_set_blocks,
    vdi_catalyst_set_array,
    vdi_catalyst_set_array_strided,
    vdi_catalyst_set_array_offset,
    vdi_catalyst_set_particles,
    vdi_catalyst_wants,
    vdi_catalyst_execute,
    vdi_catalyst_parameter_f64,
    vdi_catalyst_parameter_i64,
    vdi_catalyst_finalize,
    vdi_catalyst_error,
    nullptr,
};
