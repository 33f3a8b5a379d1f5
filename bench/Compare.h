// Compares two results of `vdi bench`.
#pragma once

#include <cstdio>
#include <filesystem>

namespace vdi::bench {

/// Matches the rows of both files by data set, algorithm, N_S, size and angles. Prints a line for
/// each figure that became worse. Times count if they grew by more than 10 % and by more than both
/// spreads, and stored bytes if they grew by more than 5 %. SSIM counts if it fell by more than
/// 0.002 and both files have the same truth rate. Returns the number of worse figures. Times of
/// different devices are compared as ratios to their own DVR. Throws Error: Io, Format.
int compareBenches(const std::filesystem::path& before, const std::filesystem::path& after, std::FILE* out);

}  // namespace vdi::bench
