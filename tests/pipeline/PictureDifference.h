// Differences between two pictures, in 1/255.
#pragma once

#include <algorithm>
#include <cmath>

#include "tests/Catch.h"
#include "vdi/core/Image.h"

namespace vdi::test {

struct Difference {
  double worst = 0.0;       // in 1/255, over all channels
  double wrongShare = 0.0;  // share of the object's pixels off by more than 16
};

/// The largest one over all channels and pixels.
inline float largestDifference(const Image& a, const Image& b) {
  REQUIRE(a.rgba.size() == b.rgba.size());
  float worst = 0.0F;
  for (std::size_t i = 0; i < a.rgba.size(); ++i) {
    for (int c = 0; c < 4; ++c) worst = std::max(worst, std::abs(a.rgba[i][c] - b.rgba[i][c]));
  }
  return worst * 255.0F;
}

/// Requires that the object covers a tenth of the picture.
inline Difference differenceOf(const Image& image, const Image& truth) {
  Difference difference;
  std::size_t seen = 0;
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < image.rgba.size(); ++i) {
    double off = 0.0;
    for (int c = 0; c < 4; ++c)
      off = std::max(off, 255.0 * std::abs(static_cast<double>(image.rgba[i][c]) - truth.rgba[i][c]));
    difference.worst = std::max(difference.worst, off);
    seen += truth.rgba[i].a > 0.03F ? 1 : 0;
    wrong += off > 16.0 ? 1 : 0;
  }
  REQUIRE(seen > image.rgba.size() / 10);
  difference.wrongShare = static_cast<double>(wrong) / static_cast<double>(seen);
  return difference;
}

}  // namespace vdi::test
