#include "vdi/gpu/VolumeUpload.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>
#include <utility>

#include "shaders/shared/cells.h"
#include "vdi/core/BitCast.h"
#include "vdi/core/Parallel.h"

namespace vdi::gpu {

namespace {

constexpr std::uint64_t stagingBytes = 32ULL << 20;  // each of the two

/// Below this size, importing memory takes longer than copying it.
constexpr std::uint64_t minImport = 1ULL << 20;

/// Each import takes one of a device's allocations, at least 4096 in all.
constexpr std::size_t maxImports = 256;

/// Below this number of cores, copying values takes longer than pinning their pages.
constexpr std::size_t coresThatCopyFaster = 2;

/// Infinite texels would turn everything interpolated with them into NaN, even with weight 0.
float filterable(float texel) {
  const auto infinite = bit_cast<float>(shared::infiniteTexelBits);
  return std::isinf(texel) ? std::copysign(infinite, texel) : texel;
}

bool anyInfinite(std::span<const float> values) {
  constexpr std::size_t atOnce = 4096;
  for (std::size_t first = 0; first < values.size(); first += atOnce) {
    bool found = false;
    for (const float value : values.subspan(first, std::min(atOnce, values.size() - first)))
      found |= std::isinf(value);
    if (found) return true;
  }
  return false;
}

/// `count` values as texels. The unsigned integer formats shift signed values up. The float format is
/// relative to the block's range, except for f32, which is stored as it is unless it is infinite.
template <typename From, typename To, typename Convert>
void convertRow(const void* from, std::size_t first, std::size_t count, std::byte* to, Convert convert) {
  const auto* values = static_cast<const From*>(from) + first;
  auto* texels = reinterpret_cast<To*>(to);
  for (std::size_t i = 0; i < count; ++i) texels[i] = convert(values[i]);
}

void writeRow(ScalarType type, const void* data, VkFormat format, const ValueMap& values, std::size_t first,
              std::size_t count, std::byte* to) {
  const auto relative = [&values](auto value) {
    return filterable(static_cast<float>((static_cast<double>(value) - values.offset) / values.scale));
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
      return convertRow<float, float>(data, first, count, to, filterable);
    case ScalarType::U32:
      return convertRow<std::uint32_t, float>(data, first, count, to, relative);
    case ScalarType::I32:
      return convertRow<std::int32_t, float>(data, first, count, to, relative);
    case ScalarType::F64:
      return convertRow<double, float>(data, first, count, to, relative);
  }
}

/// An array of source values for texels.
struct Source {
  IndexBox box;  // in the block's indices
  const void* values;
};

/// Writes texels of `box`, in the block's indices, tightly packed: the stored values, covered by the patches.
void writeBox(const VolumePiece& piece, const IndexBox& box, std::byte* to) {
  const Block& block = *piece.block;
  std::vector<Source> sources{{block.stored(), block.data}};
  for (const Patch& patch : block.patchList()) sources.push_back({patch.box, patch.values.get()});
  std::erase_if(sources, [&](const Source& source) { return source.box.intersection(box).empty(); });
  const std::uint64_t bytes = texelBytes(piece.format);
  const glm::ivec3 size = box.size();
  constexpr std::size_t atOnce = 1 << 20;  // bytes
  const auto rows = static_cast<std::size_t>(size.y) * static_cast<std::size_t>(size.z);
  const std::size_t rowBytes = static_cast<std::size_t>(size.x) * bytes;
  inParallel(rows, atOnce / std::max<std::size_t>(rowBytes, 1) + 1,
             [&](std::size_t firstRow, std::size_t lastRow) {
               const auto rowOf = [&](int y, int z) {
                 return static_cast<std::size_t>(z - box.lo.z) * static_cast<std::size_t>(size.y) +
                        static_cast<std::size_t>(y - box.lo.y);
               };
               for (const Source& source : sources) {
                 const IndexBox part = source.box.intersection(box);
                 for (int z = part.lo.z; z < part.hi.z; ++z) {
                   for (int y = part.lo.y; y < part.hi.y; ++y) {
                     if (rowOf(y, z) < firstRow || rowOf(y, z) >= lastRow) continue;
                     writeRow(block.type, source.values, piece.format, piece.values,
                              source.box.position({part.lo.x, y, z}), static_cast<std::size_t>(part.size().x),
                              to + box.position({part.lo.x, y, z}) * bytes);
                   }
                 }
               }
             });
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

/// Copies the piece's stored values from host memory. False if it cannot be imported, or is too small.
/// `imported` must stay until the copies are complete.
bool VolumeUpload::copyDirectly(const VolumePiece& piece, const SampledImage& page,
                                std::vector<Buffer>& imported) {
  const Block& block = *piece.block;
  const IndexBox stored = block.stored();
  const IndexBox part = piece.box().intersection(stored);
  if (part.empty() || usableCores() >= coresThatCopyFaster || !isTexels(piece) ||
      imported.size() == maxImports)
    return false;
  const std::uint64_t bytes = texelBytes(piece.format);
  const std::uint64_t first = stored.position(part.lo) * bytes;
  const std::uint64_t end = (stored.position(part.hi - 1) + 1) * bytes;
  if (end - first < minImport) return false;
  if (block.type == ScalarType::F32 &&
      anyInfinite({static_cast<const float*>(block.data) + first / bytes, (end - first) / bytes}))
    return false;
  std::optional<ImportedBuffer> source =
      importHostMemory(device_, static_cast<const std::byte*>(block.data) + first, end - first);
  if (!source || source->offset % bytes != 0) return false;
  filling().commands.copyToImage(
      source->buffer, source->offset, page, piece.place + glm::uvec3(part.lo - piece.first),
      glm::uvec3(part.size()),
      {static_cast<std::uint32_t>(block.dims.x), static_cast<std::uint32_t>(block.dims.y)});
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
