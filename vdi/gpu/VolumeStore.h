// A rank's blocks and the transfer table on the device. Blocks are packed into a few 3-D textures ("pages"),
// so that any number of them costs no descriptors.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "shaders/shared/volume.h"
#include "vdi/core/Block.h"
#include "vdi/core/Scene.h"
#include "vdi/core/TransferFunction.h"
#include "vdi/gpu/CellsPass.h"
#include "vdi/gpu/Commands.h"
#include "vdi/gpu/Memory.h"
#include "vdi/gpu/VolumeUpload.h"

namespace vdi::gpu {

class Device;

class VolumeStore {
 public:
  explicit VolumeStore(std::shared_ptr<Device> device);

  /// Copies the scalars to the device; host data isn't needed afterwards. Pages are kept when the blocks'
  /// shapes and types are those of the last call. 8-bit data takes 1 byte a value (2 on a CPU device, whose
  /// 8-bit filter rounds to 8 bits), 16-bit data 2, all other types 4 (u32, i32 and f64 relative to the
  /// block's own range). Throws Error: OutOfMemory with figures; InvalidArgument for overlapping blocks or
  /// too many pages. After a throw the store is empty.
  void setBlocks(std::span<const Block> blocks, const Scene& scene);

  /// Cheap when the table is the one of the last call.
  void setTable(const TransferTable& table);

  bool empty() const { return tree_.empty(); }
  std::uint32_t nodeCount() const { return static_cast<std::uint32_t>(tree_.size()); }
  std::uint32_t tableSize() const { return static_cast<std::uint32_t>(table_.entries.size()); }
  VkDeviceAddress bricks() const { return brickBuffer_.address(); }
  VkDeviceAddress nodes() const { return nodeBuffer_.address(); }
  VkDeviceAddress table() const { return tableBuffer_.address(); }
  /// Macrocells, for the bricks' firstCell: 1 where the table makes anything visible.
  VkDeviceAddress cells() const { return visibleBuffer_.address(); }
  std::span<const Image3D> pages() const { return pages_; }
  /// Changes whenever pages were made anew: descriptor sets that name them must be written again.
  std::uint64_t pagesVersion() const { return pagesVersion_; }

 private:
  /// Pieces [first, last) are a block's.
  struct PieceRange {
    std::uint32_t first = 0;
    std::uint32_t last = 0;
  };

  VkFormat formatOf(ScalarType type) const;
  std::vector<VolumePiece> cut(const Block& block) const;
  void pack(std::vector<VolumePiece>& pieces);
  void layBricks(std::span<const Block> blocks, std::span<const PieceRange> piecesOf, const Scene& scene);
  void layCells();
  void placeTable();
  void runCells(std::uint32_t mode);

  std::shared_ptr<Device> device_;
  Commands commands_;
  VolumeUpload upload_;
  std::vector<Image3D> pages_;
  std::uint64_t pagesVersion_ = 0;
  std::vector<VolumePiece> pieces_;
  std::vector<shared::Brick> bricks_;  // leaves; table fields are filled by placeTable
  std::vector<std::uint32_t> pieceOfBrick_;
  std::vector<shared::KdNode> tree_;
  std::vector<shared::CellPiece> cellPieces_;  // of pieces_; table fields are filled by placeTable
  std::uint32_t cellCount_ = 0;
  TransferTable table_;
  CellsPass cellsPass_;
  Buffer cellPieceBuffer_;
  Buffer rangeBuffer_;
  Buffer visibleBuffer_;
  Buffer visibleBeforeBuffer_;
  Buffer brickBuffer_;
  Buffer nodeBuffer_;
  Buffer tableBuffer_;
};

}  // namespace vdi::gpu
