#include "vdi/stream/Assembly.h"

#include <fmt/format.h>

#include <utility>

#include "vdi/core/Error.h"
#include "vdi/io/VdiFile.h"

namespace vdi::stream {

Vdi Received::decode() {
  return vdi ? vdi->finish() : io::decode(file);
}

void Assembly::begin(const Level& level, std::uint64_t mostBytes) {
  level_.reset();
  bytes_ = 0;
  file_.clear();
  vdi_.reset();
  if (level.bytes > mostBytes) {
    throw Error(ErrorCode::Format, fmt::format("a level has {} bytes, more than the {} that are allowed",
                                               level.bytes, mostBytes));
  }
  level_ = level;
  if (gives_ == Gives::Vdis) vdi_.emplace(level.bytes);
}

std::optional<Received> Assembly::add(std::span<const std::byte> message) {
  const Chunk chunk = chunkIn(message);
  const bool isNext = level_ && chunk.frame == level_->frame && chunk.level == level_->level &&
                      chunk.offset == bytes_ && chunk.bytes.size() <= level_->bytes - bytes_;
  if (!isNext) throw Error(ErrorCode::Format, "a part of a level is out of order");
  bytes_ += chunk.bytes.size();
  if (vdi_) {
    vdi_->add(chunk.bytes);
  } else {
    file_.insert(file_.end(), chunk.bytes.begin(), chunk.bytes.end());
  }
  if (bytes_ < level_->bytes) return std::nullopt;
  Received whole;
  whole.level = *level_;
  whole.file = std::exchange(file_, {});
  whole.vdi = std::exchange(vdi_, std::nullopt);
  level_.reset();
  return whole;
}

std::optional<Ack> Assembly::progress() const {
  if (!level_) return std::nullopt;
  return Ack{level_->frame, level_->level, bytes_};
}

}  // namespace vdi::stream
