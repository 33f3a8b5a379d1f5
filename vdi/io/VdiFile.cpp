#include "vdi/io/VdiFile.h"

#include <fmt/format.h>
#include <lz4.h>
#include <unistd.h>
#include <xxhash.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <system_error>

#include "vdi/core/Error.h"

namespace vdi::io {

namespace {

static_assert(std::endian::native == std::endian::little,
              "the .vdi file is little-endian and read as it lies");

constexpr std::array<char, 8> magic{'V', 'D', 'I', '-', 'F', 'I', 'L', 'E'};
constexpr std::uint32_t currentVersion = 1;
constexpr std::uint32_t encodingFull = 0;  // floats, byte planes, LZ4
constexpr std::uint32_t listsPerChunk = 16384;
constexpr std::uint32_t flagParallel = 1;
constexpr std::uint64_t lz4MaxRatio = 255;
constexpr std::size_t floatsPerSegment = sizeof(Supersegment) / sizeof(float);

/// docs/format.md has the table.
struct Header {
  std::array<char, 8> magic;
  std::uint32_t version;
  std::uint32_t encoding;
  std::uint32_t width;
  std::uint32_t height;
  std::uint32_t budget;
  std::uint32_t flags;
  std::uint64_t supersegmentCount;
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
  std::uint32_t listsPerChunk;
  std::uint32_t chunkCount;
  std::uint64_t checksum;  // XXH64 of the header's bytes before this field and of the chunk table
};
static_assert(offsetof(Header, supersegmentCount) == 32);
static_assert(offsetof(Header, boundsLo) == 64);
static_assert(offsetof(Header, position) == 112);
static_assert(offsetof(Header, viewAngle) == 184);
static_assert(offsetof(Header, checksum) == 208);
static_assert(sizeof(Header) == 216);

struct ChunkEntry {
  std::uint32_t segmentCount;
  std::uint32_t compressedBytes;
  std::uint64_t checksum;  // XXH64 of the compressed bytes
};
static_assert(sizeof(ChunkEntry) == 16);

[[noreturn]] void fail(const std::string& what) {
  throw Error(ErrorCode::Format, "not a sound .vdi file: " + what);
}

std::uint64_t headerChecksum(const Header& header, std::span<const ChunkEntry> table) {
  const std::uint64_t first = XXH64(&header, offsetof(Header, checksum), 0);
  return XXH64(table.data(), table.size_bytes(), first);
}

/// Byte b of value i goes to planes[b * count + i]: bytes of one significance lie together, which LZ4 likes.
void split(std::span<const std::uint32_t> values, std::byte* planes) {
  const std::size_t count = values.size();
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t b = 0; b < 4; ++b) planes[b * count + i] = static_cast<std::byte>(values[i] >> (8 * b));
  }
}

void join(const std::byte* planes, std::span<std::uint32_t> values) {
  const std::size_t count = values.size();
  for (std::size_t i = 0; i < count; ++i) {
    std::uint32_t value = 0;
    for (std::size_t b = 0; b < 4; ++b) value |= static_cast<std::uint32_t>(planes[b * count + i]) << (8 * b);
    values[i] = value;
  }
}

/// One chunk before compression: the counts of its lists, then six columns (front, back, red, green, blue,
/// opacity) of its supersegments, each value as the XOR with the one before, each column in byte planes.
std::vector<std::byte> layOut(const SupersegmentLists& lists, std::size_t first, std::size_t last) {
  const std::size_t listCount = last - first;
  const std::size_t begin = lists.offsets[first];
  const std::size_t count = lists.offsets[last] - begin;
  std::vector<std::byte> bytes((listCount + count * floatsPerSegment) * 4);
  std::vector<std::uint32_t> column(listCount);
  for (std::size_t i = 0; i < listCount; ++i) column[i] = lists.countOf(first + i);
  split(column, bytes.data());
  column.resize(count);
  for (std::size_t c = 0; c < floatsPerSegment; ++c) {
    std::uint32_t previous = 0;
    for (std::size_t i = 0; i < count; ++i) {
      std::uint32_t word = 0;
      std::memcpy(&word, reinterpret_cast<const std::byte*>(&lists.segments[begin + i]) + c * 4, 4);
      column[i] = word ^ previous;
      previous = word;
    }
    split(column, bytes.data() + (listCount + c * count) * 4);
  }
  return bytes;
}

void takeIn(std::span<const std::byte> bytes, std::size_t listCount, std::size_t count,
            SupersegmentLists& lists) {
  std::vector<std::uint32_t> column(listCount);
  join(bytes.data(), column);
  const std::uint64_t before = lists.segments.size();
  std::uint64_t total = 0;
  for (const std::uint32_t n : column) {
    total += n;
    if (total > count) fail("the counts of a chunk don't match its table entry");
    lists.offsets.push_back(static_cast<std::uint32_t>(before + total));
  }
  if (total != count) fail("the counts of a chunk don't match its table entry");
  lists.segments.resize(before + count);
  column.resize(count);
  for (std::size_t c = 0; c < floatsPerSegment; ++c) {
    join(bytes.data() + (listCount + c * count) * 4, column);
    std::uint32_t word = 0;
    for (std::size_t i = 0; i < count; ++i) {
      word ^= column[i];
      std::memcpy(reinterpret_cast<std::byte*>(&lists.segments[before + i]) + c * 4, &word, 4);
    }
  }
}

Header headerOf(const Vdi& vdi) {
  Header header{};
  header.magic = magic;
  header.version = currentVersion;
  header.encoding = encodingFull;
  header.width = static_cast<std::uint32_t>(vdi.width);
  header.height = static_cast<std::uint32_t>(vdi.height);
  header.budget = vdi.budget;
  header.flags = vdi.camera.parallelProjection ? flagParallel : 0;
  header.supersegmentCount = vdi.lists.segments.size();
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
  header.listsPerChunk = listsPerChunk;
  header.chunkCount = static_cast<std::uint32_t>((vdi.lists.listCount() + listsPerChunk - 1) / listsPerChunk);
  return header;
}

/// Header and table of a file whose bytes are all there; everything checked that can be without
/// decompressing.
struct Parsed {
  Header header;
  std::vector<ChunkEntry> table;
  std::size_t dataStart;

  std::uint64_t listCount() const { return std::uint64_t{header.width} * header.height; }
  std::uint64_t listsIn(std::uint32_t chunk) const {
    const std::uint64_t first = std::uint64_t{chunk} * header.listsPerChunk;
    return std::min<std::uint64_t>(header.listsPerChunk, listCount() - first);
  }
};

Parsed parse(std::span<const std::byte> bytes) {
  Parsed parsed{};
  if (bytes.size() < sizeof(Header)) fail(fmt::format("{} bytes are too few for a header", bytes.size()));
  Header& header = parsed.header;
  std::memcpy(&header, bytes.data(), sizeof(Header));
  if (header.magic != magic) fail("it doesn't start with VDI-FILE");
  if (header.version != currentVersion) {
    fail(fmt::format("version {}; this program reads version {}", header.version, currentVersion));
  }
  if (header.encoding != encodingFull) fail(fmt::format("unknown encoding {}", header.encoding));
  const bool sane = header.width >= 1 && header.width <= 32768 && header.height >= 1 &&
                    header.height <= 32768 && header.listsPerChunk >= 1 && header.budget >= 1;
  if (!sane) fail("impossible sizes in the header");
  const std::uint64_t chunks = (parsed.listCount() + header.listsPerChunk - 1) / header.listsPerChunk;
  if (chunks != header.chunkCount) fail("the number of chunks doesn't match the number of lists");
  parsed.dataStart = sizeof(Header) + chunks * sizeof(ChunkEntry);
  if (bytes.size() < parsed.dataStart) fail("it ends within the chunk table");
  parsed.table.resize(chunks);
  std::memcpy(parsed.table.data(), bytes.data() + sizeof(Header), chunks * sizeof(ChunkEntry));
  if (header.checksum != headerChecksum(header, parsed.table)) fail("the header's checksum is wrong");
  std::uint64_t stored = parsed.dataStart;
  std::uint64_t segments = 0;
  for (std::uint32_t i = 0; i < parsed.table.size(); ++i) {
    const ChunkEntry& entry = parsed.table[i];
    stored += entry.compressedBytes;
    segments += entry.segmentCount;
    const std::uint64_t expanded =
        (parsed.listsIn(i) + std::uint64_t{entry.segmentCount} * floatsPerSegment) * 4;
    if (expanded > (std::uint64_t{entry.compressedBytes} + 16) * lz4MaxRatio ||
        expanded > LZ4_MAX_INPUT_SIZE) {
      fail("a chunk claims to be larger than its bytes can hold");
    }
  }
  if (segments != header.supersegmentCount || segments > UINT32_MAX)
    fail("the chunks don't add up to the header's count");
  if (stored != bytes.size()) fail(fmt::format("{} bytes, {} were announced", bytes.size(), stored));
  return parsed;
}

Vdi vdiOf(const Header& header) {
  Vdi vdi;
  vdi.width = static_cast<int>(header.width);
  vdi.height = static_cast<int>(header.height);
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
  try {
    static_cast<void>(vdi.view());  // a camera that can't be used is as bad as a wrong byte
  } catch (const Error& error) {
    fail(error.what());
  }
  return vdi;
}

std::vector<std::byte> readAll(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file) throw Error(ErrorCode::Io, "can't open the file", path.string());
  const auto size = static_cast<std::streamoff>(file.tellg());
  if (size < 0) throw Error(ErrorCode::Io, "can't read the file", path.string());
  std::vector<std::byte> bytes(static_cast<std::size_t>(size));
  file.seekg(0);
  file.read(reinterpret_cast<char*>(bytes.data()), size);
  if (!file) throw Error(ErrorCode::Io, "can't read the file", path.string());
  return bytes;
}

/// Runs `work` with the path as the context of its Format errors.
template <typename Work>
auto withPath(const std::filesystem::path& path, Work work) {
  try {
    return work(readAll(path));
  } catch (const Error& error) {
    if (error.code() != ErrorCode::Format) throw;
    throw Error(ErrorCode::Format, error.what(), path.string());
  }
}

}  // namespace

std::vector<std::byte> encode(const Vdi& vdi) {
  Header header = headerOf(vdi);
  std::vector<ChunkEntry> table(header.chunkCount);
  std::vector<std::byte> bytes(sizeof(Header) + table.size() * sizeof(ChunkEntry));
  std::vector<std::byte> packed;
  for (std::size_t i = 0; i < table.size(); ++i) {
    const std::size_t first = i * listsPerChunk;
    const std::size_t last = std::min<std::size_t>(first + listsPerChunk, vdi.lists.listCount());
    const std::vector<std::byte> plain = layOut(vdi.lists, first, last);
    packed.resize(static_cast<std::size_t>(LZ4_compressBound(static_cast<int>(plain.size()))));
    const int size = LZ4_compress_default(reinterpret_cast<const char*>(plain.data()),
                                          reinterpret_cast<char*>(packed.data()),
                                          static_cast<int>(plain.size()), static_cast<int>(packed.size()));
    if (size <= 0) throw Error(ErrorCode::Io, "LZ4 couldn't compress a chunk");
    table[i] = {vdi.lists.offsets[last] - vdi.lists.offsets[first], static_cast<std::uint32_t>(size),
                XXH64(packed.data(), static_cast<std::size_t>(size), 0)};
    bytes.insert(bytes.end(), packed.begin(), packed.begin() + size);
  }
  header.checksum = headerChecksum(header, table);
  std::memcpy(bytes.data(), &header, sizeof(Header));
  std::memcpy(bytes.data() + sizeof(Header), table.data(), table.size() * sizeof(ChunkEntry));
  return bytes;
}

Vdi decode(std::span<const std::byte> bytes) {
  const Parsed parsed = parse(bytes);
  Vdi vdi = vdiOf(parsed.header);
  vdi.lists.offsets.reserve(parsed.listCount() + 1);
  vdi.lists.segments.reserve(parsed.header.supersegmentCount);
  std::size_t at = parsed.dataStart;
  std::vector<std::byte> plain;
  for (std::uint32_t i = 0; i < parsed.table.size(); ++i) {
    const ChunkEntry& entry = parsed.table[i];
    const std::byte* packed = bytes.data() + at;
    if (XXH64(packed, entry.compressedBytes, 0) != entry.checksum)
      fail(fmt::format("the checksum of chunk {} is wrong", i));
    plain.resize((parsed.listsIn(i) + std::uint64_t{entry.segmentCount} * floatsPerSegment) * 4);
    const int size =
        LZ4_decompress_safe(reinterpret_cast<const char*>(packed), reinterpret_cast<char*>(plain.data()),
                            static_cast<int>(entry.compressedBytes), static_cast<int>(plain.size()));
    if (size < 0 || static_cast<std::size_t>(size) != plain.size())
      fail(fmt::format("chunk {} doesn't decompress", i));
    takeIn(plain, parsed.listsIn(i), entry.segmentCount, vdi.lists);
    at += entry.compressedBytes;
  }
  validate(vdi);
  return vdi;
}

VdiFileInfo decodeInfo(std::span<const std::byte> bytes) {
  const Parsed parsed = parse(bytes);
  VdiFileInfo info;
  info.version = parsed.header.version;
  info.header = vdiOf(parsed.header);
  info.supersegmentCount = parsed.header.supersegmentCount;
  info.storedBytes = bytes.size();
  info.expandedBytes =
      (parsed.listCount() + 1) * sizeof(std::uint32_t) + info.supersegmentCount * sizeof(Supersegment);
  return info;
}

void writeVdi(const std::filesystem::path& path, const Vdi& vdi) {
  const std::vector<std::byte> bytes = encode(vdi);
  const std::filesystem::path temporary = path.string() + fmt::format(".{}.tmp", ::getpid());
  std::ofstream file(temporary, std::ios::binary);
  file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  file.close();
  std::error_code error;
  if (file) std::filesystem::rename(temporary, path, error);
  if (!file || error) {
    std::error_code ignored;
    std::filesystem::remove(temporary, ignored);
    throw Error(ErrorCode::Io, "can't write the file", path.string());
  }
}

Vdi readVdi(const std::filesystem::path& path) {
  return withPath(path, [](const std::vector<std::byte>& bytes) { return decode(bytes); });
}

VdiFileInfo readVdiInfo(const std::filesystem::path& path) {
  return withPath(path, [](const std::vector<std::byte>& bytes) { return decodeInfo(bytes); });
}

}  // namespace vdi::io
