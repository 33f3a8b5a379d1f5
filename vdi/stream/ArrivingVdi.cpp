#include "vdi/stream/ArrivingVdi.h"

#include <utility>

#include "vdi/core/Ready.h"

namespace vdi::stream {

ArrivingVdi::ArrivingVdi(std::uint64_t fileBytes) : decoder_(std::make_shared<io::VdiDecoder>(fileBytes)) {}

void ArrivingVdi::add(std::span<const std::byte> bytes) {
  waiting_.insert(waiting_.end(), bytes.begin(), bytes.end());
  if (job_.valid()) {
    // If no thread could be started, the job is deferred, and finish runs it.
    if (!isReady(job_)) return;
    job_.get();
  }
  job_ = std::async(std::launch::async | std::launch::deferred,
                    [decoder = decoder_, bytes = std::exchange(waiting_, {})] { decoder->add(bytes); });
}

Vdi ArrivingVdi::finish() {
  if (job_.valid()) job_.get();
  decoder_->add(waiting_);
  waiting_ = {};
  return decoder_->finish();
}

}  // namespace vdi::stream
