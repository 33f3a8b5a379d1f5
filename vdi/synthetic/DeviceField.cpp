#include "vdi/synthetic/DeviceField.h"

#include <algorithm>
#include <array>
#include <map>

#include "shaders/shared/field.h"
#include "vdi/synthetic/Fields.h"

namespace vdi::synthetic {

namespace shared = gpu::shared;

DeviceField::DeviceField(std::shared_ptr<gpu::Device> device, const std::string& name, std::uint32_t seed)
    : device_(std::move(device)),
      pipeline_(device_, gpu::infoOf<shared::FieldConstants>("field")),
      commands_(device_),
      field_(static_cast<std::uint32_t>(fieldIndex(name))),
      seed_(seed) {}

std::shared_ptr<std::byte[]> DeviceField::makeValues(const Lattice& lattice, const Part& part, double top) {
  const std::size_t layer = static_cast<std::size_t>(part.dims.x) * static_cast<std::size_t>(part.dims.y);
  std::shared_ptr<std::byte[]> data(
      new std::byte[layer * static_cast<std::size_t>(part.dims.z) * sizeOf(lattice.type)]);
  constexpr std::size_t atOnce = std::size_t{16} << 20;
  const int slab = std::min(static_cast<int>(std::max<std::size_t>(atOnce / layer, 1)), part.dims.z);
  const std::size_t bytes = layer * static_cast<std::size_t>(slab) * sizeof(float);
  values_.reserve(device_, bytes, gpu::MemoryKind::DeviceLocal);
  readback_.reserve(device_, bytes, gpu::MemoryKind::Readback);
  shared::FieldConstants constants{};
  constants.values = values_.address();
  constants.field = field_;
  constants.spacing = static_cast<float>(lattice.spacing.x);
  constants.seed = seed_;
  for (int z = 0; z < part.dims.z; z += slab) {
    const int layers = std::min(slab, part.dims.z - z);
    const std::size_t count = layer * static_cast<std::size_t>(layers);
    constants.size = glm::uvec3(part.dims.x, part.dims.y, layers);
    constants.first =
        glm::vec3(part.first + glm::ivec3(0, 0, z)) + (lattice.joint == Joint::Cells ? 0.5F : 0.0F);
    commands_.begin();
    commands_.dispatchMany(pipeline_, constants, count, shared::fieldGroup);
    commands_.barrier();
    commands_.copy(values_, 0, readback_, 0, count * sizeof(float));
    commands_.submitAndWait();
    const std::span<const float> values = readback_.mappedAs<float>();
    layerByLayer(layers, count, [&](int i) {
      const std::size_t first = layer * static_cast<std::size_t>(i);
      const std::size_t place = layer * static_cast<std::size_t>(z) + first;
      for (std::size_t j = 0; j < layer; ++j)
        storeValue(lattice.type, data.get(), place + j, top * static_cast<double>(values[first + j]));
    });
  }
  return data;
}

std::vector<Block> DeviceField::makeBlocks(const Lattice& one, const Lattice& all,
                                           std::span<const Part> parts, double top) {
  std::vector<Block> blocks;
  std::map<std::array<int, 6>, std::shared_ptr<std::byte[]>> made;  // by position and size in `one`
  for (const Part& part : parts) {
    Part own = part;
    own.first = part.first % one.size;
    std::shared_ptr<std::byte[]>& values =
        made[{own.first.x, own.first.y, own.first.z, own.dims.x, own.dims.y, own.dims.z}];
    if (!values) values = makeValues(one, own, top);
    blocks.push_back(blockOf(all, part, values));
  }
  return blocks;
}

}  // namespace vdi::synthetic
