// The entries of an engine's table (EngineFunctions.h) that are the same in all engines.
#pragma once

#include <cstdint>
#include <optional>

#include "catalyst_adaptor/EngineFunctions.h"
#include "catalyst_adaptor/FieldCalls.h"
#include "catalyst_adaptor/Parameters.h"
#include "catalyst_adaptor/vdi_catalyst.h"

namespace vdi::catalyst {

struct NoLock {};

/// `parametersOf` gives a handle's parameters, and each change of fields holds a `Lock`. `Handle` is the
/// engine's vdi_catalyst, a FieldCalls.
template <typename Handle, Parameters& (*parametersOf)(Handle&), typename Lock = NoLock>
struct FieldEntries {
  static int setArray(Handle* handle, const char* name, std::int32_t type, std::int32_t association,
                      const void* const* data) {
    [[maybe_unused]] const Lock lock;
    return catalyst::setArray(*handle, {name, type, association, 1}, data);
  }
  static int setArrayStrided(Handle* handle, const char* name, std::int32_t type, std::int32_t association,
                             std::int32_t components, const void* const* data,
                             const vdi_catalyst_strides* strides) {
    [[maybe_unused]] const Lock lock;
    return catalyst::setArrayStrided(*handle, {name, type, association, components}, data, strides);
  }
  static int setArrayOffset(Handle* handle, const char* name, std::int32_t association,
                            const double* offset) {
    [[maybe_unused]] const Lock lock;
    return catalyst::setArrayOffset(*handle, name, association, offset);
  }
  static int setArrayMissing(Handle* handle, const char* name, std::int32_t association, std::int32_t count,
                             const double* values) {
    [[maybe_unused]] const Lock lock;
    return catalyst::setArrayMissing(*handle, name, association, count, values);
  }
  static int setParticles(Handle* handle, const char* name, const vdi_catalyst_particles* particles) {
    [[maybe_unused]] const Lock lock;
    return catalyst::setParticles(*handle, name, particles);
  }
  static int setStream(Handle* handle, void* stream) {
    [[maybe_unused]] const Lock lock;
    return catalyst::setStream(*handle, stream);
  }
  static double parameterF64(Handle* handle, const char* name, double value, double low, double high) {
    return inForce(*handle, parametersOf(*handle), name, value, low, high);
  }
  static std::int64_t parameterI64(Handle* handle, const char* name, std::int64_t value, std::int64_t low,
                                   std::int64_t high) {
    return inForce(*handle, parametersOf(*handle), name, value, low, high);
  }
  static int refuse(Handle* handle, const char* reason) {
    return conclude(*handle, VDI_CATALYST_BAD_ARGUMENT, reason, std::nullopt);
  }
  static const char* error(const Handle* handle) {
    return handle != nullptr ? handle->error.c_str() : lastError();
  }

  /// An engine's table with these entries. All others are null.
  static constexpr vdi_catalyst_functions table() {
    vdi_catalyst_functions table{};
    table.set_array = setArray;
    table.set_array_strided = setArrayStrided;
    table.set_array_offset = setArrayOffset;
    table.set_array_missing = setArrayMissing;
    table.set_particles = setParticles;
    table.set_stream = setStream;
    table.parameter_f64 = parameterF64;
    table.parameter_i64 = parameterI64;
    table.refuse = refuse;
    table.error = error;
    return table;
  }
};

}  // namespace vdi::catalyst
