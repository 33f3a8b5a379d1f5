// Helpers of the cases that compare the device with the reference.
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "tests/Catch.h"
#include "tests/Devices.h"
#include "tests/Scenes.h"
#include "tests/pipeline/PictureDifference.h"
#include "vdi/comm/GhostExchange.h"
#include "vdi/core/Vdi.h"

namespace vdi::test {

/// A second device, which runs the programs for GPUs.
inline std::shared_ptr<gpu::Device> deviceAsGpu() {
  return device(true);
}

/// The blocks with the layers of values beyond their owned boxes that setBlocks also gives them.
inline std::vector<Block> withLayers(const std::vector<Block>& blocks) {
  return comm::exchangeGhosts(comm::Communicator::serial(), blocks);
}

/// Whether the device's view equals the reference's. In a sheared view, rounding may decide where a face
/// leans, so a pixel or two may differ.
inline bool isView(const Image& seen, const Image& expected, Reconstruction reconstruction) {
  const bool sheared = reconstruction == Reconstruction::Sheared;
  std::size_t different = 0;
  for (std::size_t i = 0; i < seen.rgba.size(); ++i) {
    const glm::vec4 difference = 255.0F * glm::abs(seen.rgba[i] - expected.rgba[i]);
    different += glm::any(glm::greaterThan(difference, glm::vec4(2.0F))) ? 1 : 0;
  }
  INFO(different << " pixels differ");
  return seen.rgba.size() == expected.rgba.size() && different <= (sheared ? seen.rgba.size() / 500 : 0) &&
         largestDifference(seen, expected) < (sheared ? 16.0F : 2.0F);
}

/// Number of pixels of which only one has a depth, or whose depths are more than `tolerance` apart.
inline std::size_t depthsThatDiffer(const Image& a, const Image& b, float tolerance) {
  REQUIRE(a.depth.size() == b.depth.size());
  std::size_t count = 0;
  for (std::size_t i = 0; i < a.depth.size(); ++i)
    count += a.depth[i] == b.depth[i] || std::abs(a.depth[i] - b.depth[i]) < tolerance ? 0 : 1;
  return count;
}

/// GPUs interpolate with 8-bit weights, CPU devices and the reference with floats, which matters where a
/// transfer function is steep.
template <typename T>
T byFilter(T precise, T coarse) {
  return device()->isCpu() ? precise : coarse;
}

constexpr float rounding = 2e-3F;
constexpr float oneCode = 1.5F / 255.0F;

inline bool alike(const Supersegment& a, const Supersegment& b, float tolerance) {
  const auto close = [&](float x, float y) { return std::abs(x - y) < tolerance; };
  return close(a.front, b.front) && close(a.back, b.back) && close(a.red, b.red) && close(a.green, b.green) &&
         close(a.blue, b.blue) && close(a.opacity, b.opacity);
}

/// Rounding may change a decision, so a few differences are expected.
inline std::size_t listsThatDiffer(const SupersegmentLists& a, const SupersegmentLists& b,
                                   float tolerance = rounding) {
  REQUIRE(a.listCount() == b.listCount());
  std::size_t count = 0;
  for (std::size_t i = 0; i < a.listCount(); ++i) {
    const auto x = a.list(i);
    const auto y = b.list(i);
    const auto same = [&](const Supersegment& s, const Supersegment& t) { return alike(s, t, tolerance); };
    count += std::equal(x.begin(), x.end(), y.begin(), y.end(), same) ? 0 : 1;
  }
  return count;
}

constexpr Algorithm algorithms[] = {Algorithm::Merge, Algorithm::Bisection};

}  // namespace vdi::test
