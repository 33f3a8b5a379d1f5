// A VDI as viewers get it: levels, each of which is a whole .vdi file.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "vdi/core/Vdi.h"

namespace vdi::stream {

using Clock = std::chrono::steady_clock;

struct EncodedLevel {
  std::vector<std::byte> bytes;  // of a .vdi file
  int width = 0;                 // lists, margin included
  int height = 0;
};

/// All viewers of a frame share it, so nothing in it ever changes.
struct Frame {
  std::uint32_t id = 0;
  std::uint64_t step = 0;
  double time = 0.0;
  Clock::time_point made;
  std::uint32_t levelCount = 1;
  /// The encoded levels, the coarsest first. A relay publishes them one by one; otherwise
  /// the coarse ones come together. The last of levelCount is the VDI.
  std::vector<std::shared_ptr<const EncodedLevel>> levels;
};
using FramePtr = std::shared_ptr<const Frame>;

/// A coarse level of factor f keeps every f-th list of each row and of each column. The factors are odd, so
/// that the ray of a coarse pixel is one of the VDI's.
inline constexpr std::array<int, 3> coarseFactors{9, 5, 3};
/// A level that takes fewer bytes in memory than this is the coarsest.
inline constexpr std::uint64_t smallBytes = std::uint64_t{1} << 20;
/// The factors of the coarse levels of a VDI that takes `bytes` bytes in memory, the coarsest first.
std::vector<int> coarseFactorsOf(std::uint64_t bytes);

/// Encodes a VDI, on all cores. Calls `take` on this thread: with the coarse levels, if there are any, and
/// with all levels. After the coarse ones, it asks `goesOn` repeatedly whether to encode the whole
/// VDI, and stops once the answer is false. Throws Error{Format} for a VDI that io::decode would
/// refuse, and the exceptions of both functions.
void encodeFrame(const Vdi& vdi, std::uint32_t id, Clock::time_point made,
                 const std::function<void(FramePtr)>& take, const std::function<bool()>& goesOn);
/// Makes a frame of a VDI's file, whose bytes become the last level as they are. Checks all of the file
/// first, then calls `take` once, with all levels. Throws as io::decode.
void passFrame(std::vector<std::byte> file, std::uint32_t id, Clock::time_point made,
               const std::function<void(FramePtr)>& take);

}  // namespace vdi::stream
