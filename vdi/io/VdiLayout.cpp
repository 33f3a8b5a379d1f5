#include "vdi/io/VdiLayout.h"

#include <xxhash.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "vdi/core/Camera.h"
#include "vdi/io/Metadata.h"

namespace vdi::io::detail {

namespace {

static_assert(std::endian::native == std::endian::little, "the .vdi file is read without byte swaps");

constexpr std::array<char, 8> magicText{'V', 'D', 'I', '-', 'F', 'I', 'L', 'E'};
constexpr std::uint32_t plainVersion = 1;   // neither margin nor metadata
constexpr std::uint32_t marginVersion = 2;  // a margin; written only if there is one
constexpr std::uint32_t metadataVersion =
    3;  // metadata and maybe a margin; written only if there is metadata
constexpr std::uint32_t flagParallel = 1;
constexpr std::uint32_t knownFlags = flagParallel;

}  // namespace

void fail(const std::string& what) {
  throw Error(ErrorCode::Format, "invalid .vdi file: " + what);
}

std::uint64_t checksumOf(std::span<const std::byte> bytes) {
  return XXH64(bytes.data(), bytes.size(), 0);
}
std::uint64_t checksumOf(std::span<const ChunkEntry> table) {
  return checksumOf(std::as_bytes(table));
}
std::uint64_t checksumOf(const Header& header) {
  return XXH64(&header, offsetof(Header, headerChecksum), 0);
}

void requireSoundHeader(const Vdi& vdi) {
  try {
    static_cast<void>(vdi.view());
  } catch (const Error& error) {
    fail(error.what());
  }
  bool numbers = std::isfinite(vdi.time) && std::isfinite(vdi.sampleStep) && vdi.sampleStep >= 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    numbers = numbers && !std::isnan(vdi.bounds.lo[axis]) && !std::isnan(vdi.bounds.hi[axis]);
  }
  if (!numbers) fail("time, sample step or bounds aren't numbers");
  if (vdi.budget < 1) fail("the budget is 0 supersegments");
}

Header fileHeaderOf(const Vdi& vdi) {
  Header header{};
  header.magic = magicText;
  header.version = vdi.coloring                  ? metadataVersion
                   : vdi.margin == glm::ivec2(0) ? plainVersion
                                                 : marginVersion;
  header.headerBytes = sizeof(Header);
  header.encoding = static_cast<std::uint32_t>(vdi.precision());
  header.flags = vdi.camera.parallelProjection ? flagParallel : 0;
  header.width = static_cast<std::uint32_t>(vdi.width);
  header.height = static_cast<std::uint32_t>(vdi.height);
  header.budget = vdi.budget;
  header.listsPerChunk = listsPerChunk;
  header.marginX = static_cast<std::uint16_t>(vdi.margin.x);  // validate guarantees that it fits
  header.marginY = static_cast<std::uint16_t>(vdi.margin.y);
  header.timeStep = vdi.timeStep;
  header.time = vdi.time;
  header.sampleStep = vdi.sampleStep;
  for (int axis = 0; axis < 3; ++axis) {
    header.boundsLo[axis] = vdi.bounds.lo[axis];
    header.boundsHi[axis] = vdi.bounds.hi[axis];
    header.position[axis] = vdi.camera.position[axis];
    header.focalPoint[axis] = vdi.camera.focalPoint[axis];
    header.viewUp[axis] = vdi.camera.viewUp[axis];
  }
  header.viewAngle = vdi.camera.viewAngle;
  header.parallelScale = vdi.camera.parallelScale;
  return header;
}

Vdi vdiOf(const Header& header) {
  Vdi vdi;
  vdi.width = static_cast<int>(header.width);
  vdi.height = static_cast<int>(header.height);
  vdi.margin = glm::ivec2(header.marginX, header.marginY);
  vdi.budget = header.budget;
  vdi.time = header.time;
  vdi.timeStep = header.timeStep;
  vdi.sampleStep = header.sampleStep;
  for (int axis = 0; axis < 3; ++axis) {
    vdi.bounds.lo[axis] = header.boundsLo[axis];
    vdi.bounds.hi[axis] = header.boundsHi[axis];
    vdi.camera.position[axis] = header.position[axis];
    vdi.camera.focalPoint[axis] = header.focalPoint[axis];
    vdi.camera.viewUp[axis] = header.viewUp[axis];
  }
  vdi.camera.viewAngle = header.viewAngle;
  vdi.camera.parallelScale = header.parallelScale;
  vdi.camera.parallelProjection = (header.flags & flagParallel) != 0;
  vdi.lists = noLists(precisionOf(header));
  requireSoundHeader(vdi);
  return vdi;
}

Header parseHeader(std::span<const std::byte> start, std::uint64_t fileBytes) {
  Header header{};
  if (start.size() < sizeof(Header)) fail(fmt::format("{} bytes are too few for a header", fileBytes));
  std::memcpy(&header, start.data(), sizeof(Header));
  if (header.magic != magicText) fail("it doesn't start with VDI-FILE");
  if (header.version < plainVersion || header.version > metadataVersion) {
    fail(fmt::format("it has version {}, but this program reads versions {} to {}", header.version,
                     plainVersion, metadataVersion));
  }
  if (header.headerBytes != sizeof(Header)) fail(fmt::format("its header has {} bytes", header.headerBytes));
  if (header.headerChecksum != checksumOf(header)) fail("the header's checksum is wrong");
  if (!isEncoding(header.encoding)) {
    fail(fmt::format("its supersegments have encoding {}, but this program reads encodings 0 to {}",
                     header.encoding, std::variant_size_v<AnyLists> - 1));
  }
  const bool hasMargin = header.marginX != 0 || header.marginY != 0;
  if ((header.flags & ~knownFlags) != 0 || (hasMargin && header.version == plainVersion))
    fail("it uses flags that this program doesn't know");
  const auto goodSide = [](std::uint32_t side) { return side >= 1 && side <= View::maxSide; };
  if (!goodSide(header.width) || !goodSide(header.height) || header.listsPerChunk == 0) {
    fail(fmt::format("it can't have {} x {} lists in chunks of {}", header.width, header.height,
                     header.listsPerChunk));
  }
  if (2U * header.marginX >= header.width || 2U * header.marginY >= header.height) {
    fail(fmt::format("a margin of {} x {} lists leaves no picture of {} x {}", header.marginX, header.marginY,
                     header.width, header.height));
  }
  const std::uint64_t chunks = chunksOf(std::uint64_t{header.width} * header.height, header.listsPerChunk);
  if (chunks != header.chunkCount) {
    fail(fmt::format("it has {} chunks instead of {}", header.chunkCount, chunks));
  }
  const std::uint64_t frontBytes = sizeof(Header) + chunks * sizeof(ChunkEntry);
  const bool hasMetadata = header.version == metadataVersion;
  const std::uint64_t rest = frontBytes > fileBytes ? 0 : fileBytes - frontBytes;
  if (frontBytes > fileBytes || header.dataBytes > rest || (!hasMetadata && header.dataBytes != rest)) {
    fail(fmt::format("it has {} bytes, but its header gives {} + {}", fileBytes, frontBytes,
                     header.dataBytes));
  }
  if (hasMetadata && (rest - header.dataBytes < sizeof(MetadataHeader) ||
                      rest - header.dataBytes > sizeof(MetadataHeader) + maxMetadataBytes)) {
    fail(fmt::format("{} bytes after its chunks can't be metadata", rest - header.dataBytes));
  }
  return header;
}

std::optional<Coloring> parseMetadata(const Header& header, std::span<const std::byte> bytes) {
  if (header.version != metadataVersion) return std::nullopt;
  MetadataHeader head{};
  std::memcpy(&head, bytes.data(), sizeof(MetadataHeader));  // parseHeader has checked its presence
  const std::span<const std::byte> text = bytes.subspan(sizeof(MetadataHeader));
  if (head.kind != kindJson) fail("its metadata aren't JSON");
  if (head.bytes != text.size()) {
    fail(fmt::format("the metadata have {} bytes, but their header gives {}", text.size(), head.bytes));
  }
  if (head.checksum != checksumOf(text)) fail("the metadata's checksum is wrong");
  try {
    return coloringIn({reinterpret_cast<const char*>(text.data()), text.size()});
  } catch (const Error& error) {
    fail(error.what());
  }
}

std::vector<Chunk> parseTable(const Header& header, std::span<const std::byte> bytes) {
  std::vector<ChunkEntry> table(header.chunkCount);
  std::memcpy(table.data(), bytes.data(), tableBytesOf(header));
  if (header.tableChecksum != checksumOf(table)) fail("the chunk table's checksum is wrong");
  const std::uint64_t lists = std::uint64_t{header.width} * header.height;
  std::vector<Chunk> chunks;
  chunks.reserve(table.size());
  Chunk next{};
  for (const ChunkEntry& entry : table) {
    next.packedBytes = entry.packedBytes;
    next.checksum = entry.checksum;
    next.listCount = std::min<std::uint64_t>(header.listsPerChunk, lists - next.firstList);
    next.supersegmentCount = entry.supersegmentCount;
    const std::uint64_t expanded = chunkBytes(next.listCount, next.supersegmentCount, precisionOf(header));
    if (!detail::canExpandTo(next.packedBytes, expanded) ||
        next.supersegmentCount > next.listCount * header.budget) {
      fail(fmt::format("chunk {} can't hold {} supersegments in {} bytes", chunks.size(),
                       next.supersegmentCount, next.packedBytes));
    }
    chunks.push_back(next);
    next.dataOffset += next.packedBytes;
    next.firstList += next.listCount;
    next.firstSupersegment += next.supersegmentCount;
  }
  if (next.dataOffset != header.dataBytes)
    fail("its chunks' sizes don't add up to the header's size of the data");
  if (next.firstSupersegment != header.supersegmentCount || next.firstSupersegment > UINT32_MAX) {
    fail("its chunks' supersegments don't add up to the header's number");
  }
  return chunks;
}

void requireSound(const Chunk& chunk, std::span<const std::byte> packed, Precision precision) {
  if (chunk.checksum != checksumOf(packed)) {
    fail(fmt::format("the checksum of the chunk from list {} on is wrong", chunk.firstList));
  }
  if (detail::announcedBytes(packed) != chunkBytes(chunk.listCount, chunk.supersegmentCount, precision)) {
    fail(fmt::format("the chunk from list {} on doesn't hold {} supersegments", chunk.firstList,
                     chunk.supersegmentCount));
  }
}

void requireCode(const DepthCode& shared, std::span<const DepthCode> chunks) {
  const auto differs = [&shared](const DepthCode& code) { return code != shared; };
  if (std::any_of(chunks.begin(), chunks.end(), differs)) fail("its chunks have different depth codes");
}

}  // namespace vdi::io::detail
