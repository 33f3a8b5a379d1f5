// Blocks: the pieces of volume that a rank holds.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "vdi/core/Box.h"
#include "vdi/core/ScalarRange.h"
#include "vdi/core/ScalarType.h"
#include "vdi/core/Strides.h"

namespace vdi {

/// Number of layers of stored values beyond the owned ones, per axis and side.
struct GhostLayers {
  glm::ivec3 lo{0};
  glm::ivec3 hi{0};
  bool operator==(const GhostLayers&) const = default;
};

struct Block;

/// Values that extend the stored ones or replace some of them: an array, or stored values of another block of
/// the same scalar type, which are read where they lie.
struct Patch {
  IndexBox box;  // indices relative to the first stored value; may reach outside [0, dims)
  std::shared_ptr<const void> values{};  // [size.z][size.y][size.x], x fastest, of the block's scalar type
  std::shared_ptr<const Block> donor{};  // used if `values` is null
  glm::ivec3 shift{0};                   // added to an index, gives that in the donor

  /// Copies the values of a part of the box to places that lie `strides` apart, of any alignment.
  void copyTo(ScalarType type, const IndexBox& part, void* to, const ByteStrides& strides) const;
};

/// The stored values of a block that the data consist of. Others lie in ghost layers, are covered by finer
/// blocks, or have no meaning.
struct OwnValues {
  std::vector<IndexBox> boxes;  // they may overlap
  IndexBox used;                // bounds of all values that interpolation uses
};

/// Stored values that are computed whenever they are read, so that no array of them exists.
class ComputedValues {
 public:
  ComputedValues() = default;
  virtual ~ComputedValues() = default;
  ComputedValues(const ComputedValues&) = delete;
  ComputedValues& operator=(const ComputedValues&) = delete;
  ComputedValues(ComputedValues&&) = delete;
  ComputedValues& operator=(ComputedValues&&) = delete;
  /// Writes the values of a box, [size.z][size.y][size.x], x fastest, of the block's type, to memory that is
  /// aligned for them. Any thread may call it, and several may at once. Throws nothing.
  virtual void read(const IndexBox& box, void* to) const = 0;
};

/// One axis-aligned lattice of scalars. Values are interpolated trilinearly between lattice points and
/// clamped beyond the outermost ones. `owned` says which samples belong to this block. The owned boxes of all
/// blocks of all ranks must not overlap (they are half-open, so touching is fine), unless their spacings
/// differ: then the finest block owns the common part. VdiGenerator::setBlocks establishes both. It throws
/// Error{InvalidArgument} on all ranks if blocks of one spacing overlap by more than 1e-3 of it.
///
/// A block has values at the indices [-extra.lo, dims + extra.hi): the stored ones and the layers around
/// them. Patches cover all of these layers, and may cover stored values too. A patch overrides the stored
/// values, and a later patch overrides an earlier one.
///
/// Several blocks may share data, each owning a part of it; then they share extra and patches too.
///
/// Stored values are an array packed at `data`, unless either `strides` or `computed` is set; they are never
/// both set. Readers call copyTo, which handles all three cases, or read the array if isPacked returns true.
///
/// Ownership of memory: the core reads `data` and never copies it on the host. `keepAlive`, if set, owns it.
struct Block {
  glm::ivec3 dims{0};       // stored values per axis, ghost layers included; each >= 1
  glm::dvec3 origin{0.0};   // world position of value (0, 0, 0); for cell data the centre of that cell
  glm::dvec3 spacing{1.0};  // world distance of neighbouring values, > 0
  Box owned{};              // world; half-open
  ScalarType type = ScalarType::F32;
  /// The first value, in native byte order. Packed, the values are [dims.z][dims.y][dims.x], x fastest, and
  /// `data` is aligned for the type. Computed values lie elsewhere; `data` then only tells which blocks share
  /// values.
  const void* data = nullptr;
  std::shared_ptr<const void> keepAlive{};
  GhostLayers extra{};                                  // layers of values beyond the stored ones, >= 0
  std::shared_ptr<const std::vector<Patch>> patches{};  // null: none
  /// Stored values without meaning, such as those of hidden points and refined cells. Where interpolation
  /// would mix them with other values, the exchange of ghost layers replaces them. Null: none.
  std::shared_ptr<const std::vector<IndexBox>> masked{};
  /// Null: those in the owned box, except for masked ones. The exchange of ghost layers sets it.
  std::shared_ptr<const OwnValues> ownValues{};
  std::optional<ByteStrides> strides{};  // where the values lie from `data` on; any alignment
  std::shared_ptr<const ComputedValues> computed{};
  /// For Interpolation::Nearest: the exchange of ghost layers takes the nearest of the neighbours' values
  /// where it would else mix several. Equal for all blocks of all ranks.
  bool nearest = false;
  /// Offset of the values, in spacings, from the grid's points or cell centres. `origin` includes it.
  glm::dvec3 offset{0.0};

  /// Values of the same type that give the colours, where `data` gives the opacities: one block, whose values
  /// the transfer function colours, or three, which are red, green and blue. Of each, only type, data,
  /// strides, computed, keepAlive and displayed count; VdiGenerator::setBlocks sets the rest. Empty: `data`
  /// gives both. All blocks of all ranks have as many.
  std::vector<Block> colors{};
  glm::dvec2 displayed{0.0, 1.0};  // of red, green or blue: the values without light and in full light

  IndexBox stored() const { return {glm::ivec3(0), dims}; }
  IndexBox extended() const { return {-extra.lo, dims + extra.hi}; }
  std::span<const Patch> patchList() const {
    return patches ? std::span<const Patch>(*patches) : std::span<const Patch>();
  }
  std::size_t valueCount() const {
    return static_cast<std::size_t>(dims.x) * static_cast<std::size_t>(dims.y) *
           static_cast<std::size_t>(dims.z);
  }
  std::size_t byteCount() const { return valueCount() * sizeOf(type); }
  /// Boxes of the block's own values.
  std::vector<IndexBox> ownBoxes() const;
  /// Indices of the stored points in the box, including those on its faces, or of the stored cells in it.
  IndexBox valuesIn(const Box& box) const;
  bool isPacked() const { return !strides && !computed; }
  /// Moves the values, as staggered grids need, by a distance in spacings. The owned box stays.
  void moveValues(const glm::dvec3& spacings);
  /// Sets the strides of the values. Drops them if the values are packed and aligned.
  void setStrides(const ByteStrides& bytes);
  /// A block of the same lattice with the values of colors[index].
  Block withColors(std::size_t index) const;
  /// Copies the stored values of a box within stored(), [size.z][size.y][size.x], to memory that is aligned
  /// for them.
  void copyTo(const IndexBox& box, void* to) const;
  /// Copies them to places that lie `strides` apart, which need not be aligned.
  void copyTo(const IndexBox& box, void* to, const ByteStrides& strides) const;
  /// Divides a box into tiles that copyTo can copy one by one into a reused buffer that fits the cache.
  Tiling tilesOf(const IndexBox& box) const;

  /// Point data: `origin` is the position of the first stored point. The block owns the volume from the first
  /// to the last non-ghost point.
  static Block fromPoints(const glm::ivec3& dims, const glm::dvec3& origin, const glm::dvec3& spacing,
                          ScalarType type, const void* data, const GhostLayers& ghosts = {});
  /// Cell data: `dims` counts stored cells, `origin` is the lower corner of the first stored cell. The block
  /// owns all non-ghost cells.
  static Block fromCells(const glm::ivec3& dims, const glm::dvec3& origin, const glm::dvec3& spacing,
                         ScalarType type, const void* data, const GhostLayers& ghosts = {});
};

/// Memory for the values of a tile of Block::tilesOf, of any type.
struct TileBuffer {
  alignas(64) std::array<std::byte, Tiling::values * sizeof(double)> bytes;
};

/// Value (i, j, k) of a block as double, indices in block.extended(). Slow: for tests, reference
/// code and metadata.
double valueAt(const Block& block, int i, int j, int k);
/// The stored value at `at` as double, indices in block.stored(). Patches may override it. Slow like valueAt.
double storedValueAt(const Block& block, const glm::ivec3& at);

/// Value number `index` of an array of the type.
double loadValue(ScalarType type, const void* data, std::size_t index);
/// Stores the nearest value that the type can represent; integers take 0 for NaN.
void storeValue(ScalarType type, void* data, std::size_t index, double value);

/// Ranges of finite values.
struct FiniteRanges {
  ScalarRange own;
  ScalarRange used;  // of own values, of other stored ones that interpolation uses, and of patches
  bool operator==(const FiniteRanges&) const = default;
};
/// `own` are the own values of all blocks that share this one's. Uses several threads.
FiniteRanges finiteRanges(const Block& block, std::span<const IndexBox> own);
ScalarRange ownRange(const Block& block);  // the range of its own finite values

/// Range of magnitudes that the device can represent. If all values are smaller than `minimum`, they are
/// lost; values larger than `maximum` overflow. Applies to f32 and f64; the other types have no such values.
struct ValueLimits {
  double minimum = 0.0;
  double maximum = std::numeric_limits<double>::infinity();
};
ValueLimits limitsOf(ScalarType type);

/// Whether some finite value has a usable magnitude, and whether some value is nonzero but too small. The
/// search stops at the first usable value.
struct ValueSizes {
  bool usable = false;
  bool tooSmall = false;
};
ValueSizes valueSizesOf(std::span<const Block> blocks);

/// Throws Error{InvalidArgument} naming the block's index for: dims < 1; spacing outside [1e-30, 1e30]; an
/// origin or owned box that is not finite, or lies more than 1e12 spacings away from 0, where doubles no
/// longer resolve positions; null data. A block with an empty owned box is legal and owns no sample.
void validate(std::span<const Block> blocks);

}  // namespace vdi
