// The picture of a volume by the optical model alone: an integral in double precision that shares no table,
// no lattice of samples and no helper with the code under test.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <memory>
#include <vector>

#include "vdi/core/Block.h"
#include "vdi/core/TransferFunction.h"

namespace vdi::test {

/// A function of position on a lattice, as plain numbers.
struct Lattice {
  glm::ivec3 size;
  glm::dvec3 spacing;
  std::vector<double> values;  // [z][y][x]

  Lattice(const glm::ivec3& theSize, const glm::dvec3& theSpacing,
          const std::function<double(const glm::dvec3&)>& function)
      : size(theSize), spacing(theSpacing) {
    for (int z = 0; z < size.z; ++z) {
      for (int y = 0; y < size.y; ++y) {
        for (int x = 0; x < size.x; ++x)
          values.push_back(static_cast<float>(function(glm::dvec3(x, y, z) * spacing)));
      }
    }
  }
  double valueAt(const std::array<double, 3>& place) const {
    std::array<int, 3> low{};
    std::array<double, 3> share{};
    for (int axis = 0; axis < 3; ++axis) {
      const auto i = static_cast<std::size_t>(axis);
      const double index = std::min(std::max(place[i] / spacing[axis], 0.0), size[axis] - 1.0);
      low[i] = std::min(static_cast<int>(index), size[axis] - 2);
      share[i] = index - low[i];
    }
    double sum = 0.0;
    for (int z = 0; z < 2; ++z) {
      for (int y = 0; y < 2; ++y) {
        for (int x = 0; x < 2; ++x) {
          const double weight = (x != 0 ? share[0] : 1 - share[0]) * (y != 0 ? share[1] : 1 - share[1]) *
                                (z != 0 ? share[2] : 1 - share[2]);
          const auto at =
              static_cast<std::size_t>(((low[2] + z) * size.y + low[1] + y) * size.x + low[0] + x);
          sum += weight * values[at];
        }
      }
    }
    return sum;
  }
  Block block(ScalarType type, double scale) const {
    const auto count = values.size();
    const std::shared_ptr<std::byte[]> data(new std::byte[count * sizeOf(type)]);
    for (std::size_t i = 0; i < count; ++i) storeValue(type, data.get(), i, values[i] * scale);
    Block result = Block::fromPoints(size, glm::dvec3(0.0), spacing, type, data.get());
    result.keepAlive = std::shared_ptr<const void>(data, data.get());
    return result;
  }
};

/// Colour and opacity of a scalar in [0, 1], linear between the nodes; the transfer functions below have the
/// same nodes.
struct Material {
  std::array<double, 3> low;
  std::array<double, 3> high;
  double opaqueFrom;  // opacity rises from here to `opacity` at 1
  double opacity;
  double unit;

  TransferFunction function(double scale) const {
    return {{{0.0, {low[0], low[1], low[2]}}, {scale, {high[0], high[1], high[2]}}},
            {{0.0, 0.0}, {opaqueFrom * scale, 0.0}, {scale, opacity}},
            unit};
  }
};

struct Lamp {
  std::array<double, 3> towards;  // world
  std::array<double, 3> color;
};

/// The lighting, and the visible places; none: all.
struct Look {
  std::vector<Lamp> lamps;
  double ambient = 0.0;
  std::function<bool(const glm::dvec3&)> shows{};
};

/// The integral along -z through (x, y), in steps of a 64th of a voxel.
inline std::array<double, 4> integral(const Lattice& lattice, const Material& material, const Look& look,
                                      double x, double y) {
  std::array<double, 4> sum{};
  const double top = (lattice.size.z - 1) * lattice.spacing.z;
  const double step = std::min({lattice.spacing.x, lattice.spacing.y, lattice.spacing.z}) / 64.0;
  if (x < 0 || y < 0 || x > (lattice.size.x - 1) * lattice.spacing.x ||
      y > (lattice.size.y - 1) * lattice.spacing.y)
    return sum;
  for (double z = top - 0.5 * step; z > 0.0; z -= step) {
    if (look.shows && !look.shows({x, y, z})) continue;
    const double value = lattice.valueAt({x, y, z});
    const double share = (value - material.opaqueFrom) / (1.0 - material.opaqueFrom);
    if (share <= 0.0) continue;
    const double opacity =
        1.0 - std::pow(1.0 - material.opacity * std::min(share, 1.0), step / material.unit);
    std::array<double, 3> gradient{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double h = lattice.spacing[static_cast<int>(axis)];
      std::array<double, 3> ahead{x, y, z};
      std::array<double, 3> behind{x, y, z};
      ahead[axis] += h;
      behind[axis] -= h;
      gradient[axis] = (lattice.valueAt(ahead) - lattice.valueAt(behind)) / h;
    }
    const double length = std::hypot(gradient[0], gradient[1], gradient[2]);
    for (std::size_t c = 0; c < 3; ++c) {
      double light = look.ambient;
      for (const Lamp& lamp : look.lamps) {
        const double size = std::hypot(lamp.towards[0], lamp.towards[1], lamp.towards[2]);
        const double along =
            gradient[0] * lamp.towards[0] + gradient[1] * lamp.towards[1] + gradient[2] * lamp.towards[2];
        if (length > 0.0) light += lamp.color[c] * std::abs(along) / (length * size);
      }
      const double color =
          material.low[c] + std::min(std::max(value, 0.0), 1.0) * (material.high[c] - material.low[c]);
      sum[c] += (1.0 - sum[3]) * opacity * color * light;
    }
    sum[3] += (1.0 - sum[3]) * opacity;
  }
  return sum;
}

}  // namespace vdi::test
