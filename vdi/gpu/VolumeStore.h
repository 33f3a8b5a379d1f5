// A rank's blocks and the transfer table on the device. Blocks are packed into a few 3-D textures ("pages"),
// so their number costs no descriptors. While one step's blocks are shown, the next step's can be on their
// way.
#pragma once

#include <array>
#include <cstdint>
#include <future>
#include <memory>
#include <span>
#include <vector>

#include "shaders/shared/cells.h"
#include "shaders/shared/volume.h"
#include "vdi/core/Block.h"
#include "vdi/core/Scene.h"
#include "vdi/core/SlabTable.h"
#include "vdi/core/TransferFunction.h"
#include "vdi/gpu/CellsPass.h"
#include "vdi/gpu/Commands.h"
#include "vdi/gpu/Memory.h"
#include "vdi/gpu/VolumePages.h"
#include "vdi/gpu/VolumeUpload.h"

namespace vdi::gpu {

/// A block's pieces are [first, last).
struct PieceRange {
  std::uint32_t first = 0;
  std::uint32_t last = 0;
};

class VolumeStore {
 public:
  explicit VolumeStore(std::shared_ptr<Device> device);
  ~VolumeStore();  // waits for pending uploads
  VolumeStore(const VolumeStore&) = delete;
  VolumeStore& operator=(const VolumeStore&) = delete;
  VolumeStore(VolumeStore&&) = delete;
  VolumeStore& operator=(VolumeStore&&) = delete;

  /// Copies the scalars to the device; host data is not needed afterwards. Keeps the pages if the blocks'
  /// shapes and types are those of the last call. A value takes 1 byte if it has 8 bits (2 on a CPU device,
  /// whose 8-bit filter rounds to 8 bits), 2 bytes if it has 16, and else 4 (u32, i32 and f64 relative to the
  /// block's own range). Throws Error: OutOfMemory with figures; InvalidArgument for overlapping blocks or
  /// too many pages. After a throw the store is empty. Drops pending uploads, with their memory.
  void setBlocks(std::span<const Block> blocks, const Scene& scene);

  /// Starts to send the next step's blocks to memory of their own, in the background; the blocks shown stay.
  /// Host data must stay unchanged until awaitNext, or until another call of this or of setBlocks, which
  /// drops them. Throws as setBlocks does; then no upload is pending.
  void setNextBlocks(std::span<const Block> blocks, const Scene& scene);
  /// Waits for the next blocks. Throws the error that stopped them, and Error{InvalidArgument} if none are on
  /// their way.
  void awaitNext();
  /// Shows the next blocks. Call after awaitNext.
  void showNext();
  /// Waits until no upload is pending any more, since an upload cannot be stopped, and drops the next
  /// blocks.
  void dropNext();

  /// Sets the transfer table and the length of its slabs, in unit distances. Cheap if both are those of the
  /// last call.
  void setTable(const TransferTable& table, float slabLength);

  /// The ranges of this rank's values. `used` may include values that interpolation doesn't use.
  const FiniteRanges& valueRanges() const { return shown().ranges; }
  /// Whether some values may not be finite.
  bool mayBeInfinite() const;
  /// Whether some values, including infinite ones, lie outside the table's range.
  bool reachesBeyondTable() const;
  bool empty() const { return shown().tree.empty(); }
  std::uint32_t nodeCount() const { return static_cast<std::uint32_t>(shown().tree.size()); }
  /// The transfer function's pieces, their starts, and their number, which is 0 if it has entries.
  VkDeviceAddress tablePieces() const { return pieceBuffer_.address(); }
  VkDeviceAddress pieceStarts() const { return pieceStartBuffer_.address(); }
  std::uint32_t pieceCount() const { return static_cast<std::uint32_t>(table_.pieces.size()); }
  VkDeviceAddress bricks() const { return shown().brickBuffer.address(); }
  VkDeviceAddress nodes() const { return shown().nodeBuffer.address(); }
  /// The slab table that setTable made.
  const SlabTable& slabTable() const { return slabTable_; }
  const SampledImage& slabs() const { return slabs_; }
  /// Macrocells, indexed from the bricks' firstCell on: 1 if the table makes any of their values visible.
  VkDeviceAddress cells() const { return shown().visibleBuffer.address(); }
  /// Smallest and largest texel of each macrocell, with the same indices; inverted where all are NaN.
  VkDeviceAddress cellRanges() const { return shown().rangeBuffer.address(); }
  std::span<const SampledImage> pages() const { return shown().pages; }
  /// The number of values that give a place its colour (Block::colors); each has as many pages as the values.
  std::uint32_t colors() const { return shown().colors; }
  /// Bytes of all values' texels, those of a next step included.
  std::uint64_t texelBytesHeld() const;
  /// Version of the pages: when it changes, descriptor sets that name them must be written again.
  std::uint64_t pagesVersion() const { return shown().pagesVersion; }
  /// Version of the slab texture, with the same meaning.
  std::uint64_t slabsVersion() const { return slabsVersion_; }

 private:
  /// The blocks of a time step.
  struct Step {
    std::vector<Block> blocks;  // kept until their values are copied
    std::vector<VolumePiece> pieces;
    /// All values to upload: those of `pieces`, then for each of Block::colors the same pieces again, in
    /// pages of the same shapes that follow.
    std::vector<VolumePiece> uploads;
    std::uint32_t colors = 0;  // number of Block::colors
    std::vector<SampledImage> pages;
    std::uint64_t pagesVersion = 0;
    std::vector<shared::Brick> bricks;  // leaves; placeTable sets the table fields
    std::vector<std::uint32_t> pieceOfBrick;
    std::vector<shared::KdNode> tree;
    std::vector<shared::CellPiece> cellPieces;  // one per piece; placeTable sets the table fields
    std::uint32_t cellCount = 0;
    FiniteRanges ranges;
    bool infinite = false;                    // whether some values are infinite
    std::vector<shared::TexelBox> ownTexels;  // of all pieces, one piece's after the other's
    Buffer ownTexelsBuffer;
    Buffer cellPieceBuffer;
    Buffer rangeBuffer;
    Buffer pieceRangeBuffer;
    Buffer visibleBuffer;
    Buffer brickBuffer;
    Buffer nodeBuffer;
  };

  const Step& shown() const { return steps_[shown_]; }
  Step& next() { return steps_[1 - shown_]; }
  void lay(Step& step, std::span<const Block> blocks, const Scene& scene);
  void makePages(Step& step, std::vector<VolumePiece> pieces, std::uint32_t colors);
  static void layColors(Step& step);
  void layBricks(Step& step, std::span<const PieceRange> piecesOf, const Scene& scene) const;
  void layCells(Step& step) const;
  void finish(Step& step);
  void uploadSlabs();
  void uploadPieces();
  bool hasTable() const { return !table_.entries.empty() || !table_.pieces.empty(); }
  void placeTable(Step& step);
  void runCells(Step& step, bool measure);
  FiniteRanges rangesOf(const Step& step) const;

  std::shared_ptr<Device> device_;
  Commands commands_;
  VolumeUpload upload_;
  std::array<Step, 2> steps_;
  std::size_t shown_ = 0;
  std::future<void> onItsWay_;  // the next step's upload, if any
  std::uint64_t pagesVersions_ = 0;
  TransferTable table_;
  CellsPass cellsPass_;
  Buffer pieceRanges_;  // ranges read back from the device
  Buffer visibleBeforeBuffer_;
  Buffer pieceBuffer_;
  Buffer pieceStartBuffer_;
  SlabTable slabTable_;
  SampledImage slabs_;
  std::uint64_t slabsVersion_ = 0;
  Buffer slabStaging_;
};

}  // namespace vdi::gpu
