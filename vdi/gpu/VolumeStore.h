// A rank's blocks and the transfer table on the device. Blocks are packed into a few 3-D textures ("pages"),
// so that any number of them costs no descriptors. While one step's blocks are shown, the next one's can be
// on their way.
#pragma once

#include <array>
#include <cstdint>
#include <future>
#include <memory>
#include <span>
#include <vector>

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

class VolumeStore {
 public:
  explicit VolumeStore(std::shared_ptr<Device> device);
  ~VolumeStore();  // waits for blocks that are on their way
  VolumeStore(const VolumeStore&) = delete;
  VolumeStore& operator=(const VolumeStore&) = delete;
  VolumeStore(VolumeStore&&) = delete;
  VolumeStore& operator=(VolumeStore&&) = delete;

  /// Copies the scalars to the device; host data isn't needed afterwards. Pages are kept when the blocks'
  /// shapes and types are those of the last call. 8-bit data takes 1 byte a value (2 on a CPU device, whose
  /// 8-bit filter rounds to 8 bits), 16-bit data 2, all other types 4 (u32, i32 and f64 relative to the
  /// block's own range). Throws Error: OutOfMemory with figures; InvalidArgument for overlapping blocks or
  /// too many pages. After a throw the store is empty. Blocks on their way are dropped, with their memory.
  void setBlocks(std::span<const Block> blocks, const Scene& scene);

  /// Sends the next step's blocks on their way to memory of their own, in the background; those that are
  /// shown stay. Host data must stay as it is until awaitNext, or until another call of this or of setBlocks,
  /// which drops them. Throws as setBlocks does; then none are on their way.
  void setNextBlocks(std::span<const Block> blocks, const Scene& scene);
  /// Returns once they're there. Throws what went wrong on their way, and Error{InvalidArgument} if there are
  /// none.
  void awaitNext();
  /// Shows them. After awaitNext.
  void showNext();
  /// Waits until nothing is on its way any more, which can't be stopped, and forgets it.
  void dropNext();

  /// Cheap when the table is the one of the last call, and so is the length of its slabs, in unit distances.
  void setTable(const TransferTable& table, float slabLength);

  /// Of this rank's finite values.
  const ScalarRange& valueRange() const { return shown().range; }
  /// Whether there may be values that aren't finite.
  bool mayBeInfinite() const;
  /// Whether there are values outside of the table's range, infinite ones among them.
  bool reachesBeyondTable() const;
  bool empty() const { return shown().tree.empty(); }
  std::uint32_t nodeCount() const { return static_cast<std::uint32_t>(shown().tree.size()); }
  std::uint32_t tableSize() const { return static_cast<std::uint32_t>(table_.entries.size()); }
  VkDeviceAddress bricks() const { return shown().brickBuffer.address(); }
  VkDeviceAddress nodes() const { return shown().nodeBuffer.address(); }
  /// Of setTable.
  const SlabTable& slabTable() const { return slabTable_; }
  const SampledImage& slabs() const { return slabs_; }
  /// Macrocells, for the bricks' firstCell: 1 where the table makes anything visible.
  VkDeviceAddress cells() const { return shown().visibleBuffer.address(); }
  std::span<const SampledImage> pages() const { return shown().pages; }
  /// What the values take, those of a next step included.
  std::uint64_t texelBytesHeld() const;
  /// Which pages they are: descriptor sets that name others must be written again.
  std::uint64_t pagesVersion() const { return shown().pagesVersion; }
  /// Likewise of slabs.
  std::uint64_t slabsVersion() const { return slabsVersion_; }

 private:
  /// Pieces [first, last) are a block's.
  struct PieceRange {
    std::uint32_t first = 0;
    std::uint32_t last = 0;
  };

  /// The blocks of a time step.
  struct Step {
    std::vector<Block> blocks;  // until their values are copied
    std::vector<VolumePiece> pieces;
    std::vector<SampledImage> pages;
    std::uint64_t pagesVersion = 0;
    std::vector<shared::Brick> bricks;  // leaves; table fields are filled by placeTable
    std::vector<std::uint32_t> pieceOfBrick;
    std::vector<shared::KdNode> tree;
    std::vector<shared::CellPiece> cellPieces;  // of pieces; table fields are filled by placeTable
    std::uint32_t cellCount = 0;
    ScalarRange range;      // of finite values
    bool infinite = false;  // whether there are infinite ones
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
  void makePages(Step& step, std::vector<VolumePiece> pieces);
  void layBricks(Step& step, std::span<const PieceRange> piecesOf, const Scene& scene) const;
  void layCells(Step& step) const;
  void finish(Step& step);
  void uploadSlabs();
  void placeTable(Step& step);
  void runCells(Step& step, bool measure);
  ScalarRange rangeOf(const Step& step) const;

  std::shared_ptr<Device> device_;
  Commands commands_;
  VolumeUpload upload_;
  std::array<Step, 2> steps_;
  std::size_t shown_ = 0;
  std::future<void> onItsWay_;  // the next step's upload, if there is one
  std::uint64_t pagesVersions_ = 0;
  TransferTable table_;
  CellsPass cellsPass_;
  Buffer pieceRanges_;  // read back
  Buffer visibleBeforeBuffer_;
  SlabTable slabTable_;
  SampledImage slabs_;
  std::uint64_t slabsVersion_ = 0;
  Buffer slabStaging_;
};

}  // namespace vdi::gpu
