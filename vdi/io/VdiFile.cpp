#include "vdi/io/VdiFile.h"

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cassert>
#include <cstdint>
#include <cstring>
#include <future>
#include <memory>
#include <optional>
#include <utility>

#include "vdi/core/Error.h"
#include "vdi/core/Estimate.h"
#include "vdi/core/InOrder.h"
#include "vdi/core/Parallel.h"
#include "vdi/core/Thinning.h"
#include "vdi/io/Files.h"
#include "vdi/io/ListCodec.h"
#include "vdi/io/Metadata.h"
#include "vdi/io/VdiDecoder.h"
#include "vdi/io/VdiLayout.h"
#include "vdi/io/VdiParts.h"

namespace vdi::io {

using detail::checksumOf;
using detail::Chunk;
using detail::decodeChunk;
using detail::fail;
using detail::fileHeaderOf;
using detail::Header;
using detail::kindJson;
using detail::listsOf;
using detail::MetadataHeader;
using detail::metadataOffset;
using detail::parseHeader;
using detail::parseMetadata;
using detail::parseTable;
using detail::precisionOf;
using detail::requireCode;
using detail::requireSound;
using detail::requireSoundHeader;
using detail::tableBytesOf;
using detail::vdiOf;

namespace {

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

/// Some lists of a file, which are taken from its chunks in any order, on several threads.
template <typename Segment>
class Selection {
 public:
  /// `sources`: lists of the file in ascending order, with Thinning::noList in between where none is kept.
  Selection(const std::vector<std::uint32_t>& sources, std::size_t chunks)
      : sources_(sources), wanted_(sources), kept_(chunks) {
    wanted_.erase(std::remove(wanted_.begin(), wanted_.end(), Thinning::noList), wanted_.end());
  }

  /// Call once for each chunk; `all` holds the chunk's lists.
  void take(std::size_t index, const Chunk& chunk, const ListsOf<Segment>& all) {
    Kept& kept = kept_[index];
    auto source = std::lower_bound(wanted_.begin(), wanted_.end(), chunk.firstList);
    for (; source != wanted_.end() && *source < chunk.firstList + chunk.listCount; ++source) {
      const std::span<const Segment> list = all.list(*source - chunk.firstList);
      kept.segments.insert(kept.segments.end(), list.begin(), list.end());
      kept.counts.push_back(static_cast<std::uint32_t>(list.size()));
    }
  }

  ListsOf<Segment> lists() const {
    ListsOf<Segment> lists;
    lists.offsets.reserve(sources_.size() + 1);
    std::uint32_t end = 0;
    std::size_t chunk = 0;
    std::size_t place = 0;  // in the chunk
    for (const std::uint32_t source : sources_) {
      if (source != Thinning::noList) {
        while (place == kept_[chunk].counts.size()) {
          ++chunk;
          place = 0;
        }
        end += kept_[chunk].counts[place++];
      }
      lists.offsets.push_back(end);
    }
    lists.segments.reserve(end);
    for (const Kept& kept : kept_)
      lists.segments.insert(lists.segments.end(), kept.segments.begin(), kept.segments.end());
    return lists;
  }

 private:
  struct Kept {
    std::vector<Segment> segments;
    std::vector<std::uint32_t> counts;  // of each list
  };
  const std::vector<std::uint32_t>& sources_;
  std::vector<std::uint32_t> wanted_;
  std::vector<Kept> kept_;  // by chunk
};

/// Fills the thinnings' lists and depth codes. Each chunk is expanded once.
template <typename Segment>
void decodeSome(const ParsedFile& file, std::vector<Thinning>& thinnings) {
  std::vector<Selection<Segment>> selections;
  selections.reserve(thinnings.size());
  for (const Thinning& thinning : thinnings) selections.emplace_back(thinning.sources, file.chunks.size());
  std::vector<DepthCode> codes(file.chunks.size());
  eachInParallel(file.chunks.size(), [&](std::size_t index) {
    const Chunk& chunk = file.chunks[index];
    ListsOf<Segment> all;
    all.offsets.resize(chunk.listCount + 1);
    all.offsets.front() = 0;
    all.segments.resize(chunk.supersegmentCount);
    codes[index] =
        decodeChunk(chunk, file.packed(chunk), 0, std::span(all.offsets).subspan(1), std::span(all.segments));
    validateLists(all, 0, chunk.listCount, chunk.firstList, file.vdi.budget);
    for (Selection<Segment>& selection : selections) selection.take(index, chunk, all);
  });
  requireCode(codes.front(), codes);
  for (std::size_t i = 0; i < thinnings.size(); ++i) {
    thinnings[i].few.depthCode = codes.front();
    thinnings[i].few.lists = selections[i].lists();
  }
}

VdiFileInfo infoOf(const Header& header, std::optional<Coloring> coloring, std::uint64_t fileBytes) {
  VdiFileInfo info;
  info.version = header.version;
  info.header = vdiOf(header);
  info.header.coloring = std::move(coloring);
  info.supersegmentCount = header.supersegmentCount;
  info.storedBytes = fileBytes;
  info.expandedBytes = detail::bytesInMemoryOf(header);
  info.checksum = header.headerChecksum;
  return info;
}

Header readHeader(const InputFile& file) {
  return parseHeader(file.read(0, std::min<std::uint64_t>(file.size(), sizeof(Header))), file.size());
}

/// Asks for large pages where the system has some. With small ones, page faults delay the thread
/// that appends the chunks of a large file.
void preferLargePages(std::span<std::byte> memory) {
  const auto page = static_cast<std::uintptr_t>(::sysconf(_SC_PAGESIZE));
  void* first = memory.data();
  std::size_t bytes = memory.size();
  if (std::align(page, page, first, bytes) != nullptr)
    (void)::madvise(first, bytes / page * page, MADV_HUGEPAGE);
}

/// Runs `work` with the path as the context of errors that the file's content causes.
template <typename Work>
auto withPath(const std::filesystem::path& path, Work work) {
  try {
    return work();
  } catch (const Error& error) {
    if (error.code() != ErrorCode::Format && error.code() != ErrorCode::OutOfMemory) throw;
    throw Error(error.code(), error.what(), path.string());
  }
}

}  // namespace

template <typename Segment>
void encodeChunks(const ListsOf<Segment>& lists, std::size_t first, std::size_t last, std::uint64_t firstList,
                  std::uint32_t budget, const DepthCode& code,
                  const std::function<void(EncodedChunk)>& take) {
  assert(firstList % listsPerChunk == 0);
  const auto makeEncoder = [&] {
    return [&, scratch = detail::PackScratch()](std::size_t index) mutable {
      const std::size_t begin = first + index * listsPerChunk;
      const std::size_t end = std::min<std::size_t>(begin + listsPerChunk, last);
      validateLists(lists, begin, end, firstList + (begin - first), budget);
      EncodedChunk chunk;
      chunk.bytes = detail::packLists(lists, code, begin, end, scratch);
      chunk.entry = {lists.offsets[end] - lists.offsets[begin],
                     static_cast<std::uint32_t>(chunk.bytes.size()), checksumOf(chunk.bytes)};
      return chunk;
    };
  };
  constexpr std::size_t ahead = 64;
  inOrder(chunksOf(last - first), ahead, makeEncoder, take);
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
  Header header = fileHeaderOf(vdi);
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
  return *encodeWhile(vdi, [] { return true; });
}

std::optional<std::vector<std::byte>> encodeWhile(const Vdi& vdi, const std::function<bool()>& goesOn) {
  requireSoundHeader(vdi);
  validateShape(vdi);
  validateEnds(vdi);
  std::vector<ChunkEntry> table;
  std::vector<std::byte> bytes;
  // Room for the chunks as they are before LZ4. Pages that stay empty take no memory.
  bytes.reserve(headBytes(vdi.listCount()) +
                chunkBytes(vdi.listCount(), vdi.supersegmentCount(), vdi.precision()));
  preferLargePages({bytes.data(), bytes.capacity()});
  bytes.resize(headBytes(vdi.listCount()));
  struct GaveUp {};  // ends encodeChunks and its threads
  const auto append = [&](const EncodedChunk& chunk) {
    if (!goesOn()) throw GaveUp();
    table.push_back(chunk.entry);
    bytes.insert(bytes.end(), chunk.bytes.begin(), chunk.bytes.end());
  };
  try {
    std::visit(
        [&](const auto& lists) {
          encodeChunks(lists, 0, lists.listCount(), 0, vdi.budget, vdi.depthCode, append);
        },
        vdi.lists);
  } catch (const GaveUp&) {
    return std::nullopt;
  }
  const std::vector<std::byte> head = encodeHead(vdi, table);
  std::copy(head.begin(), head.end(), bytes.begin());
  const std::vector<std::byte> tail = encodeTail(vdi);
  bytes.insert(bytes.end(), tail.begin(), tail.end());
  return bytes;
}

Vdi decode(std::span<const std::byte> bytes) {
  VdiDecoder decoder(bytes.size());
  decoder.add(bytes);
  return decoder.finish();
}

std::vector<Vdi> decodeThinned(std::span<const std::byte> bytes, const std::vector<int>& factors) {
  const ParsedFile file = parseFile(bytes);
  std::vector<Thinning> thinnings;
  thinnings.reserve(factors.size());
  for (const int factor : factors) thinnings.push_back(thinningOf(file.vdi, factor));
  std::visit(
      [&](const auto& lists) {
        using Lists = std::decay_t<decltype(lists)>;
        decodeSome<typename decltype(Lists::segments)::value_type>(file, thinnings);
      },
      file.vdi.lists);
  std::vector<Vdi> results;
  results.reserve(thinnings.size());
  for (Thinning& thinning : thinnings) {
    validateShape(thinning.few);
    results.push_back(std::move(thinning.few));
  }
  return results;
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

/// Reads each piece while the previous one is decoded. If the file is of another kind, reads only its first
/// bytes.
Vdi readVdi(const std::filesystem::path& path) {
  constexpr std::uint64_t pieceBytes = std::uint64_t{16} << 20;
  const InputFile file(path);
  const auto pieceAt = [&](std::uint64_t offset) {
    const std::uint64_t count = std::min(pieceBytes, file.size() - offset);
    return std::async(std::launch::async | std::launch::deferred,
                      [&file, offset, count] { return file.read(offset, count); });
  };
  return withPath(path, [&] {
    VdiDecoder decoder(file.size());
    const std::uint64_t headBytes = std::min<std::uint64_t>(file.size(), sizeof(Header));
    decoder.add(file.read(0, headBytes));
    std::future<std::vector<std::byte>> next;
    for (std::uint64_t offset = headBytes; !decoder.hasFailed() && offset < file.size();) {
      const std::vector<std::byte> piece = next.valid() ? next.get() : pieceAt(offset).get();
      offset += piece.size();
      if (offset < file.size()) next = pieceAt(offset);
      decoder.add(piece);
    }
    return decoder.finish();
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
