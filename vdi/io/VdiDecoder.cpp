#include "vdi/io/VdiDecoder.h"

#include <fmt/format.h>

#include <cassert>
#include <exception>
#include <optional>
#include <utility>
#include <variant>
#include <vector>

#include "vdi/core/FreeMemory.h"
#include "vdi/core/Parallel.h"
#include "vdi/io/VdiLayout.h"

namespace vdi::io {

using detail::Chunk;
using detail::Header;

struct VdiDecoder::State {
  std::uint64_t fileBytes;
  std::uint64_t added = 0;
  std::vector<std::byte> pending;  // the start of a part that isn't complete
  std::optional<Header> header;
  std::optional<std::vector<Chunk>> chunks;  // set once the table has arrived
  std::size_t decoded = 0;                   // the number of chunks decoded so far
  bool isComplete = false;
  Vdi vdi;
  std::exception_ptr failure;

  void add(std::span<const std::byte> bytes);
  std::size_t use(std::span<const std::byte> bytes);
  std::size_t useChunks(std::span<const std::byte> bytes);
  template <typename Segment>
  void decode(ListsOf<Segment>& lists, std::span<const Chunk> some, std::span<const std::byte> bytes);
};

void VdiDecoder::State::add(std::span<const std::byte> bytes) {
  if (bytes.size() > fileBytes - added) detail::fail("it has more bytes than announced");
  added += bytes.size();
  if (pending.empty()) {
    const std::span<const std::byte> rest = bytes.subspan(use(bytes));
    pending.assign(rest.begin(), rest.end());
  } else {
    const std::size_t before = pending.size();
    pending.resize(before + bytes.size());  // GCC 14 warns wrongly of an overflow in insert
    std::copy(bytes.begin(), bytes.end(), pending.begin() + static_cast<std::ptrdiff_t>(before));
    pending.erase(pending.begin(), pending.begin() + static_cast<std::ptrdiff_t>(use(pending)));
  }
}

/// Uses the complete parts at the front of `bytes`, and returns their size.
std::size_t VdiDecoder::State::use(std::span<const std::byte> bytes) {
  std::size_t used = 0;
  const auto isThere = [&](std::uint64_t size) { return bytes.size() - used >= size; };
  if (!header) {
    if (!isThere(sizeof(Header)) && added < fileBytes) return used;
    header = detail::parseHeader(bytes, fileBytes);
    vdi = detail::vdiOf(*header);
    used += sizeof(Header);
  }
  if (!chunks) {
    if (!isThere(detail::tableBytesOf(*header))) return used;
    chunks = detail::parseTable(*header, bytes.subspan(used));
    used += detail::tableBytesOf(*header);
    requireHostBytes(detail::bytesInMemoryOf(*header), "the VDI");
  }
  used += useChunks(bytes.subspan(used));
  const std::uint64_t rest = fileBytes - detail::metadataOffset(*header);
  if (decoded == chunks->size() && !isComplete && isThere(rest)) {
    vdi.coloring = detail::parseMetadata(*header, bytes.subspan(used, rest));
    used += rest;
    isComplete = true;
  }
  return used;
}

std::size_t VdiDecoder::State::useChunks(std::span<const std::byte> bytes) {
  std::size_t last = decoded;
  std::uint64_t size = 0;
  while (last < chunks->size() && (*chunks)[last].packedBytes <= bytes.size() - size)
    size += (*chunks)[last++].packedBytes;
  if (last == decoded) return 0;
  const std::span<const Chunk> some = std::span(*chunks).subspan(decoded, last - decoded);
  std::visit([&](auto& lists) { decode(lists, some, bytes.first(size)); }, vdi.lists);
  decoded = last;
  return size;
}

/// Appends the lists of some chunks. All of them are checked before memory is allocated.
template <typename Segment>
void VdiDecoder::State::decode(ListsOf<Segment>& lists, std::span<const Chunk> some,
                               std::span<const std::byte> bytes) {
  const auto packed = [&](const Chunk& chunk) {
    return bytes.subspan(chunk.dataOffset - some.front().dataOffset, chunk.packedBytes);
  };
  eachInParallel(some.size(), [&](std::size_t i) {
    detail::requireSound(some[i], packed(some[i]), EncodingOf<Segment>::precision);
  });
  const Chunk& end = some.back();
  lists.offsets.resize(end.firstList + end.listCount + 1);
  lists.offsets.front() = 0;
  lists.segments.resize(end.firstSupersegment + end.supersegmentCount);
  std::vector<DepthCode> codes(some.size());
  eachInParallel(some.size(), [&](std::size_t i) {
    const Chunk& chunk = some[i];
    codes[i] = detail::decodeChunk(
        chunk, packed(chunk), chunk.firstSupersegment,
        std::span(lists.offsets).subspan(chunk.firstList + 1, chunk.listCount),
        std::span(lists.segments).subspan(chunk.firstSupersegment, chunk.supersegmentCount));
  });
  if (decoded == 0) vdi.depthCode = codes.front();
  detail::requireCode(vdi.depthCode, codes);
  eachInParallel(some.size(), [&](std::size_t i) {
    validateLists(lists, some[i].firstList, some[i].firstList + some[i].listCount, some[i].firstList,
                  vdi.budget);
  });
}

VdiDecoder::VdiDecoder(std::uint64_t fileBytes) : state_(std::make_unique<State>()) {
  state_->fileBytes = fileBytes;
}
VdiDecoder::~VdiDecoder() = default;
VdiDecoder::VdiDecoder(VdiDecoder&&) noexcept = default;
VdiDecoder& VdiDecoder::operator=(VdiDecoder&&) noexcept = default;

void VdiDecoder::add(std::span<const std::byte> bytes) {
  if (state_->failure) return;
  try {
    state_->add(bytes);
  } catch (...) {
    state_->failure = std::current_exception();
    state_->vdi = {};
    state_->pending = {};
  }
}

bool VdiDecoder::hasFailed() const {
  return state_->failure != nullptr;
}

Vdi VdiDecoder::finish() {
  const std::unique_ptr<State> state = std::move(state_);
  assert(state);
  if (state->failure) std::rethrow_exception(state->failure);
  if (!state->isComplete) {
    detail::fail(
        fmt::format("{} of its {} bytes are missing", state->fileBytes - state->added, state->fileBytes));
  }
  validateShape(state->vdi);
  validateEnds(state->vdi);
  return std::move(state->vdi);
}

}  // namespace vdi::io
