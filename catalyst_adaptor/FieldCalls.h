// The calls by which a simulation hands over blocks and arrays, for engines that keep them in Fields.
#pragma once

#include <cstdint>

#include "catalyst_adaptor/Calls.h"
#include "catalyst_adaptor/Fields.h"
#include "catalyst_adaptor/vdi_catalyst.h"
#include "vdi/core/FunctionRef.h"

namespace vdi::catalyst {

struct FieldCalls : Calls {
  bool haveBlocks = false;
  Fields fields;
};

/// The arguments of an array that a simulation gives, not yet checked.
struct GivenArray {
  const char* name;
  std::int32_t type;
  std::int32_t association;
  std::int32_t components;
};

/// These functions implement those of vdi_catalyst.h. Collective. After an error, blocks and arrays
/// are unchanged. Once the blocks are checked, setBlocks also runs `prepare`, which may throw, but
/// must not communicate.
int setBlocks(
    FieldCalls& self, std::int32_t count, const vdi_catalyst_block* blocks,
    FunctionRef<void()> prepare = [] {});
int setArray(FieldCalls& self, const GivenArray& array, const void* const* data);
int setArrayStrided(FieldCalls& self, const GivenArray& array, const void* const* data,
                    const vdi_catalyst_strides* strides);
int setArrayOffset(FieldCalls& self, const char* name, std::int32_t association, const double* offset);
int setArrayMissing(FieldCalls& self, const char* name, std::int32_t association, std::int32_t count,
                    const double* values);
int setParticles(FieldCalls& self, const char* name, const vdi_catalyst_particles* particles);
/// Not collective. A failure stays on this rank.
int setStream(FieldCalls& self, void* stream);
/// The checks with which `execute` begins. `requireOwn` makes those of the engine; it may throw, but must not
/// communicate.
int checkStep(FieldCalls& self, std::int64_t step, double time, FunctionRef<void()> requireOwn);

}  // namespace vdi::catalyst
