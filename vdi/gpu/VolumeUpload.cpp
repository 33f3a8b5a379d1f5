#include "vdi/gpu/VolumeUpload.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <utility>

#include "shaders/shared/cells.h"
#include "vdi/core/BitCast.h"
#include "vdi/core/Parallel.h"

namespace vdi::gpu {

namespace {

constexpr std::uint64_t stagingBytes = 32ULL << 20;  // in each of the two buffers

/// Below this size, importing memory takes longer than copying it.
constexpr std::uint64_t minImport = 1ULL << 20;

/// Each import takes one of a device's allocations, at least 4096 in all.
constexpr std::size_t maxImports = 256;

/// Below this number of cores, copying values takes longer than pinning their pages.
constexpr std::size_t coresThatCopyFaster = 2;

/// Makes infinite texels finite: they would turn what is interpolated with them into NaN, even with weight 0.
/// Values that are never interpolated may lie beyond a float's range.
template <typename Value>
float filterable(Value texel) {
  const auto infinite = bit_cast<float>(shared::infiniteTexelBits);
  const bool tooLarge = std::abs(texel) > static_cast<Value>(std::numeric_limits<float>::max());
  return tooLarge ? std::copysign(infinite, texel < 0 ? -1.0F : 1.0F) : static_cast<float>(texel);
}

/// Whether some of the stored values in `part` of a block of f32 are infinite.
bool anyInfinite(const Block& block, const IndexBox& part) {
  const Tiling tiles = block.tilesOf(part);
  TileBuffer buffer;
  for (std::size_t i = 0; i < tiles.count(); ++i) {
    const IndexBox tile = tiles[i];
    block.copyTo(tile, buffer.bytes.data());
    bool found = false;
    for (const float value : std::span(reinterpret_cast<const float*>(buffer.bytes.data()), tile.count()))
      found |= std::isinf(value);
    if (found) return true;
  }
  return false;
}

/// The distance between rows in values, and between slices in rows.
struct Pitches {
  int row = 0;
  int rows = 0;
};

/// The block's pitches; nullopt if its values don't lie in rows and slices that a device can copy.
std::optional<Pitches> pitchesOf(const Block& block) {
  if (block.isPacked()) return Pitches{block.dims.x, block.dims.y};
  if (block.computed) return std::nullopt;
  const ByteStrides& strides = *block.strides;
  const auto bytes = static_cast<std::int64_t>(sizeOf(block.type));
  constexpr std::int64_t most = 1 << 30;
  if (strides.x != bytes || strides.y % bytes != 0 || strides.y < bytes * block.dims.x ||
      strides.y / bytes > most || strides.z % strides.y != 0 || strides.z / strides.y < block.dims.y ||
      strides.z / strides.y > most)
    return std::nullopt;
  return Pitches{static_cast<int>(strides.y / bytes), static_cast<int>(strides.z / strides.y)};
}

/// Converts `count` values to texels. The unsigned integer formats shift signed values up. The float format
/// is relative to the block's range, except for f32, which is stored unchanged unless it is infinite.
template <typename From, typename To, typename Convert>
void convertRow(const void* from, std::size_t first, std::size_t count, std::byte* to, Convert convert) {
  const auto* values = static_cast<const From*>(from) + first;
  auto* texels = reinterpret_cast<To*>(to);
  for (std::size_t i = 0; i < count; ++i) texels[i] = convert(values[i]);
}

/// Writes `count` values, from number `first` of the array `data` on.
void writeRow(ScalarType type, const void* data, VkFormat format, const ValueMap& values, std::size_t first,
              std::size_t count, std::byte* to) {
  const auto relative = [&values](auto value) {
    return filterable((static_cast<double>(value) - values.offset) / values.scale);
  };
  const bool wide = format == VK_FORMAT_R16_UNORM;
  using U8 = std::uint8_t;
  using U16 = std::uint16_t;
  switch (type) {
    case ScalarType::U8:
      if (wide) {
        return convertRow<U8, U16>(data, first, count, to, [](U8 v) { return static_cast<U16>(v * 257); });
      }
      std::memcpy(to, static_cast<const U8*>(data) + first, count);
      return;
    case ScalarType::I8:
      if (wide) {
        return convertRow<std::int8_t, U16>(data, first, count, to,
                                            [](std::int8_t v) { return static_cast<U16>((v + 128) * 257); });
      }
      return convertRow<std::int8_t, U8>(data, first, count, to,
                                         [](std::int8_t v) { return static_cast<U8>(v + 128); });
    case ScalarType::U16:
      std::memcpy(to, static_cast<const U16*>(data) + first, count * 2);
      return;
    case ScalarType::I16:
      return convertRow<std::int16_t, U16>(data, first, count, to,
                                           [](std::int16_t v) { return static_cast<U16>(v + 32768); });
    case ScalarType::F32:
      return convertRow<float, float>(data, first, count, to, filterable<float>);
    case ScalarType::U32:
      return convertRow<std::uint32_t, float>(data, first, count, to, relative);
    case ScalarType::I32:
      return convertRow<std::int32_t, float>(data, first, count, to, relative);
    case ScalarType::F64:
      return convertRow<double, float>(data, first, count, to, relative);
  }
}

/// Writes texels of `box`, in the block's indices, tightly packed: the stored values, covered by the patches.
void writeBox(const VolumePiece& piece, const IndexBox& box, std::byte* to) {
  const Block& block = *piece.block;
  const std::uint64_t bytes = texelBytes(piece.format);
  std::vector<const Patch*> patches;
  for (const Patch& patch : block.patchList()) {
    if (!patch.box.intersection(box).empty()) patches.push_back(&patch);
  }
  // Writes `part` from an array that holds the values of the box `of`.
  const auto writeArray = [&](const void* values, const IndexBox& of, const IndexBox& part) {
    for (int z = part.lo.z; z < part.hi.z; ++z) {
      for (int y = part.lo.y; y < part.hi.y; ++y) {
        const glm::ivec3 at(part.lo.x, y, z);
        writeRow(block.type, values, piece.format, piece.values, of.position(at),
                 static_cast<std::size_t>(part.size().x), to + box.position(at) * bytes);
      }
    }
  };
  const Tiling tiles = block.tilesOf(box);
  constexpr std::size_t minimum = 64;  // copying these takes some 100 us
  inParallel(tiles.count(), minimum, [&](std::size_t first, std::size_t last) {
    TileBuffer buffer;
    for (std::size_t i = first; i < last; ++i) {
      const IndexBox tile = tiles[i];
      const IndexBox stored = block.stored().intersection(tile);
      if (!stored.empty() && block.isPacked()) {
        writeArray(block.data, block.stored(), stored);
      } else if (!stored.empty()) {
        block.copyTo(stored, buffer.bytes.data());
        writeArray(buffer.bytes.data(), stored, stored);
      }
      for (const Patch* patch : patches) {
        const IndexBox part = patch->box.intersection(tile);
        if (!part.empty()) writeArray(patch->values.get(), patch->box, part);
      }
    }
  });
}

/// The alignment of offsets in the buffers from which the transfer queue copies. Whole texels aren't enough
/// for a queue that does nothing but copying.
std::uint64_t offsetAlignment(const Device& device) {
  const VulkanDevice& vulkan = device.vulkan();
  const bool onlyCopies = vulkan.queueFamily(QueueKind::Transfer) != vulkan.queueFamily(QueueKind::Compute);
  return onlyCopies ? 4 : 1;
}

/// Whether the block's values equal the texels of the piece's format.
bool isTexels(const VolumePiece& piece) {
  switch (piece.block->type) {
    case ScalarType::U8:
      return piece.format == VK_FORMAT_R8_UNORM;
    case ScalarType::U16:
      return piece.format == VK_FORMAT_R16_UNORM;
    case ScalarType::F32:
      return piece.format == VK_FORMAT_R32_SFLOAT;
    default:
      return false;
  }
}

}  // namespace

VolumeUpload::VolumeUpload(std::shared_ptr<Device> device)
    : device_(std::move(device)), halves_{Half(device_), Half(device_)} {}

/// Lets the device copy the staged data while the other half is filled.
void VolumeUpload::turnOver() {
  filling().commands.submit();
  current_ = 1 - current_;
  filling().commands.begin();  // waits until its data is copied
  filling().filled = 0;
}

/// Copies the piece's stored values from host memory. Returns false if the values must be staged instead.
/// `imported` must stay until the copies are complete.
bool VolumeUpload::copyDirectly(const VolumePiece& piece, const SampledImage& page,
                                std::vector<Buffer>& imported) {
  const Block& block = *piece.block;
  const IndexBox part = piece.box().intersection(block.stored());
  if (part.empty() || usableCores() >= coresThatCopyFaster || !isTexels(piece) ||
      imported.size() == maxImports)
    return false;
  const std::optional<Pitches> pitches = pitchesOf(block);
  if (!pitches) return false;
  const std::uint64_t bytes = texelBytes(piece.format);
  const IndexBox layout{glm::ivec3(0), {pitches->row, pitches->rows, block.dims.z}};
  const std::uint64_t first = layout.position(part.lo) * bytes;
  const std::uint64_t end = (layout.position(part.hi - 1) + 1) * bytes;
  if (end - first < minImport) return false;
  const auto* data = static_cast<const std::byte*>(block.data);
  if (block.type == ScalarType::F32 && anyInfinite(block, part)) return false;
  std::optional<ImportedBuffer> source = importHostMemory(device_, data + first, end - first);
  if (!source || source->offset % std::max(bytes, offsetAlignment(*device_)) != 0) return false;
  filling().commands.copyToImage(
      source->buffer, source->offset, page, piece.place + glm::uvec3(part.lo - piece.first),
      glm::uvec3(part.size()),
      {static_cast<std::uint32_t>(pitches->row), static_cast<std::uint32_t>(pitches->rows)});
  imported.push_back(std::move(source->buffer));
  return true;
}

/// `values` is a part of the piece, in the block's indices.
void VolumeUpload::stage(const VolumePiece& piece, const IndexBox& values, const SampledImage& page) {
  const std::uint64_t bytes = texelBytes(piece.format);
  const glm::u64vec3 size(values.size());
  const std::uint64_t rowBytes = size.x * bytes;
  const std::uint64_t sliceBytes = rowBytes * size.y;
  // Stages as many whole slices at a time as the buffer can hold, or as many whole rows of one slice. Vulkan
  // requires offsets in multiples of 4.
  glm::ivec3 at = values.lo;
  while (at.z < values.hi.z) {
    const bool slices = at.y == values.lo.y && sliceBytes <= stagingBytes;
    filling().filled = (filling().filled + 3) / 4 * 4;
    if (filling().filled + (slices ? sliceBytes : rowBytes) > stagingBytes) turnOver();
    Half& half = filling();
    half.staging.reserve(device_, stagingBytes, MemoryKind::Upload);
    const std::uint64_t room = stagingBytes - half.filled;
    const auto fitting = [room](int left, std::uint64_t each) {
      return static_cast<int>(std::min<std::uint64_t>(static_cast<std::uint64_t>(left), room / each));
    };
    IndexBox box{at, {values.hi.x, values.hi.y, at.z + 1}};
    if (slices) {
      box.hi.z = at.z + fitting(values.hi.z - at.z, sliceBytes);
    } else {
      box.hi.y = at.y + fitting(values.hi.y - at.y, rowBytes);
    }
    writeBox(piece, box, half.staging.mapped().data() + half.filled);
    half.commands.copyToImage(half.staging, half.filled, page, piece.place + glm::uvec3(at - piece.first),
                              glm::uvec3(box.size()));
    half.filled += box.count() * bytes;
    at.y = box.hi.y;
    if (at.y == values.hi.y) at = {values.lo.x, values.lo.y, box.hi.z};
  }
}

void VolumeUpload::begin(const Commands& before) {
  Half& half = filling();
  half.commands.begin();
  half.commands.waitFor(before);
  half.filled = 0;
}

void VolumeUpload::run(std::span<const VolumePiece> pieces, std::span<const SampledImage> pages) {
  std::vector<Buffer> imported;
  const auto waitForAll = [&] {
    for (Half& half : halves_) half.commands.wait();
  };
  try {
    for (const SampledImage& page : pages) filling().commands.beginUpload(page);
    std::vector<const VolumePiece*> direct;
    for (const VolumePiece& piece : pieces) {
      if (copyDirectly(piece, pages[piece.page], imported)) {
        direct.push_back(&piece);
      } else {
        stage(piece, piece.box(), pages[piece.page]);
      }
    }
    if (!direct.empty()) filling().commands.barrier();  // patches overwrite the copied values
    for (const VolumePiece* piece : direct) {
      for (const Patch& patch : piece->block->patchList()) {
        const IndexBox part = patch.box.intersection(piece->box());
        if (!part.empty()) stage(*piece, part, pages[piece->page]);
      }
    }
    for (const SampledImage& page : pages) filling().commands.endUpload(page);
    filling().commands.submit();
    waitForAll();
  } catch (...) {
    waitForAll();  // no command may read memory that is about to be freed
    throw;
  }
}

}  // namespace vdi::gpu
