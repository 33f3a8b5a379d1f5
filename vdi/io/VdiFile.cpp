#include "vdi/io/VdiFile.h"

#include <fmt/format.h>
#include <xxhash.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstring>
#include <optional>
#include <type_traits>
#include <utility>

#include "vdi/core/Camera.h"
#include "vdi/core/Error.h"
#include "vdi/core/Estimate.h"
#include "vdi/core/Parallel.h"
#include "vdi/core/Thinning.h"
#include "vdi/io/Files.h"
#include "vdi/io/ListCodec.h"
#include "vdi/io/Metadata.h"
#include "vdi/io/VdiParts.h"

namespace vdi::io {

namespace {

static_assert(std::endian::native == std::endian::little, "the .vdi file is read as it lies");

constexpr std::array<char, 8> magicText{'V', 'D', 'I', '-', 'F', 'I', 'L', 'E'};
constexpr std::uint32_t plainVersion = 1;   // neither margin nor metadata
constexpr std::uint32_t marginVersion = 2;  // a margin; written only if there is one
constexpr std::uint32_t metadataVersion =
    3;  // metadata and maybe a margin; written only if there is metadata
constexpr std::uint32_t flagParallel = 1;
constexpr std::uint32_t knownFlags = flagParallel;

/// docs/format.md has the table of fields.
struct Header {
  std::array<char, 8> magic;
  std::uint32_t version;
  std::uint32_t headerBytes;
  std::uint32_t encoding;
  std::uint32_t flags;
  std::uint32_t width;
  std::uint32_t height;
  std::uint32_t budget;
  std::uint32_t listsPerChunk;
  std::uint32_t chunkCount;
  std::uint16_t marginX;  // 0 in version 1
  std::uint16_t marginY;
  std::uint64_t supersegmentCount;
  std::uint64_t dataBytes;
  std::uint64_t timeStep;
  double time;
  double sampleStep;
  double boundsLo[3];
  double boundsHi[3];
  double position[3];
  double focalPoint[3];
  double viewUp[3];
  double viewAngle;
  double parallelScale;
  std::uint64_t tableChecksum;
  std::uint64_t headerChecksum;
};
static_assert(offsetof(Header, version) == 8);
static_assert(offsetof(Header, headerBytes) == 12);
static_assert(offsetof(Header, encoding) == 16);
static_assert(offsetof(Header, flags) == 20);
static_assert(offsetof(Header, width) == 24);
static_assert(offsetof(Header, height) == 28);
static_assert(offsetof(Header, budget) == 32);
static_assert(offsetof(Header, listsPerChunk) == 36);
static_assert(offsetof(Header, chunkCount) == 40);
static_assert(offsetof(Header, marginX) == 44);
static_assert(offsetof(Header, marginY) == 46);
static_assert(offsetof(Header, supersegmentCount) == 48);
static_assert(offsetof(Header, dataBytes) == 56);
static_assert(offsetof(Header, timeStep) == 64);
static_assert(offsetof(Header, time) == 72);
static_assert(offsetof(Header, sampleStep) == 80);
static_assert(offsetof(Header, boundsLo) == 88);
static_assert(offsetof(Header, boundsHi) == 112);
static_assert(offsetof(Header, position) == 136);
static_assert(offsetof(Header, focalPoint) == 160);
static_assert(offsetof(Header, viewUp) == 184);
static_assert(offsetof(Header, viewAngle) == 208);
static_assert(offsetof(Header, parallelScale) == 216);
static_assert(offsetof(Header, tableChecksum) == 224);
static_assert(offsetof(Header, headerChecksum) == 232);
static_assert(sizeof(Header) == 240);

/// Precedes the metadata, which are the file's last part.
struct MetadataHeader {
  std::array<char, 4> kind;
  std::uint32_t bytes;  // of the following text
  std::uint64_t checksum;
};
static_assert(offsetof(MetadataHeader, bytes) == 4);
static_assert(offsetof(MetadataHeader, checksum) == 8);
static_assert(sizeof(MetadataHeader) == 16);
constexpr std::array<char, 4> kindJson{'J', 'S', 'O', 'N'};

static_assert(offsetof(ChunkEntry, packedBytes) == 4);
static_assert(offsetof(ChunkEntry, checksum) == 8);
static_assert(sizeof(ChunkEntry) == 16);

[[noreturn]] void fail(const std::string& what) {
  throw Error(ErrorCode::Format, "not a sound .vdi file: " + what);
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

Precision precisionOf(const Header& header) {
  return static_cast<Precision>(header.encoding);
}

/// Checks what validate(Vdi) does not: a usable camera and finite numbers.
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
  if (vdi.budget < 1) fail("a budget of no supersegments");
}

std::uint64_t listsOf(const Vdi& vdi) {
  return static_cast<std::uint64_t>(vdi.width) * static_cast<std::uint64_t>(vdi.height);
}

/// The header without the fields that the chunks add.
Header headerOf(const Vdi& vdi) {
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

/// The header of a file of `fileBytes` that begins with `start`. Version and encoding are checked before the
/// checksum, so that the error names a file of a later version as such.
Header parseHeader(std::span<const std::byte> start, std::uint64_t fileBytes) {
  Header header{};
  if (start.size() < sizeof(Header)) fail(fmt::format("{} bytes are too few for a header", fileBytes));
  std::memcpy(&header, start.data(), sizeof(Header));
  if (header.magic != magicText) fail("it doesn't start with VDI-FILE");
  if (header.version < plainVersion || header.version > metadataVersion) {
    fail(fmt::format("it has version {}, this program reads versions {} to {}", header.version, plainVersion,
                     metadataVersion));
  }
  if (header.headerBytes != sizeof(Header)) fail(fmt::format("its header has {} bytes", header.headerBytes));
  if (header.headerChecksum != checksumOf(header)) fail("the header's checksum is wrong");
  if (!isEncoding(header.encoding)) {
    fail(fmt::format("its supersegments have encoding {}, this program reads encodings 0 to {}",
                     header.encoding, std::variant_size_v<AnyLists> - 1));
  }
  const bool hasMargin = header.marginX != 0 || header.marginY != 0;
  if ((header.flags & ~knownFlags) != 0 || (hasMargin && header.version == plainVersion))
    fail("it uses flags that this program doesn't know");
  const auto goodSide = [](std::uint32_t side) { return side >= 1 && side <= View::maxSide; };
  if (!goodSide(header.width) || !goodSide(header.height) || header.listsPerChunk == 0) {
    fail(fmt::format("{} x {} lists in chunks of {}", header.width, header.height, header.listsPerChunk));
  }
  if (2U * header.marginX >= header.width || 2U * header.marginY >= header.height) {
    fail(fmt::format("a margin of {} and {} of {} x {} lists", header.marginX, header.marginY, header.width,
                     header.height));
  }
  const std::uint64_t chunks = chunksOf(std::uint64_t{header.width} * header.height, header.listsPerChunk);
  if (chunks != header.chunkCount) {
    fail(fmt::format("{} chunks, there should be {}", header.chunkCount, chunks));
  }
  const std::uint64_t frontBytes = sizeof(Header) + chunks * sizeof(ChunkEntry);
  const bool hasMetadata = header.version == metadataVersion;
  const std::uint64_t rest = frontBytes > fileBytes ? 0 : fileBytes - frontBytes;
  if (frontBytes > fileBytes || header.dataBytes > rest || (!hasMetadata && header.dataBytes != rest)) {
    fail(fmt::format("it has {} bytes, its header says {} + {}", fileBytes, frontBytes, header.dataBytes));
  }
  if (hasMetadata && (rest - header.dataBytes < sizeof(MetadataHeader) ||
                      rest - header.dataBytes > sizeof(MetadataHeader) + maxMetadataBytes)) {
    fail(fmt::format("{} bytes behind its chunks can't be metadata", rest - header.dataBytes));
  }
  return header;
}

/// Offset of the metadata in the file, or the file's end.
std::uint64_t metadataOffset(const Header& header) {
  return sizeof(Header) + header.chunkCount * sizeof(ChunkEntry) + header.dataBytes;
}

/// Parses the bytes from the end of the chunks to the end of the file.
std::optional<Coloring> parseMetadata(const Header& header, std::span<const std::byte> bytes) {
  if (header.version != metadataVersion) return std::nullopt;
  MetadataHeader head{};
  std::memcpy(&head, bytes.data(), sizeof(MetadataHeader));  // parseHeader has checked that it is there
  const std::span<const std::byte> text = bytes.subspan(sizeof(MetadataHeader));
  if (head.kind != kindJson) fail("its metadata aren't JSON");
  if (head.bytes != text.size()) {
    fail(fmt::format("there are {} bytes of metadata, they say {}", text.size(), head.bytes));
  }
  if (head.checksum != checksumOf(text)) fail("the metadata's checksum is wrong");
  try {
    return coloringIn({reinterpret_cast<const char*>(text.data()), text.size()});
  } catch (const Error& error) {
    fail(error.what());
  }
}

std::uint64_t tableBytesOf(const Header& header) {
  return header.chunkCount * sizeof(ChunkEntry);
}

/// A chunk's position in the file and in the VDI.
struct Chunk {
  std::uint64_t dataOffset;  // in the bytes after the table
  std::uint64_t packedBytes;
  std::uint64_t checksum;
  std::uint64_t firstList;
  std::uint64_t listCount;
  std::uint64_t firstSupersegment;
  std::uint64_t supersegmentCount;
};

/// Returns the table's chunks after checking that the file can hold their contents.
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
  if (next.dataOffset != header.dataBytes) fail("the chunks don't add up to the data");
  if (next.firstSupersegment != header.supersegmentCount || next.firstSupersegment > UINT32_MAX) {
    fail("the chunks don't add up to the supersegments");
  }
  return chunks;
}

/// Checks, before memory is allocated, that the chunk is unaltered and expands to the size in the table.
void requireSound(const Chunk& chunk, std::span<const std::byte> packed, Precision precision) {
  if (chunk.checksum != checksumOf(packed)) {
    fail(fmt::format("the checksum of the chunk from list {} on is wrong", chunk.firstList));
  }
  if (detail::announcedBytes(packed) != chunkBytes(chunk.listCount, chunk.supersegmentCount, precision)) {
    fail(fmt::format("the chunk from list {} on doesn't hold {} supersegments", chunk.firstList,
                     chunk.supersegmentCount));
  }
}

/// Decodes a chunk into place (see detail::unpackLists, where `ends` and `segments` are explained) and
/// returns the depth code of its supersegments.
template <typename Segment>
DepthCode decodeChunk(const Chunk& chunk, std::span<const std::byte> packed, std::uint64_t before,
                      std::span<std::uint32_t> ends, std::span<Segment> segments) {
  try {
    return detail::unpackLists(packed, static_cast<std::uint32_t>(before), ends, segments);
  } catch (const Error& error) {
    fail(fmt::format("the chunk from list {} on: {}", chunk.firstList, error.what()));
  }
}

/// The parts of a file in memory. Header, table, metadata and all checksums are sound.
struct ParsedFile {
  Vdi vdi;  // without lists and depth code
  std::vector<Chunk> chunks;
  std::span<const std::byte> data;

  std::span<const std::byte> packed(const Chunk& chunk) const {
    return data.subspan(chunk.dataOffset, chunk.packedBytes);
  }
};

ParsedFile parseFile(std::span<const std::byte> bytes) {
  const Header header = parseHeader(bytes, bytes.size());
  ParsedFile file;
  file.chunks = parseTable(header, bytes.subspan(sizeof(Header)));
  file.vdi = vdiOf(header);
  file.vdi.coloring = parseMetadata(header, bytes.subspan(metadataOffset(header)));
  file.data = bytes.subspan(sizeof(Header) + tableBytesOf(header), header.dataBytes);
  const Precision precision = precisionOf(header);
  eachInParallel(file.chunks.size(), [&](std::size_t i) {
    requireSound(file.chunks[i], file.packed(file.chunks[i]), precision);
  });
  return file;
}

/// Calls decodeOne(index) for all chunks, on several threads, and returns the depth code that they share.
template <typename DecodeOne>
DepthCode decodeChunks(const ParsedFile& file, DecodeOne decodeOne) {
  std::vector<DepthCode> codes(file.chunks.size());
  eachInParallel(file.chunks.size(), [&](std::size_t i) { codes[i] = decodeOne(i); });
  for (const DepthCode& code : codes) {
    if (code != codes.front()) fail("its chunks have different depth codes");
  }
  return codes.front();
}

/// The lists of one chunk that are kept.
template <typename Segment>
struct KeptLists {
  std::vector<Segment> segments;
  std::vector<std::uint32_t> counts;
};

/// `sources`: lists of the file, in ascending order, between which there may be Thinning::noList.
template <typename Segment>
ListsOf<Segment> decodeSome(const ParsedFile& file, std::span<const std::uint32_t> sources, DepthCode& code) {
  std::vector<std::uint32_t> wanted(sources.begin(), sources.end());
  wanted.erase(std::remove(wanted.begin(), wanted.end(), Thinning::noList), wanted.end());
  std::vector<KeptLists<Segment>> kept(file.chunks.size());
  code = decodeChunks(file, [&](std::size_t index) {
    const Chunk& chunk = file.chunks[index];
    ListsOf<Segment> all;
    all.offsets.resize(chunk.listCount + 1);
    all.offsets.front() = 0;
    all.segments.resize(chunk.supersegmentCount);
    const DepthCode chunkCode =
        decodeChunk(chunk, file.packed(chunk), 0, std::span(all.offsets).subspan(1), std::span(all.segments));
    validateLists(all, 0, chunk.listCount, chunk.firstList, file.vdi.budget);
    auto source = std::lower_bound(wanted.begin(), wanted.end(), chunk.firstList);
    for (; source != wanted.end() && *source < chunk.firstList + chunk.listCount; ++source) {
      const std::span<const Segment> list = all.list(*source - chunk.firstList);
      kept[index].segments.insert(kept[index].segments.end(), list.begin(), list.end());
      kept[index].counts.push_back(static_cast<std::uint32_t>(list.size()));
    }
    return chunkCode;
  });

  ListsOf<Segment> lists;
  lists.offsets.reserve(sources.size() + 1);
  std::uint32_t end = 0;
  std::size_t chunk = 0;
  std::size_t place = 0;  // in the chunk
  for (const std::uint32_t source : sources) {
    if (source != Thinning::noList) {
      while (place == kept[chunk].counts.size()) {
        ++chunk;
        place = 0;
      }
      end += kept[chunk].counts[place++];
    }
    lists.offsets.push_back(end);
  }
  lists.segments.reserve(end);
  for (const KeptLists<Segment>& part : kept)
    lists.segments.insert(lists.segments.end(), part.segments.begin(), part.segments.end());
  return lists;
}

VdiFileInfo infoOf(const Header& header, std::optional<Coloring> coloring, std::uint64_t fileBytes) {
  VdiFileInfo info;
  info.version = header.version;
  info.header = vdiOf(header);
  info.header.coloring = std::move(coloring);
  info.supersegmentCount = header.supersegmentCount;
  info.storedBytes = fileBytes;
  info.expandedBytes = bytesInMemory<std::uint64_t>(std::uint64_t{header.width} * header.height + 1,
                                                    header.supersegmentCount, precisionOf(header));
  return info;
}

Header readHeader(const InputFile& file) {
  return parseHeader(file.read(0, std::min<std::uint64_t>(file.size(), sizeof(Header))), file.size());
}

/// Runs `work` with the path as the context of its Format errors.
template <typename Work>
auto withPath(const std::filesystem::path& path, Work work) {
  try {
    return work();
  } catch (const Error& error) {
    if (error.code() != ErrorCode::Format) throw;
    throw Error(ErrorCode::Format, error.what(), path.string());
  }
}

}  // namespace

template <typename Segment>
void encodeChunks(const ListsOf<Segment>& lists, std::size_t first, std::size_t last, std::uint64_t firstList,
                  std::uint32_t budget, const DepthCode& code,
                  const std::function<void(EncodedChunk)>& take) {
  assert(firstList % listsPerChunk == 0);
  const auto encodeOne = [&](std::size_t begin) {
    const std::size_t end = std::min<std::size_t>(begin + listsPerChunk, last);
    validateLists(lists, begin, end, firstList + (begin - first), budget);
    EncodedChunk chunk;
    chunk.bytes = detail::packLists(lists, code, begin, end);
    chunk.entry = {lists.offsets[end] - lists.offsets[begin], static_cast<std::uint32_t>(chunk.bytes.size()),
                   checksumOf(chunk.bytes)};
    return chunk;
  };
  constexpr std::size_t atOnce = 64;
  std::vector<EncodedChunk> chunks;
  for (std::size_t begin = first; begin < last; begin += chunks.size() * listsPerChunk) {
    chunks.resize(std::min<std::size_t>(atOnce, chunksOf(last - begin)));
    eachInParallel(chunks.size(), [&](std::size_t i) { chunks[i] = encodeOne(begin + i * listsPerChunk); });
    for (EncodedChunk& chunk : chunks) take(std::move(chunk));
  }
}

#define VDI_ENCODE_CHUNKS(Segment)                                                             \
  template void encodeChunks(const ListsOf<Segment>&, std::size_t, std::size_t, std::uint64_t, \
                             std::uint32_t, const DepthCode&, const std::function<void(EncodedChunk)>&);
VDI_EACH_ENCODING(VDI_ENCODE_CHUNKS)
#undef VDI_ENCODE_CHUNKS

std::uint64_t headBytes(std::uint64_t lists) {
  return sizeof(Header) + chunksOf(lists) * sizeof(ChunkEntry);
}

std::vector<std::byte> encodeHead(const Vdi& vdi, std::span<const ChunkEntry> table) {
  requireSoundHeader(vdi);
  validateShape(vdi);
  assert(table.size() == chunksOf(listsOf(vdi)));
  Header header = headerOf(vdi);
  header.chunkCount = static_cast<std::uint32_t>(table.size());
  for (const ChunkEntry& entry : table) {
    header.supersegmentCount += entry.supersegmentCount;
    header.dataBytes += entry.packedBytes;
  }
  if (header.supersegmentCount > UINT32_MAX) fail("it would have more than 2^32 supersegments");
  header.tableChecksum = checksumOf(table);
  header.headerChecksum = checksumOf(header);
  std::vector<std::byte> bytes(headBytes(listsOf(vdi)));
  std::memcpy(bytes.data(), &header, sizeof(Header));
  std::memcpy(bytes.data() + sizeof(Header), table.data(), tableBytesOf(header));
  return bytes;
}

std::vector<std::byte> encodeTail(const Vdi& vdi) {
  if (!vdi.coloring) return {};
  const std::string text = metadataText(*vdi.coloring, vdi.time, vdi.timeStep);
  const auto* first = reinterpret_cast<const std::byte*>(text.data());
  const MetadataHeader head{kindJson, static_cast<std::uint32_t>(text.size()),
                            checksumOf(std::span(first, text.size()))};
  std::vector<std::byte> bytes(sizeof(MetadataHeader));
  std::memcpy(bytes.data(), &head, sizeof(MetadataHeader));
  bytes.insert(bytes.end(), first, first + text.size());
  return bytes;
}

std::vector<std::byte> encode(const Vdi& vdi) {
  requireSoundHeader(vdi);
  validateShape(vdi);
  validateEnds(vdi);
  std::vector<ChunkEntry> table;
  std::vector<std::byte> bytes(headBytes(vdi.listCount()));
  const auto append = [&](const EncodedChunk& chunk) {
    table.push_back(chunk.entry);
    bytes.insert(bytes.end(), chunk.bytes.begin(), chunk.bytes.end());
  };
  std::visit(
      [&](const auto& lists) {
        encodeChunks(lists, 0, lists.listCount(), 0, vdi.budget, vdi.depthCode, append);
      },
      vdi.lists);
  const std::vector<std::byte> head = encodeHead(vdi, table);
  std::copy(head.begin(), head.end(), bytes.begin());
  const std::vector<std::byte> tail = encodeTail(vdi);
  bytes.insert(bytes.end(), tail.begin(), tail.end());
  return bytes;
}

Vdi decode(std::span<const std::byte> bytes) {
  ParsedFile file = parseFile(bytes);
  Vdi& vdi = file.vdi;
  std::visit(
      [&](auto& lists) {
        lists.offsets.resize(listsOf(vdi) + 1);
        lists.segments.resize(file.chunks.back().firstSupersegment + file.chunks.back().supersegmentCount);
        vdi.depthCode = decodeChunks(file, [&](std::size_t index) {
          const Chunk& chunk = file.chunks[index];
          return decodeChunk(
              chunk, file.packed(chunk), chunk.firstSupersegment,
              std::span(lists.offsets).subspan(chunk.firstList + 1, chunk.listCount),
              std::span(lists.segments).subspan(chunk.firstSupersegment, chunk.supersegmentCount));
        });
        eachInParallel(file.chunks.size(), [&](std::size_t i) {
          const Chunk& chunk = file.chunks[i];
          validateLists(lists, chunk.firstList, chunk.firstList + chunk.listCount, chunk.firstList,
                        vdi.budget);
        });
      },
      vdi.lists);
  validateShape(vdi);
  validateEnds(vdi);
  return std::move(vdi);
}

Vdi decodeThinned(std::span<const std::byte> bytes, int factor) {
  const ParsedFile file = parseFile(bytes);
  Thinning thinning = thinningOf(file.vdi, factor);
  Vdi& few = thinning.few;
  std::visit(
      [&](const auto& lists) {
        using Lists = std::decay_t<decltype(lists)>;
        using Segment = typename decltype(Lists::segments)::value_type;
        few.lists = decodeSome<Segment>(file, thinning.sources, few.depthCode);
      },
      file.vdi.lists);
  validateShape(few);
  return std::move(few);
}

VdiFileInfo decodeInfo(std::span<const std::byte> bytes) {
  const Header header = parseHeader(bytes, bytes.size());
  static_cast<void>(parseTable(header, bytes.subspan(sizeof(Header))));
  return infoOf(header, parseMetadata(header, bytes.subspan(metadataOffset(header))), bytes.size());
}

void writeVdi(const std::filesystem::path& path, const Vdi& vdi) {
  const std::vector<std::byte> bytes = withPath(path, [&] { return encode(vdi); });
  writeAtomically(path, bytes);
}

Vdi readVdi(const std::filesystem::path& path) {
  const InputFile file(path);
  return withPath(path, [&] {
    static_cast<void>(readHeader(file));  // checks before it allocates memory for another file's bytes
    return decode(file.readAll());
  });
}

VdiFileInfo readVdiInfo(const std::filesystem::path& path) {
  const InputFile file(path);
  return withPath(path, [&] {
    const Header header = readHeader(file);
    static_cast<void>(parseTable(header, file.read(sizeof(Header), tableBytesOf(header))));
    const std::uint64_t end = metadataOffset(header);
    return infoOf(header, parseMetadata(header, file.read(end, file.size() - end)), file.size());
  });
}

}  // namespace vdi::io
