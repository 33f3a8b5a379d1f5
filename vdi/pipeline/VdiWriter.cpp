#include "vdi/pipeline/VdiWriter.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cstring>
#include <exception>
#include <limits>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>

#include "vdi/core/Error.h"

namespace vdi::detail {

namespace {

/// A rank's note on its part of a chunk.
struct PartNote {
  std::uint64_t firstList;
  std::uint64_t listCount;
  std::uint64_t supersegmentCount;
};

/// A rank's note on a chunk that it has encoded.
struct ChunkNote {
  std::uint64_t index;
  io::ChunkEntry entry;
};
static_assert(std::is_trivially_copyable_v<PartNote> && std::is_trivially_copyable_v<ChunkNote>);

template <typename Note>
struct NoteOf {
  int rank;
  Note note;
};

/// Collective: returns all ranks' notes, in rank order. `make` makes this rank's.
template <typename Note, typename Make>
std::vector<NoteOf<Note>> shareNotes(const comm::Communicator& comm, Make make) {
  std::vector<Note> mine;
  comm.together([&] { mine = make(); });
  const comm::Gathered all = comm.allGather(std::as_bytes(std::span(mine)), sizeof(Note));
  std::vector<NoteOf<Note>> notes;
  comm.together([&] {
    for (int r = 0; r < comm.size(); ++r) {
      const std::span<const std::byte> bytes = all.of(r);
      for (std::size_t at = 0; at < bytes.size(); at += sizeof(Note)) {
        notes.push_back({r, {}});
        std::memcpy(&notes.back().note, bytes.data() + at, sizeof(Note));
      }
    }
  });
  return notes;
}

[[noreturn]] void failCoverage(std::uint64_t list) {
  throw Error(ErrorCode::InvalidArgument,
              fmt::format("no rank, or more than one, added the lists from {} on", list));
}

}  // namespace

template <typename Segment>
VdiWriter<Segment>::VdiWriter(const comm::Communicator& comm, int root, const std::filesystem::path& path,
                              const Vdi& header, WrittenBy writtenBy)
    : comm_(comm),
      root_(root),
      writtenBy_(writtenBy),
      listCount_(static_cast<std::uint64_t>(header.width) * static_cast<std::uint64_t>(header.height)),
      writtenEnd_(io::headBytes(listCount_)) {
  comm_.together([&] {
    path_ = path;
    header_ = header;
    header_.lists = ListsOf<Segment>();
    if (!isRoot()) return;
    file_ = std::make_unique<io::OutputFile>(path);
    tail_ = io::encodeTail(header_);
  });
}

/// End of the chunk that contains a list.
template <typename Segment>
std::uint64_t VdiWriter<Segment>::chunkEnd(std::uint64_t list) const {
  return std::min((list / io::listsPerChunk + 1) * io::listsPerChunk, listCount_);
}

template <typename Segment>
void VdiWriter<Segment>::add(std::uint64_t firstList, const ListsOf<Segment>& lists) {
  const std::size_t count = lists.listCount();
  assert(firstList + count <= listCount_);
  for (std::size_t i = 0; i < count;) {
    const std::uint64_t list = firstList + i;
    const std::uint64_t end = firstList + count;
    const bool whole = list % io::listsPerChunk == 0 && end >= chunkEnd(list);
    std::uint64_t until = std::min(chunkEnd(list), end);
    if (whole) until = end == listCount_ ? end : end / io::listsPerChunk * io::listsPerChunk;
    const std::size_t last = i + (until - list);
    if (whole) {
      encode(lists, i, last, list);
    } else {
      addToPart(list, lists, i, last);
    }
    i = last;
  }
}

template <typename Segment>
void VdiWriter<Segment>::append(ChunkPart& part, const ListsOf<Segment>& lists, std::size_t first,
                                std::size_t last) const {
  const auto offsets = std::span(lists.offsets).subspan(first, last - first + 1);
  const auto before = static_cast<std::uint32_t>(part.lists.segments.size());
  for (std::size_t i = 1; i < offsets.size(); ++i) {
    part.lists.offsets.push_back(before + (offsets[i] - offsets[0]));
  }
  const auto segments = std::span(lists.segments).subspan(offsets.front(), offsets.back() - offsets.front());
  part.lists.segments.insert(part.lists.segments.end(), segments.begin(), segments.end());
}

/// Adds lists of one chunk. Bands that end within it complete it one after the other.
template <typename Segment>
void VdiWriter<Segment>::addToPart(std::uint64_t firstList, const ListsOf<Segment>& lists, std::size_t first,
                                   std::size_t last) {
  const bool goesOn =
      !parts_.empty() && parts_.back().end() == firstList && firstList % io::listsPerChunk != 0;
  if (!goesOn) parts_.push_back({firstList, {}});
  ChunkPart& part = parts_.back();
  append(part, lists, first, last);
  if (part.firstList % io::listsPerChunk != 0 || part.end() != chunkEnd(part.firstList)) return;
  const ChunkPart whole = std::move(part);
  parts_.pop_back();
  encode(whole.lists, 0, whole.lists.listCount(), whole.firstList);
}

template <typename Segment>
void VdiWriter<Segment>::encode(const ListsOf<Segment>& lists, std::size_t first, std::size_t last,
                                std::uint64_t firstList) {
  std::uint64_t index = firstList / io::listsPerChunk;
  io::encodeChunks(lists, first, last, firstList, header_.budget, header_.depthCode,
                   [&](io::EncodedChunk chunk) { keep(index++, std::move(chunk)); });
}

/// Writes a chunk if all chunks before it are written, so that its offset is known; otherwise keeps it.
template <typename Segment>
void VdiWriter<Segment>::keep(std::uint64_t index, io::EncodedChunk chunk) {
  if (file_ && file_->takesOffsets() && index == firstChunks_) {
    file_->write(writtenEnd_, chunk.bytes);
    ++firstChunks_;
    writtenEnd_ += chunk.bytes.size();
    bytesWritten_ += chunk.bytes.size();
    chunk.bytes = {};
  }
  chunks_.push_back({index, chunk.entry, std::move(chunk.bytes)});
}

/// Collective: returns all ranks' parts in the order of their lists. The rank with a chunk's first part
/// encodes the chunk.
template <typename Segment>
std::vector<typename VdiWriter<Segment>::Route> VdiWriter<Segment>::routeParts() const {
  std::vector<NoteOf<PartNote>> notes = shareNotes<PartNote>(comm_, [&] {
    std::vector<PartNote> mine;
    mine.reserve(parts_.size());
    for (const ChunkPart& part : parts_)
      mine.push_back({part.firstList, part.lists.listCount(), part.lists.segments.size()});
    return mine;
  });
  std::vector<Route> routes;
  comm_.together([&] {
    std::sort(notes.begin(), notes.end(),
              [](const auto& a, const auto& b) { return a.note.firstList < b.note.firstList; });
    std::uint64_t expected = 0;
    for (const auto& [rank, note] : notes) {
      const bool begins = note.firstList % io::listsPerChunk == 0;
      const bool chunkIsWhole = routes.empty() || expected == chunkEnd(routes.back().firstList);
      if (begins != chunkIsWhole || (!begins && note.firstList != expected)) failCoverage(expected);
      routes.push_back(
          {rank, begins ? rank : routes.back().to, note.firstList, note.listCount, note.supersegmentCount});
      expected = note.firstList + note.listCount;
    }
    if (!routes.empty() && expected != chunkEnd(routes.back().firstList)) failCoverage(expected);
  });
  return routes;
}

/// Collective: sends this rank's parts, and returns those from other ranks, in the order of their lists.
template <typename Segment>
std::vector<typename VdiWriter<Segment>::ChunkPart> VdiWriter<Segment>::exchangeParts(
    std::span<const Route> routes) {
  comm::Messages messages(comm_);
  std::vector<ChunkPart> received;
  comm_.together([&] {
    for (const Route& route : routes) {
      const bool own = route.from == comm_.rank();
      if (own == (route.to == comm_.rank())) continue;  // stays here, or concerns other ranks
      messages.reserve((route.listCount + 1) * sizeof(std::uint32_t));
      messages.reserve(route.supersegmentCount * sizeof(Segment));
      if (own) continue;
      received.push_back({route.firstList, {}});
      received.back().lists.offsets.resize(route.listCount + 1);
      received.back().lists.segments.resize(route.supersegmentCount);
    }
  });
  auto nextReceived = received.begin();
  auto nextOwn = parts_.begin();
  for (const Route& route : routes) {
    const bool own = route.from == comm_.rank();
    if (own && route.to != comm_.rank()) {
      messages.send(route.to, std::as_bytes(std::span(nextOwn->lists.offsets)));
      messages.send(route.to, std::as_bytes(std::span(nextOwn->lists.segments)));
      bytesSent_ += nextOwn->lists.offsets.size() * sizeof(std::uint32_t) +
                    nextOwn->lists.segments.size() * sizeof(Segment);
    } else if (!own && route.to == comm_.rank()) {
      messages.receive(route.from, std::as_writable_bytes(std::span(nextReceived->lists.offsets)));
      messages.receive(route.from, std::as_writable_bytes(std::span(nextReceived->lists.segments)));
      ++nextReceived;
    }
    if (own) ++nextOwn;
  }
  messages.wait();
  return received;
}

/// Joins and encodes the chunks whose parts come to this rank.
template <typename Segment>
void VdiWriter<Segment>::encodeJoined(std::span<const Route> routes, std::span<const ChunkPart> received) {
  auto nextReceived = received.begin();
  auto nextOwn = parts_.begin();
  ChunkPart whole;
  for (const Route& route : routes) {
    const bool own = route.from == comm_.rank();
    if (route.to == comm_.rank()) {
      if (route.firstList % io::listsPerChunk == 0) whole = {route.firstList, {}};
      const ChunkPart& part = own ? *nextOwn : *nextReceived++;
      append(whole, part.lists, 0, part.lists.listCount());
      if (whole.end() == chunkEnd(whole.firstList))
        encode(whole.lists, 0, whole.lists.listCount(), whole.firstList);
    }
    if (own) ++nextOwn;
  }
  parts_.clear();
}

/// Collective: the rank that has a shared chunk's first list collects and encodes it.
template <typename Segment>
void VdiWriter<Segment>::joinParts() {
  std::sort(parts_.begin(), parts_.end(),
            [](const ChunkPart& a, const ChunkPart& b) { return a.firstList < b.firstList; });
  const std::vector<Route> routes = routeParts();
  const std::vector<ChunkPart> received = exchangeParts(routes);
  comm_.together([&] { encodeJoined(routes, received); });
}

/// Collective: returns all ranks' chunks.
template <typename Segment>
typename VdiWriter<Segment>::Table VdiWriter<Segment>::shareTable() const {
  const std::vector<NoteOf<ChunkNote>> notes = shareNotes<ChunkNote>(comm_, [&] {
    std::vector<ChunkNote> mine;
    mine.reserve(chunks_.size());
    for (const Chunk& chunk : chunks_) mine.push_back({chunk.index, chunk.entry});
    return mine;
  });
  Table table;
  comm_.together([&] {
    const std::uint64_t count = io::chunksOf(listCount_);
    constexpr int nobody = -1;
    table.entries.resize(count);
    table.owners.assign(count, nobody);
    for (const auto& [rank, note] : notes) {
      if (table.owners[note.index] != nobody) failCoverage(note.index * io::listsPerChunk);
      table.owners[note.index] = rank;
      table.entries[note.index] = note.entry;
    }
    table.offsets.push_back(io::headBytes(listCount_));
    for (std::uint64_t i = 0; i < count; ++i) {
      if (table.owners[i] == nobody) failCoverage(i * io::listsPerChunk);
      table.offsets.push_back(table.offsets.back() + table.entries[i].packedBytes);
    }
  });
  return table;
}

/// On the root: sets the file's size and writes its head. Returns the path by which others open it; empty if
/// they need not or cannot.
template <typename Segment>
std::filesystem::path VdiWriter<Segment>::prepareFile(const Table& table) {
  const std::vector<std::byte> head = io::encodeHead(header_, table.entries);
  file_->reserve(table.offsets.back() + tail_.size());
  file_->write(0, head);
  bytesWritten_ += head.size();
  const bool others =
      std::any_of(table.owners.begin(), table.owners.end(), [&](int owner) { return owner != root_; });
  return others && file_->takesOffsets() ? file_->share() : std::filesystem::path();
}

/// Writes this rank's chunks into the root's file.
template <typename Segment>
void VdiWriter<Segment>::writeOwn(const Table& table, io::SharedOutput* shared) {
  for (Chunk& chunk : chunks_) {
    if (chunk.bytes.empty()) continue;
    const std::uint64_t offset = table.offsets[chunk.index];
    if (shared != nullptr) {
      shared->write(offset, chunk.bytes);
    } else {
      file_->write(offset, chunk.bytes);
    }
    bytesWritten_ += chunk.bytes.size();
    chunk.bytes = {};
  }
  if (shared != nullptr) shared->finish();
}

/// Collective: writes the chunks that their owners could not write, in the file's order.
template <typename Segment>
void VdiWriter<Segment>::writeByRoot(const Table& table, std::span<const std::uint64_t> writesItself) {
  const auto left = [&](std::size_t i) {
    return writesItself[static_cast<std::size_t>(table.owners[i])] == 0;
  };
  std::vector<std::byte> received;
  comm::Messages message(comm_);
  comm_.together([&] {
    std::sort(chunks_.begin(), chunks_.end(),
              [](const Chunk& a, const Chunk& b) { return a.index < b.index; });
    std::uint32_t largest = 0;
    for (std::size_t i = 0; i < table.owners.size(); ++i) {
      if (isRoot() && left(i)) largest = std::max(largest, table.entries[i].packedBytes);
    }
    received.resize(largest);
    message.reserve(std::numeric_limits<std::uint32_t>::max());  // the largest chunk; one is sent at a time
  });
  // If the root fails, it still receives the others' chunks; otherwise they would wait for ever.
  std::exception_ptr error;
  auto own = chunks_.begin();
  for (std::size_t i = 0; i < table.owners.size(); ++i) {
    const int owner = table.owners[i];
    const bool mine = owner == comm_.rank();
    if (left(i) && (mine || isRoot())) {
      const std::span<std::byte> bytes =
          mine ? std::span(own->bytes) : std::span(received).first(table.entries[i].packedBytes);
      if (owner != root_) {
        if (mine) {
          message.send(root_, bytes);
          bytesSent_ += bytes.size();
        } else {
          message.receive(owner, bytes);
        }
        message.wait();
      }
      if (isRoot() && !error) {
        try {
          file_->write(table.offsets[i], bytes);
          bytesWritten_ += bytes.size();
        } catch (...) {
          error = std::current_exception();
        }
      }
      if (mine) own->bytes = {};
    }
    if (mine) ++own;
  }
  comm_.agree(error);
}

template <typename Segment>
WrittenVdi VdiWriter<Segment>::finish() {
  joinParts();
  const Table table = shareTable();
  const std::string name = comm_.broadcastText([&] { return prepareFile(table).string(); }, root_);

  std::array<std::uint64_t, 1> writesItself{0};
  comm_.together([&] {
    const bool opens = !isRoot() && !name.empty() && !chunks_.empty() && writtenBy_ == WrittenBy::Owner;
    std::optional<io::SharedOutput> file = opens ? io::SharedOutput::open(name, path_) : std::nullopt;
    writesItself[0] = file || (isRoot() && file_->takesOffsets()) || chunks_.empty() ? 1 : 0;
    if (writesItself[0] != 0) writeOwn(table, file ? &*file : nullptr);
  });
  const std::vector<std::uint64_t> all = comm_.allGatherWords(writesItself);
  if (std::count(all.begin(), all.end(), 0U) > 0) writeByRoot(table, all);
  std::array<std::uint64_t, 1> tailBytes{tail_.size()};
  comm_.together([&] {
    if (!isRoot()) return;
    file_->write(table.offsets.back(), tail_);
    bytesWritten_ += tail_.size();
    file_->commit();
  });
  comm_.allReduceMax(tailBytes);

  WrittenVdi written;
  for (const io::ChunkEntry& entry : table.entries) written.supersegments += entry.supersegmentCount;
  written.bytes = table.offsets.back() + tailBytes[0];
  return written;
}

#define VDI_WRITER(Segment) template class VdiWriter<Segment>;
VDI_EACH_ENCODING(VDI_WRITER)
#undef VDI_WRITER

}  // namespace vdi::detail
