#include "catalyst_adaptor/json/Fields.h"

#include <cmath>
#include <cstring>
#include <memory>
#include <new>
#include <stdexcept>
#include <utility>

#include "vdi/core/Error.h"

namespace vdi::catalyst {

namespace {

glm::ivec3 vectorOf(const int32_t (&v)[3]) {
  return {v[0], v[1], v[2]};
}
glm::dvec3 vectorOf(const double (&v)[3]) {
  return {v[0], v[1], v[2]};
}

bool isWide(int type) {
  return type == VDI_CATALYST_I64 || type == VDI_CATALYST_U64;
}

/// The library's types have the numbers of vdi_catalyst.h. The library has no 64-bit integers.
ScalarType scalarTypeOf(int type) {
  static_assert(static_cast<int>(ScalarType::U8) == VDI_CATALYST_U8 &&
                static_cast<int>(ScalarType::I8) == VDI_CATALYST_I8 &&
                static_cast<int>(ScalarType::U16) == VDI_CATALYST_U16 &&
                static_cast<int>(ScalarType::I16) == VDI_CATALYST_I16 &&
                static_cast<int>(ScalarType::U32) == VDI_CATALYST_U32 &&
                static_cast<int>(ScalarType::I32) == VDI_CATALYST_I32 &&
                static_cast<int>(ScalarType::F32) == VDI_CATALYST_F32 &&
                static_cast<int>(ScalarType::F64) == VDI_CATALYST_F64);
  return static_cast<ScalarType>(type);
}

double loadAny(int type, const std::byte* data, std::size_t index) {
  if (!isWide(type)) return loadValue(scalarTypeOf(type), data, index);
  std::uint64_t bits = 0;
  std::memcpy(&bits, data + index * sizeof bits, sizeof bits);
  return type == VDI_CATALYST_U64 ? static_cast<double>(bits)
                                  : static_cast<double>(static_cast<std::int64_t>(bits));
}

/// The memory that a block reads, and its owner.
struct Memory {
  const void* data = nullptr;
  std::shared_ptr<const void> keepAlive;
};

Memory gathered(const StridedValues& values) {
  const auto array = std::make_shared<StridedArray>(values);
  array->gather();
  return {array->data(), array};
}

Block blockAt(const vdi_catalyst_block& b, bool cells, ScalarType type, Memory memory) {
  const GhostLayers ghosts{vectorOf(b.ghost_lo), vectorOf(b.ghost_hi)};
  const glm::ivec3 counts = vectorOf(b.cells) + (cells ? 0 : 1);
  Block block =
      cells ? Block::fromCells(counts, vectorOf(b.origin), vectorOf(b.spacing), type, memory.data, ghosts)
            : Block::fromPoints(counts, vectorOf(b.origin), vectorOf(b.spacing), type, memory.data, ghosts);
  block.keepAlive = std::move(memory.keepAlive);
  return block;
}

/// Each value's only component, or the magnitude of all, as doubles.
Memory asDoubles(const StridedValues& values, int type) {
  StridedArray array(values);
  array.gather();
  const auto* from = static_cast<const std::byte*>(array.data());
  const auto components = static_cast<std::size_t>(values.components);
  const auto count = static_cast<std::size_t>(values.scalars()) / components;
  std::shared_ptr<double[]> doubles(new (std::nothrow) double[count]);
  if (!doubles) {
    throw std::runtime_error(
        "no memory for the shown values of an array: " + std::to_string(count * sizeof(double)) + " bytes");
  }
  for (std::size_t i = 0; i < count; ++i) {
    if (components == 1) {
      doubles[i] = loadAny(type, from, i);
      continue;
    }
    double sum = 0.0;
    for (std::size_t c = 0; c < components; ++c) {
      const double value = loadAny(type, from, i * components + c);
      sum += value * value;
    }
    doubles[i] = std::sqrt(sum);
  }
  return {doubles.get(), doubles};
}

}  // namespace

std::size_t bytesOf(int type) {
  if (isWide(type)) return sizeof(std::uint64_t);
  if (type < VDI_CATALYST_U8 || type > VDI_CATALYST_F64) throw std::invalid_argument("unknown scalar type");
  return sizeOf(scalarTypeOf(type));
}

void Fields::setBlocks(std::vector<vdi_catalyst_block> blocks) {
  blocks_ = std::move(blocks);
  arrays_.clear();
  ++version_;
}

StridedValues Fields::inOrder(const vdi_catalyst_block& block, int type, bool cells, int components,
                              const void* data) const {
  StridedValues values;
  values.first = static_cast<const std::byte*>(data);
  values.components = components;
  values.scalarBytes = bytesOf(type);
  values.componentStride = static_cast<std::int64_t>(values.scalarBytes);
  std::int64_t stride = values.componentStride * components;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    values.counts[axis] = block.cells[axis] + (cells ? 0 : 1);
    values.strides[axis] = stride;
    stride *= values.counts[axis];
  }
  return values;
}

void Fields::setArray(const std::string& name, bool cells, int type, std::vector<StridedValues> values) {
  arrays_[{cells, name}] = {type, std::move(values)};
}

const Fields::Array* Fields::find(const std::string& name, bool cells) const {
  const auto found = arrays_.find({cells, name});
  return found != arrays_.end() ? &found->second : nullptr;
}

std::string Fields::names() const {
  std::string names;
  for (const auto& [key, array] : arrays_)
    names +=
        (names.empty() ? "" : ", ") + std::string(key.first ? "cells" : "points") + " '" + key.second + "'";
  return names.empty() ? "none" : names;
}

std::optional<bool> Fields::associationOf(const std::string& name) const {
  const bool ofCells = find(name, true) != nullptr;
  const bool ofPoints = find(name, false) != nullptr;
  if (ofCells && ofPoints)
    throw std::runtime_error("there are arrays '" + name +
                             "' of cells and of points: 'association' must name one");
  if (ofCells || ofPoints) return ofCells;
  if (!blocks_.empty())
    throw std::runtime_error("there is no array '" + name + "'; the arrays are: " + names());
  return std::nullopt;
}

int Fields::componentsOf(const std::string& name, bool cells) const {
  const Array* array = find(name, cells);
  return array != nullptr && !array->values.empty() ? array->values.front().components : 1;
}

Fields::Values Fields::valuesOf(const std::string& name, bool cells, int component) const {
  if (blocks_.empty()) return {};
  const Array* array = find(name, cells);
  if (array == nullptr) {
    throw std::runtime_error("there is no array '" + name + "' of " + (cells ? "cells" : "points") +
                             "; the arrays are: " + names());
  }
  for (const StridedValues& values : array->values) {
    if (values.components > 1 && component >= values.components) {
      throw std::runtime_error("there is no component " + std::to_string(component) + ", '" + name +
                               "' has " + std::to_string(values.components));
    }
  }
  return {array->type, array->values};
}

std::vector<Block> Fields::placesOf(bool cells) const {
  std::vector<Block> places;
  for (const vdi_catalyst_block& block : blocks_)
    places.push_back(blockAt(block, cells, ScalarType::U8, {&block, nullptr}));
  return places;
}

std::vector<Block> Fields::blocksOf(const std::string& name, bool cells, int component) const {
  std::vector<Block> blocks;
  const Values all = valuesOf(name, cells, component);
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    StridedValues values = all.blocks[i];
    if (values.components > 1 && component >= 0) {
      values.first += component * values.componentStride;
      values.components = 1;
    }
    const bool isConverted = values.components > 1 || isWide(all.type);
    Memory memory{values.first, nullptr};
    if (isConverted) {
      memory = asDoubles(values, all.type);
    } else if (!values.inOrder()) {
      memory = gathered(values);
    }
    const ScalarType type = isConverted ? ScalarType::F64 : scalarTypeOf(all.type);
    blocks.push_back(blockAt(blocks_[i], cells, type, std::move(memory)));
  }
  return blocks;
}

bool agreeOnCells(const comm::Communicator& comm, const Fields& fields, const std::string& name,
                  std::optional<bool> given) {
  // Ranks without blocks may not know the kind. All others agree on it.
  std::array<std::uint64_t, 2> kinds{0, 0};  // whether a rank has it as an array of points, and of cells
  comm.together([&] {
    const std::optional<bool> cells = given ? given : fields.associationOf(name);
    if (cells) kinds[*cells ? 1 : 0] = 1;
  });
  comm.allReduceMax(kinds);
  if (kinds[0] > 0 && kinds[1] > 0) {
    throw Error(ErrorCode::InvalidArgument,
                "ranks have '" + name + "' of cells and of points: 'association' must name one");
  }
  return kinds[1] > 0;
}

}  // namespace vdi::catalyst
