// VDIs and limits that the tests of io share.
#pragma once

#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <string>

#include "vdi/core/Vdi.h"
#include "vdi/reference/Compaction.h"

namespace vdi::test {

/// The size that docs/format.md gives for a file's header.
constexpr std::size_t headerBytes = 240;

/// Deterministic numbers in [0, 1): the same on every machine.
class Noise {
 public:
  explicit Noise(std::uint64_t seed) : state_(seed * 2 + 1) {}
  std::uint32_t bits() {
    state_ = state_ * 6364136223846793005ULL + 1442695040888963407ULL;
    return static_cast<std::uint32_t>(state_ >> 32);
  }
  std::uint32_t below(std::uint32_t n) { return static_cast<std::uint32_t>(std::uint64_t{bits()} * n >> 32); }
  float unit() { return static_cast<float>(bits() >> 8) * 0x1p-24F; }

 private:
  std::uint64_t state_;
};

/// The lists of a VDI of full precision.
inline SupersegmentLists& full(Vdi& vdi) {
  return std::get<SupersegmentLists>(vdi.lists);
}
inline const SupersegmentLists& full(const Vdi& vdi) {
  return std::get<SupersegmentLists>(vdi.lists);
}

inline Vdi emptyVdi(int width, int height, std::uint32_t budget) {
  Vdi vdi;
  vdi.camera.position = {2.0, 1.5, 3.25};
  vdi.camera.focalPoint = {0.5, 0.5, 0.5};
  vdi.camera.viewUp = {0.0, 1.0, 0.125};
  vdi.camera.viewAngle = 26.5;
  vdi.camera.parallelScale = 0.75;
  vdi.width = width;
  vdi.height = height;
  vdi.budget = budget;
  vdi.bounds = {glm::dvec3(-1.0, 0.0, 1.0), glm::dvec3(2.0, 3.0, 4.0)};
  vdi.sampleStep = 1.0 / 128.0;
  vdi.time = 1234.5;
  vdi.timeStep = (std::uint64_t{1} << 40) + 7;
  full(vdi).offsets.assign(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) + 1, 0);
  return vdi;
}

/// A VDI with lists of any length up to the budget and random values, which validate(Vdi) accepts and a
/// compressor cannot predict.
inline Vdi noisyVdi(int width, int height, std::uint32_t budget, std::uint64_t seed = 1) {
  Vdi vdi = emptyVdi(width, height, budget);
  Noise noise(seed);
  for (std::size_t i = 0; i + 1 < full(vdi).offsets.size(); ++i) {
    const std::uint32_t count = noise.below(budget + 1);
    float depth = noise.unit();
    for (std::uint32_t j = 0; j < count; ++j) {
      const float front = depth + (noise.below(2) == 0 ? 0.0F : noise.unit());
      depth = front + 0x1p-10F + noise.unit();
      const auto color = [&noise] { return noise.unit() * 2.0F - 0.5F; };
      full(vdi).segments.push_back({front, depth, color(), color(), color(), 1.0F - noise.unit() * 0.999F});
    }
    full(vdi).offsets[i + 1] = static_cast<std::uint32_t>(full(vdi).segments.size());
  }
  return vdi;
}

/// A VDI like that of a smooth ball: lists that resemble their neighbours, faces on multiples of the sample
/// step, supersegments that mostly touch, colours with the last digits of accumulated samples.
inline Vdi plausibleVdi(int width, int height, std::uint32_t budget) {
  Vdi vdi = emptyVdi(width, height, budget);
  const auto step = static_cast<float>(vdi.sampleStep);
  Noise noise(3);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const float u = (2.0F * static_cast<float>(x) + 1.0F) / static_cast<float>(width) - 1.0F;
      const float v = (2.0F * static_cast<float>(y) + 1.0F) / static_cast<float>(height) - 1.0F;
      const float inside = 0.8F - u * u - v * v;
      const auto steps = inside > 0.0F ? static_cast<std::uint32_t>(std::sqrt(inside) * 200.0F) : 0U;
      const std::uint32_t count = std::min(budget, steps / 6);
      float front = 2.0F + step * (200.0F - static_cast<float>(steps));
      for (std::uint32_t j = 0; j < count; ++j) {
        const auto n = static_cast<float>(j);
        const float length = 6.0F + std::round(4.0F * std::sin(n + 3.0F * u) * std::cos(n - 2.0F * v));
        const float back = front + step * length;
        const float density = 0.02F + 0.015F * std::sin(2.0F * n + 4.0F * u - 3.0F * v);
        const float opacity = 1.0F - std::exp(-length * density) * (1.0F - 1e-4F * noise.unit());
        const float hue = 0.5F + 0.5F * std::sin(0.7F * n + 2.0F * u);
        full(vdi).segments.push_back(
            {front, back, opacity * hue, opacity * (1.0F - hue), opacity * 0.25F, opacity});
        front = j % 5 == 4 ? back + 3.0F * step : back;
      }
      full(vdi).offsets[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                        static_cast<std::size_t>(x) + 1] =
          static_cast<std::uint32_t>(full(vdi).segments.size());
    }
  }
  return vdi;
}

/// A coloring with non-ASCII letters in its name, a step, and numbers of any magnitude.
inline Coloring sampleColoring() {
  return {
      .array = {.name = "vitesse \u00e9lev\u00e9e \"|v|\"", .cells = true, .components = 3, .component = -1},
      .range = {-1.5e-300, 1.0 / 3.0},
      .function = {.colors = {{-1e300, {0.0, 0.1, 1.0}}, {0.25, {0.5, 0.5, 0.5}}, {0.25, {1.0, 0.0, 0.0}}},
                   .opacities = {{-2.0, 0.0}, {7.0 / 3.0, 1.0}},
                   .unitDistance = 0.1}};
}

/// The same VDI with that coloring.
inline Vdi colored(Vdi vdi) {
  vdi.coloring = sampleColoring();
  return vdi;
}

/// The same VDI in codes.
inline Vdi compact(const Vdi& vdi) {
  Vdi result = vdi;
  result.depthCode = {0.5F, 0x1p-8F};
  result.lists = reference::compacted(full(vdi), result.depthCode);
  return result;
}

/// While it exists, files of this process cannot grow beyond `bytes`.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit tight{bytes, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &tight);
  }
  ~FileSizeLimit() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  rlimit before_{};
  void (*handler_)(int);
};

}  // namespace vdi::test
