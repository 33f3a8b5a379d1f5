#include "vdi/stream/Assembly.h"

#include <fmt/format.h>

#include <utility>

#include "vdi/core/Error.h"

namespace vdi::stream {

void Assembly::begin(const Level& level, std::uint64_t mostBytes) {
  level_.reset();
  file_.clear();
  if (level.bytes > mostBytes) {
    throw Error(ErrorCode::Format, fmt::format("a level has {} bytes, more than the {} that are allowed",
                                               level.bytes, mostBytes));
  }
  level_ = level;
}

std::optional<Received> Assembly::add(std::span<const std::byte> message) {
  const Chunk chunk = chunkIn(message);
  const bool isNext = level_ && chunk.frame == level_->frame && chunk.level == level_->level &&
                      chunk.offset == file_.size() && chunk.bytes.size() <= level_->bytes - file_.size();
  if (!isNext) throw Error(ErrorCode::Format, "a part of a level is out of order");
  file_.insert(file_.end(), chunk.bytes.begin(), chunk.bytes.end());
  if (file_.size() < level_->bytes) return std::nullopt;
  Received whole;
  whole.level = *level_;
  whole.file = std::exchange(file_, {});
  level_.reset();
  return whole;
}

std::optional<Ack> Assembly::progress() const {
  if (!level_) return std::nullopt;
  return Ack{level_->frame, level_->level, file_.size()};
}

}  // namespace vdi::stream
