#include "vdi/page/PlainChunks.h"

#include <lz4.h>
#include <xxhash.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>

#include "vdi/core/Encoding.h"
#include "vdi/core/Error.h"
#include "vdi/io/VdiFile.h"
#include "vdi/io/VdiParts.h"

namespace vdi::page {

namespace {

// Places in the header (docs/format.md).
constexpr std::size_t encodingAt = 16;
constexpr std::size_t widthAt = 24;
constexpr std::size_t heightAt = 28;
constexpr std::size_t listsPerChunkAt = 36;
constexpr std::size_t chunkCountAt = 40;
constexpr std::size_t dataBytesAt = 56;
constexpr std::size_t tableChecksumAt = 224;
constexpr std::size_t headerChecksumAt = 232;

template <typename Number>
Number numberAt(std::span<const std::byte> bytes, std::size_t at) {
  Number number;
  std::memcpy(&number, bytes.data() + at, sizeof(number));
  return number;
}

template <typename Number>
void setNumber(std::span<std::byte> bytes, std::size_t at, Number number) {
  std::memcpy(bytes.data() + at, &number, sizeof(number));
}

/// Appends an LZ4 block that expands to `plain`: one sequence of literals.
void appendLiterals(std::vector<std::byte>& to, std::span<const std::byte> plain) {
  constexpr std::size_t more = 15;  // in a length of four bits: bytes follow, until one isn't 255
  to.push_back(static_cast<std::byte>(std::min(plain.size(), more) << 4U));
  if (plain.size() >= more) {
    const std::size_t rest = plain.size() - more;
    to.insert(to.end(), rest / 255, std::byte{255});
    to.push_back(static_cast<std::byte>(rest % 255));
  }
  to.insert(to.end(), plain.begin(), plain.end());
}

}  // namespace

std::vector<std::byte> withPlainChunks(std::span<const std::byte> file) {
  static_cast<void>(io::decode(file));  // from here on, all lengths are valid
  const auto precision = static_cast<Precision>(numberAt<std::uint32_t>(file, encodingAt));
  const std::uint64_t lists =
      std::uint64_t{numberAt<std::uint32_t>(file, widthAt)} * numberAt<std::uint32_t>(file, heightAt);
  const std::uint64_t perChunk = numberAt<std::uint32_t>(file, listsPerChunkAt);
  const std::size_t chunkCount = numberAt<std::uint32_t>(file, chunkCountAt);
  const std::size_t dataAt = io::fileHeaderBytes + chunkCount * sizeof(io::ChunkEntry);

  std::vector<std::byte> result(file.begin(), file.begin() + static_cast<std::ptrdiff_t>(dataAt));
  std::vector<std::byte> plain;
  std::size_t from = dataAt;
  for (std::size_t c = 0; c < chunkCount; ++c) {
    const std::size_t entryAt = io::fileHeaderBytes + c * sizeof(io::ChunkEntry);
    auto entry = numberAt<io::ChunkEntry>(file, entryAt);
    const std::uint64_t listCount = std::min(perChunk, lists - c * perChunk);
    plain.resize(chunkBytes(listCount, entry.supersegmentCount, precision));
    if (LZ4_decompress_safe(reinterpret_cast<const char*>(file.data() + from),
                            reinterpret_cast<char*>(plain.data()), static_cast<int>(entry.packedBytes),
                            static_cast<int>(plain.size())) != static_cast<int>(plain.size())) {
      throw Error(ErrorCode::Format, "a chunk doesn't decompress to the size that it should have");
    }
    from += entry.packedBytes;
    const std::size_t begin = result.size();
    appendLiterals(result, plain);
    if (result.size() - begin > std::numeric_limits<std::uint32_t>::max()) {
      throw Error(ErrorCode::Io, "too many supersegments in one chunk of lists");
    }
    entry.packedBytes = static_cast<std::uint32_t>(result.size() - begin);
    entry.checksum = XXH64(result.data() + begin, entry.packedBytes, 0);
    setNumber(result, entryAt, entry);
  }
  setNumber(result, dataBytesAt, std::uint64_t{result.size() - dataAt});
  setNumber(result, tableChecksumAt,
            std::uint64_t{XXH64(result.data() + io::fileHeaderBytes, dataAt - io::fileHeaderBytes, 0)});
  setNumber(result, headerChecksumAt, std::uint64_t{XXH64(result.data(), headerChecksumAt, 0)});
  result.insert(result.end(), file.begin() + static_cast<std::ptrdiff_t>(from), file.end());
  return result;
}

}  // namespace vdi::page
