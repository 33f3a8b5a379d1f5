#include "vdi/gpu/VolumeUpload.h"

#include <algorithm>
#include <cstring>
#include <optional>
#include <utility>

#include "vdi/core/Parallel.h"

namespace vdi::gpu {

namespace {

constexpr std::uint64_t stagingBytes = 32ULL << 20;  // each of the two

/// Below that, importing memory takes longer than copying it.
constexpr std::uint64_t leastImport = 1ULL << 20;

/// Each takes one of the allocations that a device may have at a time, 4096 or more.
constexpr std::size_t mostImports = 256;

/// Fewer take longer to copy values than one takes to pin their pages.
constexpr std::size_t coresThatCopyFaster = 2;

/// `count` values as texels: the unsigned integer formats shift signed values up, the float format is
/// relative to the block's range except for f32, which is stored as it is.
template <typename From, typename To, typename Convert>
void convertRow(const void* from, std::size_t first, std::size_t count, std::byte* to, Convert convert) {
  const auto* values = static_cast<const From*>(from) + first;
  auto* texels = reinterpret_cast<To*>(to);
  for (std::size_t i = 0; i < count; ++i) texels[i] = convert(values[i]);
}

void writeRow(const Block& block, VkFormat format, const ValueMap& values, std::size_t first,
              std::size_t count, std::byte* to) {
  const auto relative = [&values](auto value) {
    return static_cast<float>((static_cast<double>(value) - values.offset) / values.scale);
  };
  const bool wide = format == VK_FORMAT_R16_UNORM;
  using U8 = std::uint8_t;
  using U16 = std::uint16_t;
  switch (block.type) {
    case ScalarType::U8:
      if (wide) {
        return convertRow<U8, U16>(block.data, first, count, to,
                                   [](U8 v) { return static_cast<U16>(v * 257); });
      }
      std::memcpy(to, static_cast<const U8*>(block.data) + first, count);
      return;
    case ScalarType::I8:
      if (wide) {
        return convertRow<std::int8_t, U16>(block.data, first, count, to,
                                            [](std::int8_t v) { return static_cast<U16>((v + 128) * 257); });
      }
      return convertRow<std::int8_t, U8>(block.data, first, count, to,
                                         [](std::int8_t v) { return static_cast<U8>(v + 128); });
    case ScalarType::U16:
      std::memcpy(to, static_cast<const U16*>(block.data) + first, count * 2);
      return;
    case ScalarType::I16:
      return convertRow<std::int16_t, U16>(block.data, first, count, to,
                                           [](std::int16_t v) { return static_cast<U16>(v + 32768); });
    case ScalarType::F32:
      std::memcpy(to, static_cast<const float*>(block.data) + first, count * 4);
      return;
    case ScalarType::U32:
      return convertRow<std::uint32_t, float>(block.data, first, count, to, relative);
    case ScalarType::I32:
      return convertRow<std::int32_t, float>(block.data, first, count, to, relative);
    case ScalarType::F64:
      return convertRow<double, float>(block.data, first, count, to, relative);
  }
}

/// Texels of a box of the piece, tightly packed.
void writeBox(const VolumePiece& piece, const glm::uvec3& at, const glm::uvec3& box, std::byte* to) {
  const Block& block = *piece.block;
  const std::uint64_t rowBytes = box.x * texelBytes(piece.format);
  const auto blockDims = glm::u64vec3(block.dims);
  const glm::u64vec3 start = glm::u64vec3(piece.first) + glm::u64vec3(at);
  constexpr std::size_t atOnce = 1 << 20;  // bytes
  const std::size_t rows = std::size_t{box.y} * box.z;
  inParallel(rows, atOnce / rowBytes + 1, [&](std::size_t firstRow, std::size_t lastRow) {
    for (std::size_t row = firstRow; row < lastRow; ++row) {
      const std::uint64_t y = start.y + row % box.y;
      const std::uint64_t z = start.z + row / box.y;
      writeRow(block, piece.format, piece.values, (z * blockDims.y + y) * blockDims.x + start.x, box.x,
               to + row * rowBytes);
    }
  });
}

/// Whether the block's values are texels of the piece's format as they are.
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

/// The device copies what's staged, while the other half is filled.
void VolumeUpload::turnOver() {
  filling().commands.submit();
  current_ = 1 - current_;
  filling().commands.begin();  // waits until it's been copied
  filling().filled = 0;
}

/// False if the memory can't be imported, or isn't worth it. `imported` must live until the copies are done.
bool VolumeUpload::copyDirectly(const VolumePiece& piece, const Image3D& page,
                                std::vector<Buffer>& imported) {
  const Block& block = *piece.block;
  const std::uint64_t bytes = texelBytes(piece.format);
  const auto dims = glm::u64vec3(block.dims);
  const auto at = glm::u64vec3(piece.first);
  const std::uint64_t first = ((at.z * dims.y + at.y) * dims.x + at.x) * bytes;
  const glm::u64vec3 last = at + glm::u64vec3(piece.dims) - std::uint64_t{1};
  const std::uint64_t end = ((last.z * dims.y + last.y) * dims.x + last.x + 1) * bytes;
  if (usableCores() >= coresThatCopyFaster || !isTexels(piece) || end - first < leastImport ||
      imported.size() == mostImports)
    return false;
  std::optional<ImportedBuffer> source =
      importHostMemory(device_, static_cast<const std::byte*>(block.data) + first, end - first);
  if (!source || source->offset % bytes != 0) return false;
  filling().commands.copyToImage(source->buffer, source->offset, page, piece.place, piece.dims,
                                 {static_cast<std::uint32_t>(dims.x), static_cast<std::uint32_t>(dims.y)});
  imported.push_back(std::move(source->buffer));
  return true;
}

void VolumeUpload::stage(const VolumePiece& piece, const Image3D& page) {
  const std::uint64_t bytes = texelBytes(piece.format);
  const std::uint64_t rowBytes = piece.dims.x * bytes;
  const std::uint64_t sliceBytes = rowBytes * piece.dims.y;
  // As many whole slices at a time as the staging buffer has room for, or as many whole rows of one slice.
  // Vulkan wants offsets in multiples of 4.
  glm::uvec3 at{0};
  while (at.z < piece.dims.z) {
    const bool slices = at.y == 0 && sliceBytes <= stagingBytes;
    filling().filled = (filling().filled + 3) / 4 * 4;
    if (filling().filled + (slices ? sliceBytes : rowBytes) > stagingBytes) turnOver();
    Half& half = filling();
    half.staging.reserve(device_, stagingBytes, MemoryKind::Upload);
    const std::uint64_t room = stagingBytes - half.filled;
    glm::uvec3 box{piece.dims.x, piece.dims.y, 1};
    if (slices) {
      box.z = static_cast<std::uint32_t>(std::min<std::uint64_t>(piece.dims.z - at.z, room / sliceBytes));
    } else {
      box.y = static_cast<std::uint32_t>(std::min<std::uint64_t>(piece.dims.y - at.y, room / rowBytes));
    }
    writeBox(piece, at, box, half.staging.mapped().data() + half.filled);
    half.commands.copyToImage(half.staging, half.filled, page, piece.place + at, box);
    half.filled += rowBytes * box.y * box.z;
    at.y += box.y;
    if (at.y == piece.dims.y) at = {0, 0, at.z + box.z};
  }
}

void VolumeUpload::begin(const Commands& before) {
  Half& half = filling();
  half.commands.begin();
  half.commands.waitFor(before);
  half.filled = 0;
}

void VolumeUpload::run(std::span<const VolumePiece> pieces, std::span<const Image3D> pages) {
  std::vector<Buffer> imported;
  const auto waitForAll = [&] {
    for (Half& half : halves_) half.commands.wait();
  };
  try {
    for (const Image3D& page : pages) filling().commands.beginUpload(page);
    for (const VolumePiece& piece : pieces) {
      const Image3D& page = pages[piece.page];
      if (!copyDirectly(piece, page, imported)) stage(piece, page);
    }
    for (const Image3D& page : pages) filling().commands.endUpload(page);
    filling().commands.submit();
    waitForAll();
  } catch (...) {
    waitForAll();  // nothing may be read from memory that's about to go
    throw;
  }
}

}  // namespace vdi::gpu
