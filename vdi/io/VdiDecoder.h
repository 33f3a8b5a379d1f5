// Decodes a .vdi file while its bytes arrive.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "vdi/core/Vdi.h"

namespace vdi::io {

/// Takes the bytes of a .vdi file in order, in pieces of any size, from a file or a network. A chunk of lists
/// is decoded as soon as its bytes are complete, on several threads if a piece completes several chunks.
/// Allocates memory for bytes that have arrived, not for announced ones. Belongs to one thread at a
/// time.
class VdiDecoder {
 public:
  /// `fileBytes` is the size of the file.
  explicit VdiDecoder(std::uint64_t fileBytes);
  ~VdiDecoder();
  VdiDecoder(VdiDecoder&&) noexcept;
  VdiDecoder& operator=(VdiDecoder&&) noexcept;
  VdiDecoder(const VdiDecoder&) = delete;
  VdiDecoder& operator=(const VdiDecoder&) = delete;

  /// Takes the next bytes, which are not needed afterwards. If they have a fault, finish throws it.
  void add(std::span<const std::byte> bytes);
  /// True once a fault was found; further bytes then change nothing.
  bool hasFailed() const;
  /// Ends the decoder. Throws Error{Format} for bytes that io::decode refuses, and for missing ones.
  Vdi finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace vdi::io
