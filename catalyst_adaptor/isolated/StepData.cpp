#include "catalyst_adaptor/isolated/StepData.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cstring>
#include <stdexcept>
#include <utility>

#include "catalyst_adaptor/Calls.h"
#include "catalyst_adaptor/isolated/Packing.h"

namespace vdi::catalyst {

namespace {

constexpr std::uint64_t alignment = 4096;  // of each block's values, so that whole cache lines are copied

std::uint64_t aligned(std::uint64_t offset) {
  return (offset + alignment - 1) / alignment * alignment;
}

/// Replaces the offset if the block lacks the array, or the particles lack the numbers.
constexpr std::uint64_t none = ~std::uint64_t{0};

int componentsOf(const Fields::NamedArray& array) {
  for (const StridedValues& values : array.blocks) {
    if (values.first != nullptr) return values.components;
  }
  return 1;
}

std::uint64_t bytesOf(const NumberColumn& column) {
  return column.isDouble ? sizeof(double) : sizeof(float);
}

/// Number of bytes of a block's values as StepWriter places them, exact if memory can hold so many. Throws
/// std::runtime_error for what no StepWriter writes.
double placedBytes(const vdi_catalyst_block& block, const StepData::Array& array) {
  const bool isKnown = array.type >= VDI_CATALYST_U8 && array.type <= VDI_CATALYST_U64;
  if (!isKnown || array.components < 1 || array.components > maxComponents)
    throw std::runtime_error("a step's array '" + array.name + "' has an unknown type");
  double bytes = static_cast<double>(catalyst::bytesOf(array.type)) * array.components;
  for (const std::int32_t cells : block.cells) {
    if (cells < 1) throw std::runtime_error("a step's block has no cells");
    bytes *= static_cast<double>(cells) + (array.cells ? 0.0 : 1.0);
  }
  return bytes;
}

/// Number of values that the other process needs of a column.
std::uint64_t countOf(const NumberColumn& column, std::size_t particles) {
  return column.stride == 0 ? std::min<std::size_t>(particles, 1) : particles;
}

std::array<NumberColumn, 5> columnsOf(const vdi::Particles& particles) {
  return {particles.positions[0], particles.positions[1], particles.positions[2], particles.weights,
          particles.lengths};
}

void copyColumn(const NumberColumn& column, std::uint64_t count, std::byte* to) {
  const std::uint64_t bytes = bytesOf(column);
  for (std::uint64_t i = 0; i < count; ++i)
    std::memcpy(to + i * bytes, column.first + static_cast<std::int64_t>(i) * column.stride, bytes);
}

/// Describes fields, and places their values one after the other. Offsets count from the end of the
/// descriptions, whose size isn't known before.
class Placement {
 public:
  explicit Placement(Packer& head) : head_(head) {}

  void put(const Fields::NamedArray& array) {
    head_.putText(array.name);
    head_.put(array.cells);
    head_.put(std::int32_t{array.type});
    head_.put(std::int32_t{componentsOf(array)});
    for (int axis = 0; axis < 3; ++axis) head_.put(array.offset[axis]);
    head_.putAll(array.missing);
    for (const StridedValues& values : array.blocks) place(values.first != nullptr, values.bytes());
  }
  void put(const StepFields::NamedParticles& particles) {
    const auto& [name, array, offset, missing] = particles;
    head_.putText(name);
    for (int axis = 0; axis < 3; ++axis) head_.put(offset[axis]);
    head_.putAll(missing);
    head_.put(array.kind);
    head_.put(array.particles.periodic);
    head_.put(std::uint64_t{array.particles.count});
    for (const NumberColumn& column : columnsOf(array.particles)) {
      head_.put(column.isDouble);
      head_.put(column.stride == 0);
      place(static_cast<bool>(column), countOf(column, array.particles.count) * bytesOf(column));
    }
  }
  std::uint64_t end() const { return end_; }
  const std::vector<std::uint64_t>& offsets() const { return offsets_; }

 private:
  void place(bool exists, std::uint64_t bytes) {
    head_.put(exists ? end_ : none);
    if (!exists) return;
    offsets_.push_back(end_);
    end_ = aligned(end_ + bytes);
  }

  Packer& head_;
  std::uint64_t end_ = 0;
  std::vector<std::uint64_t> offsets_;
};

/// Reads a step's descriptions, and finds the values.
class StepReader {
 public:
  explicit StepReader(std::span<const std::byte> from)
      : from_(from), head_(from), begin_(head_.take<std::uint64_t>()) {}

  template <typename Value>
  Value take() {
    return head_.take<Value>();
  }
  StepData::Array takeArray(const std::vector<vdi_catalyst_block>& blocks) {
    StepData::Array array;
    array.name = head_.takeText();
    array.cells = take<bool>();
    array.type = take<std::int32_t>();
    array.components = take<std::int32_t>();
    for (double& offset : array.offset) offset = take<double>();
    array.missing = head_.takeAll<double>();
    for (const vdi_catalyst_block& block : blocks) array.blocks.push_back(placed(placedBytes(block, array)));
    return array;
  }
  StepData::Particles takeParticles() {
    StepData::Particles particles;
    vdi_catalyst_particles& given = particles.given;
    particles.name = head_.takeText();
    for (double& offset : particles.offset) offset = take<double>();
    particles.missing = head_.takeAll<double>();
    given.kind = take<DepositKind>() == DepositKind::Density ? VDI_CATALYST_DENSITY : VDI_CATALYST_SUM;
    const auto periodic = take<std::array<bool, 3>>();
    for (std::size_t axis = 0; axis < 3; ++axis) given.periodic[axis] = periodic[axis] ? 1 : 0;
    given.count = static_cast<std::int64_t>(take<std::uint64_t>());
    if (given.count < 0) throw std::runtime_error("a step has too many particles to count");
    const auto column = [&](const void*& first, std::int32_t& type, std::int64_t& stride) {
      const auto isDouble = take<bool>();
      const auto isOne = take<bool>();
      type = isDouble ? VDI_CATALYST_F64 : VDI_CATALYST_F32;
      const std::size_t bytes = isDouble ? sizeof(double) : sizeof(float);
      stride = isOne ? 0 : static_cast<std::int64_t>(bytes);
      const auto count = static_cast<double>(given.count);
      first = placed(static_cast<double>(bytes) * (isOne ? std::min(count, 1.0) : count));
    };
    for (const void*& position : given.positions)
      column(position, given.position_type, given.position_stride);
    column(given.weights, given.weight_type, given.weight_stride);
    column(given.lengths, given.length_type, given.length_stride);
    return particles;
  }
  Parameter takeParameter() {
    Parameter parameter;
    parameter.name = head_.takeText();
    parameter.isWhole = take<bool>();
    parameter.value = take<double>();
    parameter.low = take<double>();
    parameter.high = take<double>();
    return parameter;
  }

 private:
  /// That many bytes of data at the next offset; null if there is no offset.
  const std::byte* placed(double bytes) {
    const auto offset = take<std::uint64_t>();
    if (offset == none) return nullptr;
    // An array without values may lie at the end of the memory.
    if (begin_ > from_.size() || offset > from_.size() - begin_ ||
        bytes > static_cast<double>(from_.size() - begin_ - offset))
      throw std::runtime_error("a step's values lie outside the shared memory");
    return from_.data() + begin_ + offset;
  }

  std::span<const std::byte> from_;
  Unpacker head_;
  std::uint64_t begin_;
};

}  // namespace

StepWriter::StepWriter(std::uint64_t version, const std::vector<vdi_catalyst_block>& blocks,
                       StepFields fields, const std::vector<Parameter>& parameters)
    : fields_(std::move(fields)) {
  Packer head;
  Placement placement(head);
  head.put(version);
  head.put(std::uint64_t{blocks.size()});
  for (const vdi_catalyst_block& block : blocks) head.put(block);
  head.put(std::uint64_t{fields_.arrays.size()});
  for (const Fields::NamedArray& array : fields_.arrays) placement.put(array);
  head.put(std::uint64_t{fields_.particles.size()});
  for (const StepFields::NamedParticles& particles : fields_.particles) placement.put(particles);
  head.put(std::uint64_t{parameters.size()});
  for (const Parameter& parameter : parameters) {
    head.putText(parameter.name);
    head.put(parameter.isWhole);
    head.put(parameter.value);
    head.put(parameter.low);
    head.put(parameter.high);
  }
  Packer size;
  size.put(aligned(sizeof(std::uint64_t) + head.bytes().size()));
  head_.assign(size.bytes().begin(), size.bytes().end());
  head_.insert(head_.end(), head.bytes().begin(), head.bytes().end());
  const std::uint64_t begin = aligned(head_.size());
  for (const std::uint64_t offset : placement.offsets()) offsets_.push_back(begin + offset);
  bytes_ = begin + placement.end();
}

void StepWriter::write(std::span<std::byte> to) const {
  assert(to.size() >= bytes_);
  std::memcpy(to.data(), head_.data(), head_.size());
  std::size_t next = 0;
  for (const Fields::NamedArray& array : fields_.arrays) {
    for (const StridedValues& values : array.blocks) {
      if (values.first != nullptr) values.copyTo(to.data() + offsets_[next++]);
    }
  }
  for (const StepFields::NamedParticles& particles : fields_.particles) {
    const Particles& own = particles.array.particles;
    for (const NumberColumn& column : columnsOf(own)) {
      if (column) copyColumn(column, countOf(column, own.count), to.data() + offsets_[next++]);
    }
  }
}

StepData StepData::read(std::span<const std::byte> from) {
  StepReader reader(from);
  StepData step;
  step.version = reader.take<std::uint64_t>();
  for (auto blocks = reader.take<std::uint64_t>(); blocks > 0; --blocks)
    step.blocks.push_back(reader.take<vdi_catalyst_block>());
  for (auto arrays = reader.take<std::uint64_t>(); arrays > 0; --arrays)
    step.arrays.push_back(reader.takeArray(step.blocks));
  for (auto particles = reader.take<std::uint64_t>(); particles > 0; --particles)
    step.particles.push_back(reader.takeParticles());
  for (auto parameters = reader.take<std::uint64_t>(); parameters > 0; --parameters)
    step.parameters.push_back(reader.takeParameter());
  return step;
}

}  // namespace vdi::catalyst
