#include "catalyst_adaptor/catalyst2/Grid.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <tuple>
#include <utility>

#include "catalyst_adaptor/Calls.h"

namespace vdi::catalyst {

namespace {

constexpr const char* uniformOnly = "; this implementation takes only uniform grids";
constexpr std::array<const char*, 2> ghostFields{"ascent_ghosts", "vtkGhostType"};
// vtkDataSetAttributes::DUPLICATECELL and HIDDENCELL. Cells that finer blocks cover (REFINEDCELL) aren't
// shown anyway.
constexpr std::int64_t vtkGhost = 1;
constexpr std::int64_t vtkHidden = 32;

void requireUniform(const Node& type) {
  const std::string text = type.text();
  if (text != "uniform") type.refuse("is '" + text + "'" + uniformOnly);
}

Node onlyTopology(const Node& domain) {
  const Node topologies = domain.at("topologies");
  const std::vector<Node> all = topologies.children();
  if (all.size() != 1) topologies.refuse("has " + std::to_string(all.size()) + " topologies, and not one");
  return all.front();
}

/// The number at that path; `otherwise` if there is none.
double numberOr(double otherwise, const Node& node, const std::string& path) {
  const std::optional<Node> found = node.find(path);
  return found ? found->number() : otherwise;
}

/// The domain's block, without ghost layers.
vdi_catalyst_block blockOf(const Node& domain, const Node& topology) {
  requireUniform(topology.at("type"));
  const Node coordset = domain.at("coordsets/" + topology.at("coordset").text());
  requireUniform(coordset.at("type"));
  vdi_catalyst_block block{};
  constexpr std::array<const char*, 3> dims{"dims/i", "dims/j", "dims/k"};
  constexpr std::array<const char*, 3> origins{"origin/x", "origin/y", "origin/z"};
  constexpr std::array<const char*, 3> spacings{"spacing/dx", "spacing/dy", "spacing/dz"};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::int64_t points = coordset.at(dims[axis]).whole();
    if (points < 2 || points > std::numeric_limits<std::int32_t>::max())
      coordset.at(dims[axis]).refuse("is " + std::to_string(points) + ": a block needs 2 points per axis");
    block.cells[axis] = static_cast<std::int32_t>(points - 1);
    block.origin[axis] = numberOr(0.0, coordset, origins[axis]);
    block.spacing[axis] = numberOr(1.0, coordset, spacings[axis]);
  }
  try {
    checkBlocks(1, &block);
  } catch (const std::invalid_argument& error) {
    coordset.refuse(std::string("isn't one: ") + error.what());
  }
  return block;
}

using Counts = std::array<std::int64_t, 3>;

Counts countsOf(const vdi_catalyst_block& block, std::int32_t association) {
  const int more = association == VDI_CATALYST_POINTS ? 1 : 0;
  return {std::int64_t{block.cells[0]} + more, std::int64_t{block.cells[1]} + more,
          std::int64_t{block.cells[2]} + more};
}

/// The field's elements that belong to a block: value (x, y, z) is element first + x * strides[0] + ...
struct Elements {
  std::int64_t first = 0;
  Counts strides{};
};

/// A field may give `offsets` and `strides` of its elements per axis, as in a halo. `count` elements exist in
/// all.
Elements elementsOf(const Node& field, const Counts& counts, std::int64_t count) {
  Elements elements{0, {1, counts[0], counts[0] * counts[1]}};
  const std::optional<Node> offsets = field.find("offsets");
  const std::optional<Node> strides = field.find("strides");
  if (!offsets && !strides) {
    const std::int64_t wanted = counts[0] * counts[1] * counts[2];
    if (count != wanted)
      field.refuse("has " + std::to_string(count) + " values, and not " + std::to_string(wanted));
    return elements;
  }
  std::int64_t last = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto numberOf = [&](const Node& node) {
      const Leaf leaf = node.leaf();
      if (!node.isWhole() || leaf.count != 3) node.refuse("isn't made of 3 whole numbers");
      const std::int64_t value = leaf.wholeAt(static_cast<std::int64_t>(axis));
      if (value < 0 || value > count) node.refuse("points outside the values");
      return value;
    };
    if (strides) elements.strides[axis] = numberOf(*strides);
    std::int64_t start = 0;
    std::int64_t length = 0;
    if (offsets && __builtin_mul_overflow(numberOf(*offsets), elements.strides[axis], &start))
      offsets->refuse("points outside the values");
    if (__builtin_mul_overflow(counts[axis] - 1, elements.strides[axis], &length) ||
        __builtin_add_overflow(start, length, &length) || __builtin_add_overflow(last, length, &last))
      field.refuse("points outside the values");
    elements.first += start;
  }
  if (last >= count) field.refuse("points outside its " + std::to_string(count) + " values");
  return elements;
}

std::optional<std::int32_t> associationOf(const Node& field) {
  const std::optional<Node> node = field.find("association");
  if (!node) return std::nullopt;
  const std::string text = node->text();
  if (text == "vertex") return VDI_CATALYST_POINTS;
  if (text == "element") return VDI_CATALYST_CELLS;
  return std::nullopt;
}

bool isGhostField(const std::string& name) {
  return std::ranges::find(ghostFields, name) != ghostFields.end();
}

/// The cells that aren't ghosts: their number, and the box around them.
struct Inside {
  std::int64_t count = 0;
  Counts low{std::numeric_limits<std::int64_t>::max(), std::numeric_limits<std::int64_t>::max(),
             std::numeric_limits<std::int64_t>::max()};
  Counts high{};  // past the last one

  void add(const Counts& cell) {
    ++count;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], cell[axis]);
      high[axis] = std::max(high[axis], cell[axis] + 1);
    }
  }
  bool isBox() const { return count == (high[0] - low[0]) * (high[1] - low[1]) * (high[2] - low[2]); }
};

/// A leaf's values on the host, and their memory if they had to be copied.
struct Readable {
  Leaf leaf;
  std::vector<std::byte> memory;
};

Readable readableOf(const Node& values, const Leaf& leaf, GpuMemory& gpuMemory) {
  Readable readable{leaf, {}};
  if (leaf.count == 0) return readable;
  const std::int64_t reach = (leaf.count - 1) * leaf.stride;
  const MemoryRange range{leaf.first + std::min<std::int64_t>(reach, 0),
                          static_cast<std::size_t>(std::abs(reach)) + leaf.scalarBytes};
  readable.memory.resize(range.bytes);
  try {
    gpuMemory.read(range, readable.memory.data());
  } catch (const std::invalid_argument& error) {
    values.refuse(error.what());
  }
  readable.leaf.first = readable.memory.data() + (leaf.first - range.begin);
  return readable;
}

Inside insideOf(const Node& field, const vdi_catalyst_block& block, GpuMemory& gpuMemory) {
  const Node values = field.at("values");
  const Readable readable = readableOf(values, values.leaf(), gpuMemory);
  const Leaf& marks = readable.leaf;
  const Counts counts = countsOf(block, VDI_CATALYST_CELLS);
  const Elements elements = elementsOf(field, counts, marks.count);
  const bool isVtk = field.name() == ghostFields[1];
  Inside inside;
  for (std::int64_t z = 0; z < counts[2]; ++z) {
    for (std::int64_t y = 0; y < counts[1]; ++y) {
      for (std::int64_t x = 0; x < counts[0]; ++x) {
        const std::int64_t mark = marks.wholeAt(elements.first + x * elements.strides[0] +
                                                y * elements.strides[1] + z * elements.strides[2]);
        if (isVtk ? (mark & vtkHidden) != 0 : mark != 0 && mark != 1)
          values.refuse("hides cells, which blocks can't");
        if (isVtk ? (mark & vtkGhost) == 0 : mark == 0) inside.add({x, y, z});
      }
    }
  }
  return inside;
}

/// Announces the layers that a field marks as ghosts. Returns false if all cells are ghosts.
bool addGhosts(const Node& domain, vdi_catalyst_block& block, GpuMemory& gpuMemory) {
  for (const char* name : ghostFields) {
    const std::optional<Node> field = domain.find(std::string("fields/") + name);
    if (!field || associationOf(*field) != VDI_CATALYST_CELLS) continue;
    const Inside inside = insideOf(*field, block, gpuMemory);
    if (inside.count == 0) return false;
    if (!inside.isBox()) field->refuse("marks cells that aren't whole layers at a block's sides");
    for (std::size_t axis = 0; axis < 3; ++axis) {
      block.ghost_lo[axis] = static_cast<std::int32_t>(inside.low[axis]);
      block.ghost_hi[axis] = static_cast<std::int32_t>(block.cells[axis] - inside.high[axis]);
    }
    return true;
  }
  return true;
}

/// The components of a field's values, of one type and with one number of values.
std::vector<Leaf> componentsOf(const Node& values) {
  std::vector<Leaf> all;
  for (const Node& component : values.children()) all.push_back(component.leaf());
  if (all.empty()) all.push_back(values.leaf());
  for (const Leaf& leaf : all) {
    if (leaf.type != all.front().type || leaf.count != all.front().count)
      values.refuse("has components of different types or lengths");
  }
  return all;
}

/// The numbers that stand for a field's missing values, by the names that netCDF and CF give them.
std::vector<double> missingOf(const Node& field) {
  std::vector<double> missing;
  for (const char* folder : {"", "attributes/", "metadata/"}) {
    for (const char* name : {"_FillValue", "missing_value"}) {
      const std::optional<Node> node = field.find(std::string(folder) + name);
      if (!node) continue;
      const Leaf numbers = node->leaf();
      for (std::int64_t i = 0; i < numbers.count; ++i) missing.push_back(numbers.at(i));
    }
  }
  if (missing.size() > static_cast<std::size_t>(maxMissing))
    field.refuse("has more than " + std::to_string(maxMissing) + " numbers for missing values");
  return missing;
}

/// Whether the distance from one component to the next is the same everywhere.
bool evenlySpaced(const std::vector<Leaf>& components) {
  const Leaf& first = components.front();
  const std::int64_t distance = components.size() > 1 ? components[1].first - first.first : 0;
  for (std::size_t c = 1; c < components.size(); ++c) {
    if (components[c].first - components[c - 1].first != distance || components[c].stride != first.stride)
      return false;
  }
  return true;
}

bool operator==(const vdi_catalyst_block& left, const vdi_catalyst_block& right) {
  return std::ranges::equal(left.cells, right.cells) && std::ranges::equal(left.ghost_lo, right.ghost_lo) &&
         std::ranges::equal(left.ghost_hi, right.ghost_hi) && std::ranges::equal(left.origin, right.origin) &&
         std::ranges::equal(left.spacing, right.spacing);
}

bool operator==(const vdi_catalyst_strides& left, const vdi_catalyst_strides& right) {
  return std::ranges::equal(left.strides, right.strides) && left.component_stride == right.component_stride;
}

bool sameArray(const Grid::Array& left, const Grid::Array& right) {
  const auto equal = [](const auto& one, const auto& other) { return one == other; };
  return left.type == right.type && left.data == right.data && left.missing == right.missing &&
         std::ranges::equal(left.strides, right.strides, equal);
}

}  // namespace

bool Grid::read(const std::optional<Node>& data) {
  const std::vector<vdi_catalyst_block> blocksBefore = std::exchange(blocks_, {});
  const std::map<Key, Array> arraysBefore = std::exchange(arrays_, {});
  copiesUsed_ = 0;
  leftOut_.clear();
  if (data) addDomains(*data, 0);
  leaveOutPartial();
  const auto sameBlock = [](const auto& left, const auto& right) { return left == right; };
  const auto sameEntry = [](const auto& left, const auto& right) {
    return left.first == right.first && sameArray(left.second, right.second);
  };
  return std::ranges::equal(blocks_, blocksBefore, sameBlock) &&
         std::ranges::equal(arrays_, arraysBefore, sameEntry);
}

void Grid::leaveOutPartial() {
  for (auto entry = arrays_.begin(); entry != arrays_.end();) {
    if (entry->second.data.size() == blocks_.size()) {
      ++entry;
    } else {
      leaveOut(std::get<std::string>(entry->first));
      entry = arrays_.erase(entry);
    }
  }
}

void Grid::leaveOut(const std::string& name) {
  if (std::ranges::find(leftOut_, name) == leftOut_.end()) leftOut_.push_back(name);
}

void Grid::addDomains(const Node& node, int depth) {
  constexpr int deepest = 2;
  if (node.has("coordsets") || node.has("topologies")) return addDomain(node);
  for (const Node& child : node.children()) {
    if (depth == deepest) child.refuse("is no domain of a mesh");
    addDomains(child, depth + 1);
  }
}

void Grid::addDomain(const Node& domain) {
  const Node topology = onlyTopology(domain);
  vdi_catalyst_block block = blockOf(domain, topology);
  if (!addGhosts(domain, block, gpuMemory_)) return;
  blocks_.push_back(block);
  const std::optional<Node> fields = domain.find("fields");
  if (!fields) return;
  for (const Node& field : fields->children()) {
    if (!isGhostField(field.name())) addField(field, block);
  }
}

void Grid::addField(const Node& field, const vdi_catalyst_block& block) {
  const std::optional<std::int32_t> association = associationOf(field);
  if (!association) field.refuse("has no association 'vertex' or 'element'");
  const Node values = field.at("values");
  const std::vector<Leaf> components = componentsOf(values);
  // vdi_catalyst.h doesn't take such an array. Other arrays still get frames.
  if (components.size() > maxComponents) return leaveOut(field.name());
  const Leaf& leaf = components.front();
  const Elements elements = elementsOf(field, countsOf(block, *association), leaf.count);
  const auto count = static_cast<std::int64_t>(components.size());
  const std::byte* first = leaf.first;
  std::int64_t stride = leaf.stride;
  std::int64_t componentStride = count > 1 ? components[1].first - leaf.first : 0;
  if (!evenlySpaced(components)) {
    first = copySideBySide(values, components);
    componentStride = static_cast<std::int64_t>(leaf.scalarBytes);
    stride = count * componentStride;
  }
  vdi_catalyst_strides strides{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (__builtin_mul_overflow(stride, elements.strides[axis], &strides.strides[axis]))
      values.refuse("has strides that lead beyond the address space");
  }
  strides.component_stride = componentStride;
  Array& array = arrays_[{*association, static_cast<std::int32_t>(count), field.name()}];
  // An array must have one type and be in each block; read() takes out the others.
  if (array.data.size() + 1 != blocks_.size() || (!array.data.empty() && array.type != leaf.type)) return;
  array.type = leaf.type;
  for (const double number : missingOf(field)) {
    if (std::ranges::find(array.missing, number) == array.missing.end()) array.missing.push_back(number);
  }
  array.data.push_back(first + elements.first * stride);
  array.strides.push_back(strides);
}

const std::byte* Grid::copySideBySide(const Node& values, const std::vector<Leaf>& components) {
  if (copiesUsed_ == copies_.size()) copies_.emplace_back();
  std::vector<std::byte>& copy = copies_[copiesUsed_++];
  const std::size_t scalar = components.front().scalarBytes;
  const std::size_t value = scalar * components.size();
  copy.resize(static_cast<std::size_t>(components.front().count) * value);
  for (std::size_t c = 0; c < components.size(); ++c) {
    const Readable readable = readableOf(values, components[c], gpuMemory_);
    const Leaf& leaf = readable.leaf;
    std::byte* to = copy.data() + c * scalar;
    for (std::int64_t i = 0; i < leaf.count; ++i, to += value)
      std::memcpy(to, leaf.first + i * leaf.stride, scalar);
  }
  return copy.data();
}

}  // namespace vdi::catalyst
