#include "catalyst_adaptor/Fields.h"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <utility>

#include "catalyst_adaptor/memory/ReadableMemory.h"
#include "vdi/core/Error.h"

namespace vdi::catalyst {

namespace {

glm::ivec3 vectorOf(const int32_t (&v)[3]) {
  return {v[0], v[1], v[2]};
}
glm::dvec3 vectorOf(const double (&v)[3]) {
  return {v[0], v[1], v[2]};
}

/// The library's types have the numbers of vdi_catalyst.h.
ComponentType componentTypeOf(int type) {
  static_assert(static_cast<int>(ComponentType::U8) == VDI_CATALYST_U8 &&
                static_cast<int>(ComponentType::I8) == VDI_CATALYST_I8 &&
                static_cast<int>(ComponentType::U16) == VDI_CATALYST_U16 &&
                static_cast<int>(ComponentType::I16) == VDI_CATALYST_I16 &&
                static_cast<int>(ComponentType::U32) == VDI_CATALYST_U32 &&
                static_cast<int>(ComponentType::I32) == VDI_CATALYST_I32 &&
                static_cast<int>(ComponentType::F32) == VDI_CATALYST_F32 &&
                static_cast<int>(ComponentType::F64) == VDI_CATALYST_F64 &&
                static_cast<int>(ComponentType::I64) == VDI_CATALYST_I64 &&
                static_cast<int>(ComponentType::U64) == VDI_CATALYST_U64);
  return static_cast<ComponentType>(type);
}

/// The block's place and its owned box, with values of which only the address `data` is known.
Block blockAt(const vdi_catalyst_block& b, bool cells, const glm::dvec3& offset, const void* data) {
  const GhostLayers ghosts{vectorOf(b.ghost_lo), vectorOf(b.ghost_hi)};
  const glm::ivec3 counts = vectorOf(b.cells) + (cells ? 0 : 1);
  const glm::dvec3 spacing = vectorOf(b.spacing);
  Block block = cells ? Block::fromCells(counts, vectorOf(b.origin), spacing, ScalarType::U8, data, ghosts)
                      : Block::fromPoints(counts, vectorOf(b.origin), spacing, ScalarType::U8, data, ghosts);
  block.moveValues(offset);
  return block;
}

ComponentArray arrayOf(const StridedValues& values, int type, const std::vector<double>& missing) {
  return {values.first,           {values.strides[0], values.strides[1], values.strides[2]},
          componentTypeOf(type),  values.components,
          values.componentStride, missing};
}

/// Moves the entries of `fresh` to `all`. Replaces entries that have the same keys.
template <typename Key, typename Value>
void replace(std::map<Key, Value>& all, std::map<Key, Value>& fresh) noexcept {
  for (const auto& [key, value] : fresh) all.erase(key);
  all.merge(fresh);
}

std::string kindOf(bool cells) {
  return cells ? "cells" : "points";
}

std::string nameOf(const std::string& name, bool cells) {
  return "the array '" + name + "' of " + kindOf(cells);
}

std::string nameOf(std::size_t block, const std::string& array) {
  return "block " + std::to_string(block) + " of " + array;
}

std::string nameOfParticles(const std::string& name) {
  return "a part of the particles '" + name + "'";
}

[[noreturn]] void refuseUnreadable(const std::string& name) {
  throw std::runtime_error(name +
                           " can't be read: its memory was freed, is mapped only in part, or is of a device "
                           "that isn't known here");
}

}  // namespace

std::size_t bytesOf(int type) {
  if (type < VDI_CATALYST_U8 || type > VDI_CATALYST_U64) throw std::invalid_argument("unknown scalar type");
  return sizeOf(componentTypeOf(type));
}

void Fields::setBlocks(std::vector<vdi_catalyst_block> blocks) {
  blocks_ = std::move(blocks);
  if (!arrays_.empty()) before_.swap(arrays_);
  arrays_.clear();
  offsets_.clear();
  missing_.clear();
  particles_.clear();
  deposits_.clear();
  ++version_;
  ++changes_;
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

Fields::Change Fields::arrayChange(const std::string& name, bool cells, int type,
                                   std::vector<StridedValues> values) {
  Change change;
  change.key_ = {cells, name};
  std::vector<std::size_t> onDevice;
  for (std::size_t i = 0; i < values.size(); ++i) {
    try {
      if (values[i].first != nullptr && gpuMemory_.isOfCuda(*values[i].extent())) onDevice.push_back(i);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(nameOf(i, nameOf(name, cells)) + " " + error.what());
    }
  }
  Array array{type, {}};
  if (!onDevice.empty()) {
    const auto inForce = arrays_.find(change.key_);
    const auto before = before_.find(change.key_);
    array.copy = HostCopy::ofBlocks(values, onDevice,
                                    inForce != arrays_.end()  ? inForce->second.copy
                                    : before != before_.end() ? before->second.copy
                                                              : nullptr);
  }
  array.values = std::move(values);
  change.array_[change.key_] = std::move(array);
  return change;
}

Fields::Change Fields::offsetChange(const std::string& name, bool cells,
                                    const std::array<double, 3>& offset) {
  Change change;
  change.key_ = {cells, name};
  change.offset_[change.key_] = {offset[0], offset[1], offset[2]};
  return change;
}

Fields::Change Fields::missingChange(const std::string& name, bool cells, std::vector<double> missing) {
  Change change;
  change.key_ = {cells, name};
  change.missing_[change.key_] = std::move(missing);
  return change;
}

Fields::Change Fields::particlesChange(const std::string& name, ParticleArray particles) {
  Change change;
  change.key_ = {true, name};
  const std::size_t count = particles.particles.count;
  std::vector<NumberColumn*> columns = columnsOf(particles.particles);
  std::erase_if(columns, [&](const NumberColumn* column) {
    try {
      return !gpuMemory_.isOfCuda(extentOf(*column, count));
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(nameOfParticles(name) + " " + error.what());
    }
  });
  if (!columns.empty()) {
    const ParticleArray* before = particlesOf(name);
    particles.copy = HostCopy::ofColumns(columns, count, before != nullptr ? before->copy : nullptr);
  }
  change.particles_[name] = std::move(particles);
  return change;
}

void Fields::set(Change change) noexcept {
  const auto& [cells, name] = change.key_;
  ++changes_;
  if (!change.offset_.empty()) return replace(offsets_, change.offset_);
  if (!change.missing_.empty()) return replace(missing_, change.missing_);
  if (cells) {
    particles_.erase(name);
    deposits_.erase(name);
  }
  if (change.array_.empty()) arrays_.erase(change.key_);
  put(change.array_);
  replace(particles_, change.particles_);
}

void Fields::put(std::map<Key, Array>& fresh) noexcept {
  for (auto& [key, array] : fresh) {
    const auto before = arrays_.find(key);
    array.set = before != arrays_.end() ? before->second.set : changes_;
  }
  replace(arrays_, fresh);
}

glm::dvec3 Fields::offsetOf(const std::string& name, bool cells) const {
  const auto found = offsets_.find({cells, name});
  return found != offsets_.end() ? found->second : glm::dvec3(0.0);
}

const std::vector<double>& Fields::missingOf(const std::string& name, bool cells) const {
  static const std::vector<double> none;
  const auto found = missing_.find({cells, name});
  return found != missing_.end() ? found->second : none;
}

const ParticleArray* Fields::particlesOf(const std::string& name) const {
  const auto found = particles_.find(name);
  return found != particles_.end() ? &found->second : nullptr;
}

void Fields::setDeposit(const std::string& name, DepositedValues values) {
  std::vector<StridedValues> all;
  for (std::size_t i = 0; i < blocks_.size(); ++i)
    all.push_back(inOrder(blocks_[i], VDI_CATALYST_F32, true, 1, values[i].get()));
  std::map<Key, Array> array;
  array[{true, name}] = {VDI_CATALYST_F32, std::move(all)};
  std::map<std::string, DepositedValues> deposit;
  deposit[name] = std::move(values);
  ++changes_;
  put(array);
  replace(deposits_, deposit);
}

void Fields::dropDeposits() {
  ++changes_;
  for (const auto& [name, values] : deposits_) arrays_.erase({true, name});
  deposits_.clear();
}

void Fields::fetch(const std::string& name, bool cells) {
  const auto found = arrays_.find({cells, name});
  if (found == arrays_.end()) return;
  const std::array<Entry*, 1> one{&*found};
  fetch(one);
}

void Fields::fetchArrays() {
  std::vector<Entry*> all;
  for (Entry& entry : arrays_) all.push_back(&entry);
  fetch(all);
}

void Fields::fetch(std::span<Entry* const> arrays) {
  std::vector<std::string> names;  // all before the first copy, which refers to one
  for (const Entry* entry : arrays) names.push_back(nameOf(entry->first.second, entry->first.first));
  std::vector<BufferCopy> copies;
  std::vector<MemoryRange> ranges;
  std::vector<std::pair<const std::string*, std::size_t>> owners;  // of the ranges: array and block
  for (std::size_t a = 0; a < arrays.size(); ++a) {
    const Array& array = arrays[a]->second;
    if (array.fetched == step_) continue;
    if (array.copy) array.copy->addTo(copies, names[a]);
    for (std::size_t i = 0; i < array.values.size(); ++i) {
      if (array.values[i].first == nullptr) continue;
      ranges.push_back(*array.values[i].extent());
      owners.emplace_back(&names[a], i);
    }
  }
  if (ranges.empty()) return;
  if (const std::optional<std::size_t> bad = firstUnreadable(ranges))
    refuseUnreadable(nameOf(owners[*bad].second, *owners[*bad].first));
  if (!copies.empty() || gpuMemory_.hasStream()) gpuMemory_.copy(copies);
  for (Entry* entry : arrays) entry->second.fetched = step_;
  before_.clear();
}

void Fields::fetchParticles(const std::string& name) {
  const auto found = particles_.find(name);
  if (found == particles_.end() || found->second.fetched == step_) return;
  ParticleArray& array = found->second;
  std::vector<MemoryRange> ranges;
  for (const NumberColumn* column : columnsOf(array.particles))
    ranges.push_back(extentOf(*column, array.particles.count));
  if (firstUnreadable(ranges)) refuseUnreadable(nameOfParticles(name));
  const std::string owner = nameOfParticles(name);
  std::vector<BufferCopy> copies;
  if (array.copy) array.copy->addTo(copies, owner);
  if (!copies.empty() || gpuMemory_.hasStream()) gpuMemory_.copy(copies);
  array.fetched = step_;
}

const Fields::Array* Fields::find(const std::string& name, bool cells) const {
  const auto found = arrays_.find({cells, name});
  return found != arrays_.end() ? &found->second : nullptr;
}

bool Fields::has(const std::string& name, bool cells) const {
  return find(name, cells) != nullptr || (cells && particles_.contains(name));
}

std::string Fields::names() const {
  std::string names;
  const auto add = [&names](const char* what, const std::string& name) {
    names += (names.empty() ? "" : ", ") + std::string(what) + " '" + name + "'";
  };
  for (const auto& [key, array] : arrays_) {
    if (!key.first || !particles_.contains(key.second)) add(key.first ? "cells" : "points", key.second);
  }
  for (const auto& [name, array] : particles_) add("cells", name);
  return names.empty() ? "none" : names;
}

std::optional<bool> Fields::associationOf(const std::string& name) const {
  const bool ofCells = has(name, true);
  const bool ofPoints = has(name, false);
  if (ofCells && ofPoints)
    throw std::runtime_error(
        "the name '" + name +
        "' belongs to an array of cells and to one of points: 'association' must choose one");
  return ofCells || ofPoints ? std::optional(ofCells) : std::nullopt;
}

std::vector<Fields::NamedArray> Fields::arrays() const {
  std::vector<NamedArray> arrays;
  for (const auto& [key, array] : arrays_)
    arrays.push_back({key.second, key.first, array.type, offsetOf(key.second, key.first),
                      missingOf(key.second, key.first), array.values});
  std::ranges::sort(arrays, {}, [&](const NamedArray& array) { return find(array.name, array.cells)->set; });
  return arrays;
}

int Fields::componentsOf(const std::string& name, bool cells) const {
  const Array* array = find(name, cells);
  if (array == nullptr) return 1;
  const auto has = [](const StridedValues& values) { return values.first != nullptr; };
  const auto found = std::ranges::find_if(array->values, has);
  return found != array->values.end() ? found->components : 1;
}

std::vector<Block> Fields::blocksOf(const std::string& name, bool cells, int component,
                                    std::span<const double> missing) const {
  const Array* array = find(name, cells);
  if (array == nullptr) return {};
  const int components = componentsOf(name, cells);
  const bool isHere =
      std::ranges::any_of(array->values, [](const StridedValues& values) { return values.first != nullptr; });
  if (isHere) {
    const std::string issue = componentIssue(component, components);
    if (!issue.empty()) throw std::runtime_error("'" + name + "' " + issue);
  }
  const glm::dvec3 offset = offsetOf(name, cells);
  std::vector<double> allMissing = missingOf(name, cells);
  allMissing.insert(allMissing.end(), missing.begin(), missing.end());
  std::vector<Block> blocks;
  for (std::size_t i = 0; i < array->values.size(); ++i) {
    const StridedValues& values = array->values[i];
    if (values.first == nullptr) continue;
    Block& block = blocks.emplace_back(blockAt(blocks_[i], cells, offset, values.first));
    // An array of one component has only that one to show.
    showComponent(block, arrayOf(values, array->type, allMissing),
                  values.components > 1 ? component : magnitude);
  }
  return blocks;
}

std::vector<Block> Fields::placesOf(const std::string& name, bool cells) const {
  // Particles become an array that all blocks have, and it counts even before it is made.
  const Array* array = find(name, cells);
  std::vector<Block> places;
  if (array == nullptr && !has(name, cells)) return places;
  const glm::dvec3 offset = offsetOf(name, cells);
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    if (array == nullptr || array->values[i].first != nullptr)
      places.push_back(blockAt(blocks_[i], cells, offset, &blocks_[i]));
  }
  return places;
}

bool agreeOnCells(const comm::Communicator& comm, const Fields& fields, const std::string& name,
                  std::optional<bool> given) {
  // Some ranks may lack the array. All others agree on its kind.
  std::array<std::uint64_t, 2> kinds{0, 0};  // whether a rank has it as an array of points, and of cells
  comm.together([&] {
    const std::optional<bool> cells = given ? given : fields.associationOf(name);
    if (cells) kinds[*cells ? 1 : 0] = 1;
  });
  comm.allReduceMax(kinds);
  if (kinds[0] > 0 && kinds[1] > 0) {
    throw Error(ErrorCode::InvalidArgument,
                "the name '" + name +
                    "' belongs to an array of cells on some ranks and to one of points on others: "
                    "'association' must choose one");
  }
  const bool cells = kinds[1] > 0;
  std::array<std::uint64_t, 2> counts{fields.blocks().size(), 0};
  comm.together([&] { counts[1] = fields.placesOf(name, cells).size(); });
  comm.allReduceSum(counts);
  if (counts[0] == 0 || counts[1] > 0) return cells;
  comm.together([&] {
    const std::string kind = kinds[0] + kinds[1] > 0 ? " of " + kindOf(cells) : "";
    if (!fields.blocks().empty() && !fields.has(name, cells))
      throw std::runtime_error("no array" + kind + " is named '" + name +
                               "'; the arrays are: " + fields.names());
  });
  throw Error(ErrorCode::InvalidArgument, "all blocks lack the array '" + name + "' of " + kindOf(cells));
}

}  // namespace vdi::catalyst
