// A VDI that another thread decodes while its bytes arrive.
#pragma once

#include <cstddef>
#include <cstdint>
#include <future>
#include <memory>
#include <span>
#include <vector>

#include "vdi/core/Vdi.h"
#include "vdi/io/VdiDecoder.h"

namespace vdi::stream {

/// Belongs to one thread at a time. While bytes are being decoded, later ones wait, and are then decoded
/// together, on as many cores as they keep busy.
class ArrivingVdi {
 public:
  /// `fileBytes` is the size of the .vdi file.
  explicit ArrivingVdi(std::uint64_t fileBytes);
  /// Takes the next bytes, of which it keeps a copy.
  void add(std::span<const std::byte> bytes);
  /// Waits for the rest of the decoding. Throws as io::VdiDecoder::finish. Call it once.
  Vdi finish();

 private:
  std::shared_ptr<io::VdiDecoder> decoder_;  // shared with the job
  std::vector<std::byte> waiting_;
  std::future<void> job_;
};

}  // namespace vdi::stream
