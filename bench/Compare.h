// Comparing two results of `vdi bench`.
#pragma once

#include <cstdio>
#include <filesystem>

namespace vdi::bench {

/// Matches the rows of both files by data set, algorithm, N_S, size and angles, and prints a line for each
/// figure that got worse: times by more than 10 % and more than both spreads, stored bytes by more than 5 %,
/// SSIM by more than 0.002 if both were compared with a truth of one rate. Returns how many did. Files of
/// different devices are compared in time as ratios to their own DVR. Throws Error: Io, Format.
int compareBenches(const std::filesystem::path& before, const std::filesystem::path& after, std::FILE* out);

}  // namespace vdi::bench
