#include "vdi/gpu/VolumeStore.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <optional>
#include <tuple>
#include <utility>

#include "shaders/shared/cast.h"
#include "shaders/shared/slab.h"
#include "vdi/core/BitCast.h"
#include "vdi/core/Error.h"
#include "vdi/core/Parallel.h"
#include "vdi/gpu/KdTree.h"

namespace vdi::gpu {

namespace {

/// Coordinates stay this many texels inside the outermost texel centres, two steps of a filter with 8-bit
/// weights. Closer to the edge, the filter would read texels of the page's neighbouring piece, if only with
/// weight 0, and NaN times 0 is NaN.
constexpr double filterGuard = 2.0 / 256.0;

/// Smallest value, largest value with its bits inverted, both for all values and for own ones, and whether
/// there are infinite values, as cells.comp writes them.
using PieceRangeBits = std::array<std::uint32_t, shared::pieceRangeWords>;

float fromOrdered(std::uint32_t bits) {
  return bit_cast<float>((bits >> 31U) != 0 ? bits & 0x7FFFFFFFU : ~bits);
}

using ValuesKey = std::tuple<const void*, std::array<std::int64_t, 3>, const void*, std::array<double, 3>>;

/// Equal for blocks that share values.
ValuesKey keyOf(const Block& block) {
  const ByteStrides strides = block.strides.value_or(ByteStrides(0));
  return {block.data,
          {strides.x, strides.y, strides.z},
          block.patches.get(),
          {block.origin.x, block.origin.y, block.origin.z}};
}

/// Blocks that share values (the parts of a box with holes) share their pieces.
struct SharedValues {
  std::vector<IndexBox> own;  // own values of any of these blocks
  const OwnValues* last = nullptr;
  const Block* block = nullptr;  // the first of them
  std::vector<VolumePiece> cut;
  std::optional<PieceRange> pieces;

  void addOwn(const Block& of) {
    if (block == nullptr) block = &of;
    if (of.ownValues && of.ownValues.get() == last) return;
    last = of.ownValues.get();
    const std::vector<IndexBox> boxes = of.ownBoxes();
    own.insert(own.end(), boxes.begin(), boxes.end());
  }
};

/// Cuts the blocks, which may take a pass over their values for ranges. Threads share blocks if there are
/// enough of them, and else each block's values.
void cutAll(const Device& device, std::map<ValuesKey, SharedValues>& known) {
  std::vector<SharedValues*> all;
  all.reserve(known.size());
  for (auto& [key, values] : known) all.push_back(&values);
  const auto cut = [&](std::size_t i) { all[i]->cut = cutToPieces(device, *all[i]->block, all[i]->own); };
  if (all.size() >= usableCores()) return eachInParallel(all.size(), cut);
  for (std::size_t i = 0; i < all.size(); ++i) cut(i);
}

/// Adds the boxes of a piece's own texels, and notes their places in the piece.
void addOwnTexels(std::vector<shared::TexelBox>& texels, VolumePiece& piece, std::span<const IndexBox> own) {
  piece.firstOwn = static_cast<std::uint32_t>(texels.size());
  for (const IndexBox& box : own) {
    const IndexBox part = box.intersection(piece.box());
    if (!part.empty())
      texels.push_back({glm::uvec3(part.lo - piece.first), glm::uvec3(part.hi - piece.first)});
  }
  piece.ownCount = static_cast<std::uint32_t>(texels.size()) - piece.firstOwn;
}

}  // namespace

VolumeStore::VolumeStore(std::shared_ptr<Device> device)
    : device_(std::move(device)), commands_(device_), upload_(device_), cellsPass_(device_) {}

VolumeStore::~VolumeStore() {
  dropNext();
}

void VolumeStore::setBlocks(std::span<const Block> blocks, const Scene& scene) {
  dropNext();
  next() = {};
  Step& step = steps_[shown_];
  try {
    lay(step, blocks, scene);
    if (!step.uploads.empty()) upload_.run(step.uploads, step.pages);
    finish(step);
  } catch (...) {
    step = {};
    throw;
  }
}

void VolumeStore::setNextBlocks(std::span<const Block> blocks, const Scene& scene) {
  dropNext();
  Step& step = next();
  try {
    lay(step, blocks, scene);
    onItsWay_ = std::async(std::launch::async | std::launch::deferred, [this, &step] {
      if (!step.uploads.empty()) upload_.run(step.uploads, step.pages);
    });
  } catch (...) {
    step = {};
    throw;
  }
}

void VolumeStore::awaitNext() {
  if (!onItsWay_.valid()) throw Error(ErrorCode::InvalidArgument, "no next blocks were set");
  try {
    onItsWay_.get();
    finish(next());
  } catch (...) {
    next() = {};
    throw;
  }
}

void VolumeStore::showNext() {
  shown_ = 1 - shown_;
}

void VolumeStore::dropNext() {
  if (!onItsWay_.valid()) return;
  try {
    onItsWay_.get();
    next().blocks.clear();
  } catch (const std::exception&) {
    next() = {};  // nobody will request it
  }
}

std::uint64_t VolumeStore::texelBytesHeld() const {
  std::uint64_t bytes = 0;
  for (const Step& step : steps_) {
    for (const SampledImage& page : step.pages) {
      const glm::u64vec3 extent(page.extent());
      bytes += extent.x * extent.y * extent.z * texelBytes(page.format());
    }
  }
  return bytes;
}

/// Prepares pages, macrocells and bricks, and begins the upload of values.
void VolumeStore::lay(Step& step, std::span<const Block> blocks, const Scene& scene) {
  validate(blocks);
  step.tree.clear();
  step.blocks.assign(blocks.begin(), blocks.end());
  std::vector<VolumePiece> pieces;
  std::vector<PieceRange> piecesOf;  // pieces of each block
  std::map<ValuesKey, SharedValues> known;
  std::uint32_t colors = 0;
  for (const Block& block : step.blocks) {
    if (block.owned.empty()) continue;
    known[keyOf(block)].addOwn(block);
    colors = static_cast<std::uint32_t>(block.colors.size());
  }
  cutAll(*device_, known);
  step.ownTexels.clear();
  for (const Block& block : step.blocks) {
    if (block.owned.empty()) {
      piecesOf.emplace_back();
      continue;
    }
    SharedValues& values = known[keyOf(block)];
    if (!values.pieces) {
      const auto first = static_cast<std::uint32_t>(pieces.size());
      for (VolumePiece& piece : values.cut) {
        addOwnTexels(step.ownTexels, piece, values.own);
        pieces.push_back(piece);
      }
      values.pieces = {first, static_cast<std::uint32_t>(pieces.size())};
    }
    piecesOf.push_back(*values.pieces);
  }
  makePages(step, std::move(pieces), colors);
  layColors(step);
  layCells(step);
  layBricks(step, piecesOf, scene);
  upload_.begin(commands_);
}

/// Reuses the pages if their shapes are the same.
void VolumeStore::makePages(Step& step, std::vector<VolumePiece> pieces, std::uint32_t colors) {
  const bool sameShapes =
      pieces.size() == step.pieces.size() && colors == step.colors &&
      std::equal(pieces.begin(), pieces.end(), step.pieces.begin(),
                 [](const VolumePiece& a, const VolumePiece& b) { return a.samePlaceAs(b); });
  if (sameShapes) {
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      pieces[i].page = step.pieces[i].page;
      pieces[i].place = step.pieces[i].place;
    }
    step.pieces = std::move(pieces);
    return;
  }
  step.pages.clear();
  step.pieces = std::move(pieces);
  step.colors = colors;
  step.pagesVersion = ++pagesVersions_;
  const std::vector<PageShape> shapes = placeInPages(*device_, step.pieces);
  if (shapes.size() * (1 + colors) > shared::castMaxPages) {
    throw Error(
        ErrorCode::OutOfMemory,
        fmt::format("{} components of this size don't fit {} textures", 1 + colors, shared::castMaxPages),
        device_->name());
  }
  for (std::uint32_t i = 0; i <= colors; ++i) {
    for (const PageShape& shape : shapes) step.pages.emplace_back(device_, shape.extent, shape.format);
  }
  commands_.begin();
  for (const SampledImage& page : step.pages) commands_.clear(page);
  commands_.submitAndWait();
}

/// Lists the values to upload.
void VolumeStore::layColors(Step& step) {
  step.uploads = step.pieces;
  const auto pagesEach = static_cast<std::uint32_t>(step.pages.size()) / (1 + step.colors);
  for (std::uint32_t color = 0; color < step.colors; ++color) {
    const Block* last = nullptr;
    ValueMap values;
    for (VolumePiece piece : step.pieces) {
      piece.block = &piece.block->colors[color];
      if (piece.block != last) values = valueMapOf(*piece.block, piece.block->ownBoxes());
      last = piece.block;
      piece.values = values;
      piece.page += pagesEach * (1 + color);
      step.uploads.push_back(piece);
    }
  }
}

void VolumeStore::layBricks(Step& step, std::span<const PieceRange> piecesOf, const Scene& scene) const {
  const glm::dvec3 center = scene.bounds.center();
  std::vector<shared::Brick> bricks;
  for (std::size_t i = 0; i < step.blocks.size(); ++i) {
    const Block& block = step.blocks[i];
    for (std::uint32_t index = piecesOf[i].first; index < piecesOf[i].last; ++index) {
      const VolumePiece& piece = step.pieces[index];
      shared::Brick brick{};
      brick.page = piece.page;
      brick.piece = index;
      const glm::dvec3 extent = glm::dvec3(step.pages[piece.page].extent());
      const glm::dvec3 pieceOrigin = block.origin + glm::dvec3(piece.first) * block.spacing;
      for (int axis = 0; axis < 3; ++axis) {
        // An owned box may extend beyond the outermost values (as for cells); only inner cuts bound a piece.
        double lo = block.owned.lo[axis];
        double hi = block.owned.hi[axis];
        if (piece.first[axis] > block.extended().lo[axis])
          lo = std::max(lo, pieceOrigin[axis] + pieceMargin * block.spacing[axis]);
        if (piece.box().hi[axis] < block.extended().hi[axis])
          hi = std::min(hi, pieceOrigin[axis] + (piece.dims[axis] - 1.0 - pieceMargin) * block.spacing[axis]);
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
      for (std::uint32_t color = 0; color < step.colors; ++color) {
        const ValueMap& values = step.uploads[step.pieces.size() * (1 + color) + index].values;
        const glm::dvec2 ends = step.colors == 3 ? block.colors[color].displayed : glm::dvec2(0.0, 1.0);
        brick.colorScale[static_cast<int>(color)] = static_cast<float>(values.scale / (ends.y - ends.x));
        brick.colorOffset[static_cast<int>(color)] =
            static_cast<float>((values.offset - ends.x) / (ends.y - ends.x));
      }
      brick.firstCell = step.cellPieces[index].firstCell;
      brick.cellDims = step.cellPieces[index].cellDims;
      if (glm::all(glm::lessThan(brick.lo, brick.hi))) bricks.push_back(brick);
    }
  }
  KdTree tree = buildKdTree(std::move(bricks));
  step.tree = std::move(tree.nodes);
  step.bricks = std::move(tree.bricks);
  step.pieceOfBrick.clear();
  for (const shared::Brick& brick : step.bricks) step.pieceOfBrick.push_back(brick.piece);
  step.nodeBuffer.reserve(device_, std::span(step.tree).size_bytes(), MemoryKind::Upload);
  if (!step.tree.empty())
    std::memcpy(step.nodeBuffer.mapped().data(), step.tree.data(), std::span(step.tree).size_bytes());
}

/// Lays out the macrocells of all pieces, and their ranges of values.
void VolumeStore::layCells(Step& step) const {
  step.cellPieces.clear();
  std::uint64_t cells = 0;
  for (const VolumePiece& piece : step.pieces) {
    shared::CellPiece cellPiece{};
    cellPiece.place = piece.place;
    cellPiece.page = piece.page;
    cellPiece.dims = piece.dims;
    cellPiece.firstCell = static_cast<std::uint32_t>(cells);
    cellPiece.firstOwn = piece.firstOwn;
    cellPiece.ownCount = piece.ownCount;
    // A cell lies between texel centres.
    const glm::uvec3 gaps = glm::max(piece.dims, glm::uvec3(2)) - 1U;
    cellPiece.cellDims = (gaps + shared::cellSide - 1U) / shared::cellSide;
    cells += volumeOf(cellPiece.cellDims);
    step.cellPieces.push_back(cellPiece);
  }
  constexpr std::uint64_t maxCells = std::numeric_limits<std::uint32_t>::max();
  if (cells > maxCells) {
    throw Error(ErrorCode::OutOfMemory,
                fmt::format("{} macrocells in one rank's blocks, more than the {} allowed", cells, maxCells),
                device_->name());
  }
  step.cellCount = static_cast<std::uint32_t>(cells);
  if (step.cellCount == 0) return;
  step.rangeBuffer.reserve(device_, cells * sizeof(glm::vec2), MemoryKind::DeviceLocal);
  step.visibleBuffer.reserve(device_, cells * sizeof(std::uint32_t), MemoryKind::DeviceLocal);
  step.pieceRangeBuffer.reserve(device_, step.pieces.size() * sizeof(PieceRangeBits),
                                MemoryKind::DeviceLocal);
}

/// Completes the step after the upload.
void VolumeStore::finish(Step& step) {
  // The blocks' memory belongs to the caller after this call.
  step.blocks.clear();
  step.uploads.clear();
  for (VolumePiece& piece : step.pieces) piece.block = nullptr;
  if (hasTable()) placeTable(step);
  runCells(step, true);
  step.ranges = rangesOf(step);
  step.infinite = false;
  if (step.cellCount == 0) return;
  const auto found = pieceRanges_.mappedAs<PieceRangeBits>();
  for (std::size_t i = 0; i < step.pieces.size(); ++i)
    step.infinite = step.infinite || found[i][shared::pieceRangeInfinite] == 0U;
}

bool VolumeStore::mayBeInfinite() const {
  return std::ranges::any_of(pages(),
                             [](const SampledImage& page) { return page.format() == VK_FORMAT_R32_SFLOAT; });
}

bool VolumeStore::reachesBeyondTable() const {
  const ScalarRange& used = shown().ranges.used;
  return shown().infinite || used.min < table_.min || used.max > table_.max;
}

/// The values' ranges, after cells were measured.
FiniteRanges VolumeStore::rangesOf(const Step& step) const {
  FiniteRanges ranges;
  for (std::size_t i = 0; i < step.pieces.size(); ++i) {
    const ValueMap& values = step.pieces[i].values;
    if (values.ranges) {
      ranges.own.include(values.ranges->own);
      ranges.used.include(values.ranges->used);
      continue;
    }
    const PieceRangeBits& bits = pieceRanges_.mappedAs<PieceRangeBits>()[i];
    const auto valueOf = [&values](std::uint32_t ordered) {
      const double value = fromOrdered(ordered) * values.scale + values.offset;
      return values.whole ? std::round(value) : value;
    };
    const auto include = [&](ScalarRange& range, std::uint32_t minimum, std::uint32_t maximumInverted) {
      if (minimum == ~0U && maximumInverted == ~0U) return;  // no value is finite
      range.include({valueOf(minimum), valueOf(~maximumInverted)});
    };
    include(ranges.used, bits[shared::pieceRangeAll], bits[shared::pieceRangeAll + 1]);
    include(ranges.own, bits[shared::pieceRangeOwn], bits[shared::pieceRangeOwn + 1]);
  }
  return ranges;
}

/// Measures cells if their values are new, and classifies them if there is a table.
void VolumeStore::runCells(Step& step, bool measure) {
  if (step.cellCount == 0) return;
  const auto bytes = std::span(step.cellPieces).size_bytes();
  step.cellPieceBuffer.reserve(device_, bytes, MemoryKind::Upload);
  std::memcpy(step.cellPieceBuffer.mapped().data(), step.cellPieces.data(), bytes);
  shared::CellsConstants constants{};
  constants.pieces = step.cellPieceBuffer.address();
  const auto ownBytes = std::span(step.ownTexels).size_bytes();
  step.ownTexelsBuffer.reserve(device_, std::max(ownBytes, sizeof(shared::TexelBox)), MemoryKind::Upload);
  if (ownBytes > 0) std::memcpy(step.ownTexelsBuffer.mapped().data(), step.ownTexels.data(), ownBytes);
  constants.own = step.ownTexelsBuffer.address();
  constants.ranges = step.rangeBuffer.address();
  constants.pieceRanges = step.pieceRangeBuffer.address();
  constants.visible = step.visibleBuffer.address();
  constants.visibleBefore = visibleBeforeBuffer_.address();
  constants.pieceCount = static_cast<std::uint32_t>(step.cellPieces.size());
  constants.cellCount = step.cellCount;
  constants.tableSize = static_cast<std::uint32_t>(std::max(table_.entries.size(), table_.pieces.size()));
  constants.hasPieces = table_.pieces.empty() ? 0U : 1U;
  constants.pieceStarts = pieceStarts();
  commands_.begin();
  const auto record = [&](std::uint32_t mode) {
    constants.mode = mode;
    cellsPass_.record(commands_, constants, step.pages, step.pagesVersion);
  };
  if (measure) {
    const std::uint64_t rangeBytes = step.pieces.size() * sizeof(PieceRangeBits);
    pieceRanges_.reserve(device_, rangeBytes, MemoryKind::Readback);
    commands_.waitFor(upload_.last());
    commands_.fill(step.pieceRangeBuffer, ~0U);
    commands_.barrier();
    record(shared::cellsModeMeasure);
    commands_.barrier();
    commands_.copy(step.pieceRangeBuffer, 0, pieceRanges_, 0, rangeBytes);
  }
  if (hasTable()) record(shared::cellsModeClassify);
  commands_.submitAndWait();
}

void VolumeStore::setTable(const TransferTable& table, float slabLength) {
  const bool isNew = table_ != table;
  if (!isNew && slabTable_.length == slabLength) return;
  slabTable_ = makeSlabTable(table, slabLength);
  uploadSlabs();
  if (!isNew) return;
  table_ = table;
  uploadPieces();
  // An entry, or a piece, is visible if it has material.
  std::vector<bool> isVisible;
  for (const TransferTableEntry& entry : table_.entries) isVisible.push_back(entry.extinction > 0.0F);
  for (const TransferPiece& piece : table_.pieces)
    isVisible.push_back(piece.front.a > 0.0F || piece.back.a > 0.0F);
  visibleBeforeBuffer_.reserve(device_, (isVisible.size() + 1) * sizeof(std::uint32_t), MemoryKind::Upload);
  const auto visibleBefore = visibleBeforeBuffer_.mappedAs<std::uint32_t>();
  visibleBefore[0] = 0;
  for (std::size_t i = 0; i < isVisible.size(); ++i)
    visibleBefore[i + 1] = visibleBefore[i] + (isVisible[i] ? 1 : 0);
  Step& step = steps_[shown_];
  placeTable(step);
  runCells(step, false);
}

/// Sums of all pieces before one may be so large that their difference over a few pieces is lost in floats.
/// So a sum comes in two floats.
void VolumeStore::uploadPieces() {
  const std::vector<TransferPiece>& pieces = table_.pieces;
  const std::size_t count = std::max<std::size_t>(pieces.size(), 1);
  pieceBuffer_.reserve(device_, count * sizeof(shared::SlabPiece), MemoryKind::Upload);
  pieceStartBuffer_.reserve(device_, count * sizeof(float), MemoryKind::Upload);
  const auto uploaded = pieceBuffer_.mappedAs<shared::SlabPiece>();
  const auto starts = pieceStartBuffer_.mappedAs<float>();
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const TransferPiece& piece = pieces[i];
    const glm::dvec4& sum = slabTable_.integral->upToPiece(i);
    const float end = i + 1 < pieces.size() ? pieces[i + 1].start : static_cast<float>(farPosition);
    const glm::vec4 high(sum);
    uploaded[i] = {piece.start, end, piece.front, piece.back, high, glm::vec4(sum - glm::dvec4(high))};
    starts[i] = piece.start;
  }
}

void VolumeStore::uploadSlabs() {
  const bool hasTexels = !slabTable_.texels.empty();
  if (!hasTexels && slabs_) return;  // programs for pieces don't read the texture, but it must exist
  const glm::uvec2 extent = hasTexels ? glm::uvec2(shared::slabSide, slabTable_.height()) : glm::uvec2(1);
  const bool isNew = !slabs_ || glm::uvec2(slabs_.extent()) != extent;
  if (isNew) {
    slabs_ = SampledImage::plane(device_, extent, VK_FORMAT_R16G16B16A16_SFLOAT);
    ++slabsVersion_;
  }
  commands_.begin();
  if (isNew) commands_.clear(slabs_);
  if (hasTexels) {
    const auto bytes = std::as_bytes(std::span(slabTable_.texels));
    slabStaging_.reserve(device_, bytes.size(), MemoryKind::Upload);
    copyInParallel(bytes, slabStaging_.mapped().data());
    commands_.beginUpload(slabs_);
    commands_.copyToImage(slabStaging_, 0, slabs_, glm::uvec3(0), slabs_.extent());
    commands_.endUpload(slabs_);
  }
  commands_.submitAndWait();
}

void VolumeStore::placeTable(Step& step) {
  const double perScalar = table_.last() / (table_.max - table_.min);
  for (std::size_t i = 0; i < step.bricks.size(); ++i) {
    const VolumePiece& piece = step.pieces[step.pieceOfBrick[i]];
    step.bricks[i].tableOrigin = static_cast<float>((table_.min - piece.values.offset) / piece.values.scale);
    step.bricks[i].tableScale = static_cast<float>(piece.values.scale * perScalar);
  }
  for (std::size_t i = 0; i < step.cellPieces.size(); ++i) {
    const VolumePiece& piece = step.pieces[i];
    step.cellPieces[i].tableOrigin =
        static_cast<float>((table_.min - piece.values.offset) / piece.values.scale);
    step.cellPieces[i].tableScale = static_cast<float>(piece.values.scale * perScalar);
  }
  const auto bytes = std::span(step.bricks).size_bytes();
  step.brickBuffer.reserve(device_, bytes, MemoryKind::Upload);
  if (!step.bricks.empty()) std::memcpy(step.brickBuffer.mapped().data(), step.bricks.data(), bytes);
}

}  // namespace vdi::gpu
