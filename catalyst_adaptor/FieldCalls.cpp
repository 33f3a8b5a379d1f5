#include "catalyst_adaptor/FieldCalls.h"

#include <cstddef>
#include <cstdio>
#include <exception>
#include <new>
#include <utility>
#include <vector>

#include "catalyst_adaptor/ParticleArray.h"
#include "catalyst_adaptor/StridedArray.h"

namespace vdi::catalyst {

namespace {

/// `strides` is null for values in order.
int setAnyArray(FieldCalls& self, const GivenArray& array, const void* const* data,
                const vdi_catalyst_strides* strides) {
  Fields::Change change;
  const bool cells = array.association == VDI_CATALYST_CELLS;
  const int code = guarded(self, VDI_CATALYST_BAD_ARGUMENT, [&] {
    require(self.haveBlocks, "arrays were given before blocks");
    require(array.name != nullptr && *array.name != '\0', "an array needs a name");
    require(cells || array.association == VDI_CATALYST_POINTS, "unknown association");
    require(array.components >= 1 && array.components <= maxComponents,
            "the number of components must be 1 to 16");
    (void)bytesOf(array.type);
    const std::vector<vdi_catalyst_block>& blocks = self.fields.blocks();
    require(blocks.empty() || data != nullptr, "an array without data");
    std::vector<StridedValues> all;
    for (std::size_t i = 0; i < blocks.size(); ++i) {
      StridedValues values = self.fields.inOrder(blocks[i], array.type, cells, array.components, data[i]);
      for (std::size_t axis = 0; axis < 3 && strides != nullptr; ++axis)
        values.strides[axis] = strides[i].strides[axis];
      if (strides != nullptr && array.components > 1) values.componentStride = strides[i].component_stride;
      require(values.first == nullptr || values.reachable(), "strides that lead beyond the address space");
      all.push_back(values);
    }
    change = self.fields.arrayChange(array.name, cells, array.type, std::move(all));
  });
  if (code == VDI_CATALYST_OK) self.fields.set(std::move(change));
  return code;
}

}  // namespace

int setBlocks(FieldCalls& self, std::int32_t count, const vdi_catalyst_block* blocks,
              FunctionRef<void()> prepare) {
  std::vector<vdi_catalyst_block> copies;
  const int code = guarded(self, VDI_CATALYST_BAD_ARGUMENT, [&] {
    checkBlocks(count, blocks);
    copies.assign(blocks, blocks + count);
    prepare();
  });
  if (code != VDI_CATALYST_OK) return code;  // all ranks keep the blocks that they have
  self.fields.setBlocks(std::move(copies));
  self.haveBlocks = true;
  return code;
}

int setArray(FieldCalls& self, const GivenArray& array, const void* const* data) {
  return setAnyArray(self, array, data, nullptr);
}

int setArrayStrided(FieldCalls& self, const GivenArray& array, const void* const* data,
                    const vdi_catalyst_strides* strides) {
  const bool isMissing = strides == nullptr && !self.fields.blocks().empty();
  const int code = guarded(self, VDI_CATALYST_BAD_ARGUMENT,
                           [&] { require(!isMissing, "a strided array without strides"); });
  if (code != VDI_CATALYST_OK) return code;
  return setAnyArray(self, array, data, strides);
}

int setArrayOffset(FieldCalls& self, const char* name, std::int32_t association, const double* offset) {
  Fields::Change change;
  const int code = guarded(self, VDI_CATALYST_BAD_ARGUMENT, [&] {
    require(self.haveBlocks, "an offset was given before blocks");
    checkOffset(name, association, offset);
    change = Fields::offsetChange(name, association == VDI_CATALYST_CELLS, {offset[0], offset[1], offset[2]});
  });
  if (code == VDI_CATALYST_OK) self.fields.set(std::move(change));
  return code;
}

int setArrayMissing(FieldCalls& self, const char* name, std::int32_t association, std::int32_t count,
                    const double* values) {
  Fields::Change change;
  const int code = guarded(self, VDI_CATALYST_BAD_ARGUMENT, [&] {
    require(self.haveBlocks, "missing values were given before blocks");
    checkName(name, association);
    require(count >= 0 && count <= maxMissing, "the number of missing values must be 0 to 64");
    require(count == 0 || values != nullptr, "missing values without numbers");
    change = Fields::missingChange(name, association == VDI_CATALYST_CELLS, {values, values + count});
  });
  if (code == VDI_CATALYST_OK) self.fields.set(std::move(change));
  return code;
}

int setParticles(FieldCalls& self, const char* name, const vdi_catalyst_particles* particles) {
  ParticleArray array;
  Fields::Change change;
  int code = guarded(self, VDI_CATALYST_BAD_ARGUMENT, [&] {
    require(self.haveBlocks, "particles were given before blocks");
    require(name != nullptr && *name != '\0', "an array needs a name");
    array = particleArrayOf(particles);
    change = self.fields.particlesChange(name, array);
  });
  if (code == VDI_CATALYST_OK) {
    code = guarded(self, VDI_CATALYST_BAD_ARGUMENT, [&] {
      requireEqual(self.comm, identityOf(name, array),
                   "the ranks give particles of different names, kinds or periodic axes");
    });
  }
  if (code == VDI_CATALYST_OK) self.fields.set(std::move(change));
  return code;
}

int setStream(FieldCalls& self, void* stream) {
  try {
    self.fields.gpuMemory().setStream(stream);
    return VDI_CATALYST_OK;
  } catch (const std::exception& error) {  // the other ranks don't know of it
    std::fprintf(stderr, "vdi_catalyst: %s\n", error.what());
    try {
      self.error = error.what();
    } catch (const std::bad_alloc&) {
      self.error = "out of memory";  // fits into a string without an allocation
    }
  }
  return VDI_CATALYST_BAD_ARGUMENT;
}

int checkStep(FieldCalls& self, std::int64_t step, double time, FunctionRef<void()> requireOwn) {
  const int code = guarded(
      self, VDI_CATALYST_BAD_ARGUMENT,
      [&] {
        require(self.haveBlocks, "no blocks were given yet");
        requireOwn();
        requireTime(time);
      },
      step);
  if (code != VDI_CATALYST_OK) return code;
  self.fields.beginStep();
  return guarded(
      self, VDI_CATALYST_BAD_ARGUMENT,
      [&] { requireEqual(self.comm, step, "the ranks give different steps"); }, step);
}

}  // namespace vdi::catalyst
