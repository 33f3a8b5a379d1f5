#include "vdi/gpu/VolumeStore.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <numeric>
#include <tuple>

#include "shaders/shared/cast.h"
#include "vdi/core/Error.h"
#include "vdi/gpu/Device.h"
#include "vdi/gpu/KdTree.h"

namespace vdi::gpu {

namespace {

/// Coordinates stay this many texels inside the outermost texel centres, two steps of a filter with 8-bit
/// weights: nearer, the filter would read texels of the neighbour in the page, if only with weight 0, and NaN
/// times 0 is NaN.
constexpr double filterGuard = 2.0 / 256.0;

std::uint64_t volumeOf(const glm::uvec3& extent) {
  return static_cast<std::uint64_t>(extent.x) * extent.y * extent.z;
}

/// Places boxes of one format into pages: rows of boxes along x, rows beside each other along y, layers on
/// top of each other along z. Boxes come in descending order of height, so blocks of one shape, the usual
/// case, waste next to nothing.
class Packer {
 public:
  Packer(std::uint32_t side, std::uint32_t maxDepth, std::uint64_t maxTexels)
      : side_(side), maxDepth_(std::min<std::uint64_t>(maxDepth, maxTexels / (std::uint64_t{side} * side))) {}

  /// False when the page is full.
  bool place(const glm::uvec3& dims, glm::uvec3& at) {
    if (cursor_.x + dims.x > side_) {
      cursor_ = {0, cursor_.y + rowHeight_, cursor_.z};
      rowHeight_ = 0;
    }
    if (cursor_.y + dims.y > side_) {
      cursor_ = {0, 0, cursor_.z + layerDepth_};
      rowHeight_ = 0;
      layerDepth_ = 0;
    }
    if (cursor_.z + dims.z > maxDepth_) return false;
    at = cursor_;
    cursor_.x += dims.x;
    rowHeight_ = std::max(rowHeight_, dims.y);
    layerDepth_ = std::max(layerDepth_, dims.z);
    used_ = glm::max(used_, at + dims);
    return true;
  }
  const glm::uvec3& used() const { return used_; }

 private:
  std::uint32_t side_;
  std::uint64_t maxDepth_;
  glm::uvec3 cursor_{0};
  std::uint32_t rowHeight_ = 0;
  std::uint32_t layerDepth_ = 0;
  glm::uvec3 used_{0};
};

}  // namespace

VolumeStore::VolumeStore(std::shared_ptr<Device> device)
    : device_(std::move(device)), commands_(device_), upload_(device_), cellsPass_(device_) {}

VkFormat VolumeStore::formatOf(ScalarType type) const {
  switch (sizeOf(type)) {
    case 1:
      return device_->isCpu() ? VK_FORMAT_R16_UNORM : VK_FORMAT_R8_UNORM;
    case 2:
      return VK_FORMAT_R16_UNORM;
    default:
      return VK_FORMAT_R32_SFLOAT;
  }
}

/// Pieces overlap by one value, so that each interpolates by itself.
std::vector<VolumePiece> VolumeStore::cut(const Block& block) const {
  const VkFormat format = formatOf(block.type);
  const std::uint64_t maxTexels = device_->limits().maxAllocationBytes / texelBytes(format) / 2;
  glm::uvec3 largest = glm::min(glm::uvec3(block.dims), glm::uvec3(device_->limits().maxImageDimension3D));
  while (volumeOf(largest) > maxTexels) {
    const int axis = largest.z >= largest.x && largest.z >= largest.y ? 2 : largest.y >= largest.x ? 1 : 0;
    largest[axis] = (largest[axis] + 1) / 2;
  }
  const ValueMap map = valueMapOf(block);
  std::vector<VolumePiece> pieces;
  const glm::ivec3 stride = glm::max(glm::ivec3(largest) - 1, glm::ivec3(1));
  for (int z = 0; z == 0 || z < block.dims.z - 1; z += stride.z) {
    for (int y = 0; y == 0 || y < block.dims.y - 1; y += stride.y) {
      for (int x = 0; x == 0 || x < block.dims.x - 1; x += stride.x) {
        const glm::ivec3 first{x, y, z};
        const glm::uvec3 dims = glm::min(largest, glm::uvec3(block.dims - first));
        pieces.push_back({&block, first, dims, format, 0, {}, map.scale, map.offset});
      }
    }
  }
  return pieces;
}

void VolumeStore::pack(std::vector<VolumePiece>& pieces) {
  const bool sameShapes =
      pieces.size() == pieces_.size() &&
      std::equal(pieces.begin(), pieces.end(), pieces_.begin(),
                 [](const VolumePiece& a, const VolumePiece& b) { return a.samePlaceAs(b); });
  if (sameShapes) {
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      pieces[i].page = pieces_[i].page;
      pieces[i].place = pieces_[i].place;
    }
    return;
  }
  pages_.clear();
  ++pagesVersion_;
  std::vector<std::size_t> order(pieces.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    const auto key = [&](std::size_t i) {
      return std::tuple(pieces[i].format, ~pieces[i].dims.z, ~pieces[i].dims.y, ~pieces[i].dims.x);
    };
    return key(a) < key(b);
  });
  for (std::size_t begin = 0; begin < order.size();) {
    const VkFormat format = pieces[order[begin]].format;
    std::size_t end = begin;
    std::uint64_t texels = 0;
    std::uint32_t widest = 1;
    for (; end < order.size() && pieces[order[end]].format == format; ++end) {
      const glm::uvec3& dims = pieces[order[end]].dims;
      texels += volumeOf(dims);
      widest = std::max({widest, dims.x, dims.y});
    }
    const auto cube = static_cast<std::uint32_t>(std::ceil(std::cbrt(static_cast<double>(texels))));
    const std::uint32_t side = std::min((std::max(cube, widest) + widest - 1) / widest * widest,
                                        device_->limits().maxImageDimension3D);
    const std::uint64_t maxTexels = device_->limits().maxAllocationBytes / texelBytes(format);
    while (begin < end) {
      Packer packer(side, device_->limits().maxImageDimension3D, maxTexels);
      const std::size_t pageBegin = begin;
      while (begin < end && packer.place(pieces[order[begin]].dims, pieces[order[begin]].place)) {
        pieces[order[begin]].page = static_cast<std::uint32_t>(pages_.size());
        ++begin;
      }
      if (begin == pageBegin || pages_.size() == shared::castMaxPages) {
        throw Error(ErrorCode::OutOfMemory,
                    fmt::format("{} MiB of volume don't fit {} textures", texels * texelBytes(format) >> 20,
                                shared::castMaxPages),
                    device_->name());
      }
      pages_.emplace_back(device_, packer.used(), format);
    }
  }
}

void VolumeStore::layBricks(std::span<const Block> blocks, std::span<const PieceRange> piecesOf,
                            const Scene& scene) {
  const glm::dvec3 center = scene.bounds.center();
  std::vector<shared::Brick> bricks;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const Block& block = blocks[i];
    for (std::uint32_t index = piecesOf[i].first; index < piecesOf[i].last; ++index) {
      const VolumePiece& piece = pieces_[index];
      shared::Brick brick{};
      brick.page = piece.page;
      brick.piece = index;
      const glm::dvec3 extent = glm::dvec3(pages_[piece.page].extent());
      const glm::dvec3 pieceOrigin = block.origin + glm::dvec3(piece.first) * block.spacing;
      for (int axis = 0; axis < 3; ++axis) {
        // An owned box may reach beyond the outermost values (cells do); only inner cuts bound a piece.
        double lo = block.owned.lo[axis];
        double hi = block.owned.hi[axis];
        if (piece.first[axis] > 0) lo = std::max(lo, pieceOrigin[axis]);
        const auto end = piece.first[axis] + static_cast<int>(piece.dims[axis]);
        if (end < block.dims[axis])
          hi = std::min(hi, pieceOrigin[axis] + (piece.dims[axis] - 1) * block.spacing[axis]);
        brick.lo[axis] = snapToScene(scene, lo, axis);
        brick.hi[axis] = snapToScene(scene, hi, axis);
        const double scale = 1.0 / (block.spacing[axis] * extent[axis]);
        brick.texelScale[axis] = static_cast<float>(scale);
        brick.texelOffset[axis] = static_cast<float>((center[axis] - pieceOrigin[axis]) * scale +
                                                     (piece.place[axis] + 0.5) / extent[axis]);
        const double edge = piece.dims[axis] > 1 ? 0.5 + filterGuard : 0.5;
        brick.texelLo[axis] = static_cast<float>((piece.place[axis] + edge) / extent[axis]);
        brick.texelHi[axis] =
            static_cast<float>((piece.place[axis] + piece.dims[axis] - edge) / extent[axis]);
        brick.cellScale[axis] = static_cast<float>(extent[axis] / shared::cellSide);
        brick.cellOffset[axis] = static_cast<float>(-(piece.place[axis] + 0.5) / shared::cellSide);
      }
      brick.firstCell = cellPieces_[index].firstCell;
      brick.cellDims = cellPieces_[index].cellDims;
      if (glm::all(glm::lessThan(brick.lo, brick.hi))) bricks.push_back(brick);
    }
  }
  KdTree tree = buildKdTree(std::move(bricks));
  tree_ = std::move(tree.nodes);
  bricks_ = std::move(tree.bricks);
  pieceOfBrick_.clear();
  for (const shared::Brick& brick : bricks_) pieceOfBrick_.push_back(brick.piece);
  nodeBuffer_.reserve(device_, std::span(tree_).size_bytes(), MemoryKind::Upload);
  if (!tree_.empty()) std::memcpy(nodeBuffer_.mapped().data(), tree_.data(), std::span(tree_).size_bytes());
}

void VolumeStore::setBlocks(std::span<const Block> blocks, const Scene& scene) {
  validate(blocks);
  tree_.clear();
  bricks_.clear();
  try {
    std::vector<VolumePiece> pieces;
    std::vector<PieceRange> piecesOf;  // of each block
    // Blocks that share their values (the parts of a box with holes) share their pieces.
    std::map<std::tuple<const void*, double, double, double>, PieceRange> known;
    for (const Block& block : blocks) {
      PieceRange range;
      if (!block.owned.empty()) {
        const std::tuple key(block.data, block.origin.x, block.origin.y, block.origin.z);
        const auto [place, isNew] = known.try_emplace(key);
        if (isNew) {
          const std::vector<VolumePiece> parts = cut(block);
          place->second.first = static_cast<std::uint32_t>(pieces.size());
          pieces.insert(pieces.end(), parts.begin(), parts.end());
          place->second.last = static_cast<std::uint32_t>(pieces.size());
        }
        range = place->second;
      }
      piecesOf.push_back(range);
    }
    pack(pieces);
    pieces_ = std::move(pieces);
    if (!pieces_.empty()) upload_.run(pieces_, pages_);
    layCells();
    layBricks(blocks, piecesOf, scene);
    if (!table_.entries.empty()) placeTable();
  } catch (...) {
    pages_.clear();
    pieces_.clear();
    tree_.clear();
    bricks_.clear();
    cellPieces_.clear();
    cellCount_ = 0;
    ++pagesVersion_;
    throw;
  }
  for (VolumePiece& piece : pieces_) piece.block = nullptr;  // not ours beyond this call
}

/// Macrocells of all pieces, and the ranges of values in them.
void VolumeStore::layCells() {
  cellPieces_.clear();
  std::uint64_t cells = 0;
  for (const VolumePiece& piece : pieces_) {
    shared::CellPiece cellPiece{};
    cellPiece.place = piece.place;
    cellPiece.page = piece.page;
    cellPiece.dims = piece.dims;
    cellPiece.firstCell = static_cast<std::uint32_t>(cells);
    // A cell lies between texel centres.
    const glm::uvec3 gaps = glm::max(piece.dims, glm::uvec3(2)) - 1U;
    cellPiece.cellDims = (gaps + shared::cellSide - 1U) / shared::cellSide;
    cells += volumeOf(cellPiece.cellDims);
    cellPieces_.push_back(cellPiece);
  }
  if (cells > std::numeric_limits<std::uint32_t>::max()) {
    throw Error(ErrorCode::OutOfMemory, fmt::format("{} macrocells in one rank's blocks", cells),
                device_->name());
  }
  cellCount_ = static_cast<std::uint32_t>(cells);
  if (cellCount_ == 0) return;
  rangeBuffer_.reserve(device_, cells * sizeof(glm::vec2), MemoryKind::DeviceLocal);
  visibleBuffer_.reserve(device_, cells * sizeof(std::uint32_t), MemoryKind::DeviceLocal);
  runCells(shared::cellsModeMeasure);
}

void VolumeStore::runCells(std::uint32_t mode) {
  const auto bytes = std::span(cellPieces_).size_bytes();
  cellPieceBuffer_.reserve(device_, bytes, MemoryKind::Upload);
  std::memcpy(cellPieceBuffer_.mapped().data(), cellPieces_.data(), bytes);
  shared::CellsConstants constants{};
  constants.pieces = cellPieceBuffer_.address();
  constants.ranges = rangeBuffer_.address();
  constants.visible = visibleBuffer_.address();
  constants.visibleBefore = visibleBeforeBuffer_.address();
  constants.pieceCount = static_cast<std::uint32_t>(cellPieces_.size());
  constants.cellCount = cellCount_;
  constants.tableSize = tableSize();
  constants.mode = mode;
  commands_.begin();
  cellsPass_.record(commands_, constants, pages_, pagesVersion_);
  commands_.submitAndWait();
}

void VolumeStore::setTable(const TransferTable& table) {
  if (table_ == table) return;
  table_ = table;
  visibleBeforeBuffer_.reserve(device_, (table_.entries.size() + 1) * sizeof(std::uint32_t),
                               MemoryKind::Upload);
  const auto visibleBefore = visibleBeforeBuffer_.mappedAs<std::uint32_t>();
  visibleBefore[0] = 0;
  for (std::size_t i = 0; i < table_.entries.size(); ++i) {
    visibleBefore[i + 1] = visibleBefore[i] + (table_.entries[i].extinction > 0.0F ? 1 : 0);
  }
  const auto bytes = std::span(table_.entries).size_bytes();
  tableBuffer_.reserve(device_, bytes, MemoryKind::Upload);
  std::memcpy(tableBuffer_.mapped().data(), table_.entries.data(), bytes);
  placeTable();
}

void VolumeStore::placeTable() {
  const double perScalar = static_cast<double>(table_.entries.size() - 1) / (table_.max - table_.min);
  for (std::size_t i = 0; i < bricks_.size(); ++i) {
    const VolumePiece& piece = pieces_[pieceOfBrick_[i]];
    bricks_[i].tableOrigin = static_cast<float>((table_.min - piece.valueOffset) / piece.valueScale);
    bricks_[i].tableScale = static_cast<float>(piece.valueScale * perScalar);
  }
  for (std::size_t i = 0; i < cellPieces_.size(); ++i) {
    cellPieces_[i].tableOrigin =
        static_cast<float>((table_.min - pieces_[i].valueOffset) / pieces_[i].valueScale);
    cellPieces_[i].tableScale = static_cast<float>(pieces_[i].valueScale * perScalar);
  }
  if (cellCount_ > 0) runCells(shared::cellsModeClassify);
  brickBuffer_.reserve(device_, std::span(bricks_).size_bytes(), MemoryKind::Upload);
  if (!bricks_.empty())
    std::memcpy(brickBuffer_.mapped().data(), bricks_.data(), std::span(bricks_).size_bytes());
}

}  // namespace vdi::gpu
