// All ranks write a .vdi file together: each encodes and writes the chunks of its own lists. Not part of the
// library's interface.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "vdi/comm/Communicator.h"
#include "vdi/core/Vdi.h"
#include "vdi/io/Files.h"
#include "vdi/io/VdiParts.h"
#include "vdi/pipeline/Reports.h"

namespace vdi::detail {

/// The rank that writes the chunks that a rank other than the root has encoded.
enum class WrittenBy {
  Owner,  // the encoding rank, if it can open the file; else the root
  Root    // the root writes, as for hosts that lack the file's folder
};

/// The file equals that of io::writeVdi for the whole VDI byte for byte, whichever ranks have which lists. It
/// gets its name when it is complete, and only if all ranks have done their part; otherwise the old file
/// stays (io::OutputFile). A rank holds the chunks of its own lists, and the root at most one more chunk of
/// other ranks'. Throws on all ranks.
template <typename Segment>
class VdiWriter {
 public:
  /// Collective. `header` is the VDI without lists; its size, budget and depth code must be equal on all
  /// ranks, while the rest and `path` are the root's. `comm` must outlive it.
  VdiWriter(const comm::Communicator& comm, int root, const std::filesystem::path& path, const Vdi& header,
            WrittenBy writtenBy = WrittenBy::Owner);

  /// Not collective; call within Communicator::together. Adds consecutive lists of this rank, starting at
  /// list `firstList` of the VDI. Any rank may add any list, each list once. Incomplete chunks are copied.
  /// The file's first chunks are written at once if the root has them.
  void add(std::uint64_t firstList, const ListsOf<Segment>& lists);

  /// Collective; call when all ranks have added their lists. Returns the same on all ranks.
  WrittenVdi finish();

  std::uint64_t bytesSent() const { return bytesSent_; }        // to other ranks
  std::uint64_t bytesWritten() const { return bytesWritten_; }  // into the file, by this rank

 private:
  /// The lists of an incomplete chunk.
  struct ChunkPart {
    std::uint64_t firstList = 0;
    ListsOf<Segment> lists;
    std::uint64_t end() const { return firstList + lists.listCount(); }
  };
  /// A part of a chunk, and the rank that encodes the chunk.
  struct Route {
    int from = 0;
    int to = 0;
    std::uint64_t firstList = 0;
    std::uint64_t listCount = 0;
    std::uint64_t supersegmentCount = 0;
  };
  /// A chunk that this rank has encoded.
  struct Chunk {
    std::uint64_t index = 0;
    io::ChunkEntry entry{};
    std::vector<std::byte> bytes;  // empty once written
  };
  /// All chunks, known to all ranks.
  struct Table {
    std::vector<io::ChunkEntry> entries;
    std::vector<int> owners;
    std::vector<std::uint64_t> offsets;  // offsets of the chunks in the file, then their end
  };

  bool isRoot() const { return comm_.rank() == root_; }
  std::uint64_t chunkEnd(std::uint64_t list) const;
  void append(ChunkPart& part, const ListsOf<Segment>& lists, std::size_t first, std::size_t last) const;
  void addToPart(std::uint64_t firstList, const ListsOf<Segment>& lists, std::size_t first, std::size_t last);
  void encode(const ListsOf<Segment>& lists, std::size_t first, std::size_t last, std::uint64_t firstList);
  void keep(std::uint64_t index, io::EncodedChunk chunk);
  std::vector<Route> routeParts() const;
  std::vector<ChunkPart> exchangeParts(std::span<const Route> routes);
  void encodeJoined(std::span<const Route> routes, std::span<const ChunkPart> received);
  void joinParts();
  Table shareTable() const;
  std::filesystem::path prepareFile(const Table& table);
  void writeOwn(const Table& table, io::SharedOutput* shared);
  void writeByRoot(const Table& table, std::span<const std::uint64_t> writesItself);

  const comm::Communicator& comm_;
  int root_;
  std::filesystem::path path_;
  Vdi header_;
  WrittenBy writtenBy_;
  std::uint64_t listCount_;
  std::unique_ptr<io::OutputFile> file_;  // the root's
  std::vector<std::byte> tail_;           // the root's: the bytes after the chunks
  std::vector<ChunkPart> parts_;          // the last one may grow
  std::vector<Chunk> chunks_;
  std::uint64_t firstChunks_ = 0;  // chunks at the file's start that are written
  std::uint64_t writtenEnd_;       // their end in the file
  std::uint64_t bytesSent_ = 0;
  std::uint64_t bytesWritten_ = 0;
};

}  // namespace vdi::detail
