#include "vdi/reference/Exact.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace vdi::reference {

namespace {

/// Interpolates linearly between nodes; takes the last of several at one place; is constant beyond all nodes.
template <typename Node, typename Value>
Value valueAt(const std::vector<Node>& nodes, Value Node::*value, double x) {
  std::size_t next = 0;
  while (next < nodes.size() && nodes[next].x <= x) ++next;
  if (next == 0) return nodes.front().*value;
  if (next == nodes.size()) return nodes.back().*value;
  const Node& a = nodes[next - 1];
  const Node& b = nodes[next];
  return a.*value + (b.*value - a.*value) * ((x - a.x) / (b.x - a.x));
}

struct Line {
  glm::dvec3 from;
  glm::dvec3 to;
};

/// Clips the half line from `origin` to the box; false if nothing is left.
bool clip(const Box& box, const glm::dvec3& origin, const glm::dvec3& direction, Line& line) {
  double enter = 0.0;
  double leave = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    if (direction[axis] == 0.0) {
      if (origin[axis] < box.lo[axis] || origin[axis] > box.hi[axis]) return false;
      continue;
    }
    const double a = (box.lo[axis] - origin[axis]) / direction[axis];
    const double b = (box.hi[axis] - origin[axis]) / direction[axis];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  line = {origin + enter * direction, origin + leave * direction};
  return enter < leave;
}

}  // namespace

double ExactVolume::at(const glm::dvec3& world) const {
  glm::dvec3 place = glm::clamp((world - origin) / spacing, glm::dvec3(0.0), glm::dvec3(dims - 1));
  if (nearest) place = glm::floor(place + 0.5);
  const glm::ivec3 low = glm::ivec3(glm::floor(place));
  const glm::ivec3 high = glm::min(low + 1, dims - 1);
  const glm::dvec3 share = place - glm::dvec3(low);
  const auto value = [&](int x, int y, int z) {
    const auto index =
        (static_cast<std::size_t>(z) * static_cast<std::size_t>(dims.y) + static_cast<std::size_t>(y)) *
            static_cast<std::size_t>(dims.x) +
        static_cast<std::size_t>(x);
    return values[index];
  };
  const auto alongX = [&](int y, int z) {
    return value(low.x, y, z) * (1.0 - share.x) + value(high.x, y, z) * share.x;
  };
  const auto alongY = [&](int z) { return alongX(low.y, z) * (1.0 - share.y) + alongX(high.y, z) * share.y; };
  return alongY(low.z) * (1.0 - share.z) + alongY(high.z) * share.z;
}

namespace {

glm::dvec3 colorAt(const ExactVolume& volume, const TransferFunction& function, const glm::dvec3& world) {
  const auto& c = volume.colors;
  if (c.size() == 3) return {c[0].at(world), c[1].at(world), c[2].at(world)};
  return valueAt(function.colors, &ColorNode::color, c.empty() ? volume.at(world) : c[0].at(world));
}

}  // namespace

glm::dvec4 integrate(const ExactVolume& volume, const TransferFunction& function, const glm::dvec3& from,
                     const glm::dvec3& to, int samples) {
  const double length = glm::length(to - from) / samples / function.unitDistance;
  glm::dvec3 light(0.0);
  double transmittance = 1.0;
  for (int i = 0; i < samples && transmittance > 1e-9; ++i) {
    const glm::dvec3 place = from + (to - from) * ((i + 0.5) / samples);
    const double scalar = volume.at(place);
    if (std::isnan(scalar)) continue;  // transparent
    const double opacity = valueAt(function.opacities, &OpacityNode::opacity, scalar);
    const double passes = std::pow(1.0 - opacity, length);
    if (passes < 1.0) light += transmittance * (1.0 - passes) * colorAt(volume, function, place);
    transmittance *= passes;
  }
  return {light, 1.0 - transmittance};
}

namespace {

/// Premultiplied colour and opacity, with the opacity function's own opacity.
glm::dvec4 materialAt(const TransferFunction& function, double scalar) {
  const double opacity = valueAt(function.opacities, &OpacityNode::opacity, scalar);
  return {opacity * valueAt(function.colors, &ColorNode::color, scalar), opacity};
}

}  // namespace

glm::dvec4 project(const ExactVolume& volume, const TransferFunction& function, const glm::dvec3& from,
                   const glm::dvec3& to, int parts, bool largest) {
  double extreme = volume.at(from);
  for (int i = 1; i <= parts; ++i) {
    const double scalar = volume.at(from + (to - from) * (static_cast<double>(i) / parts));
    extreme = largest ? std::max(extreme, scalar) : std::min(extreme, scalar);
  }
  return materialAt(function, extreme);
}

glm::dvec4 cross(const ExactVolume& volume, const TransferFunction& function,
                 const std::vector<double>& isovalues, const glm::dvec3& from, const glm::dvec3& to,
                 int parts) {
  glm::dvec4 sum(0.0);
  double before = volume.at(from);
  for (int i = 1; i <= parts; ++i) {
    const double scalar = volume.at(from + (to - from) * (static_cast<double>(i) / parts));
    std::vector<double> passed;
    for (const double value : isovalues) {
      if ((before < value) != (scalar < value)) passed.push_back(value);
    }
    std::ranges::sort(passed, [&](double a, double b) { return before < scalar ? a < b : b < a; });
    for (const double value : passed) sum += (1.0 - sum.a) * materialAt(function, value);
    before = scalar;
  }
  return sum;
}

Image renderExactly(const ExactVolume& volume, const TransferFunction& function, const Camera& camera,
                    int width, int height, int samplesPerVoxel, const Blending& blending) {
  assert(!function.colors.empty() && !function.opacities.empty());
  const auto colorOf = [&](const Line& line, int parts) {
    if (blending.mode == BlendMode::Isosurface)
      return cross(volume, function, blending.isovalues, line.from, line.to, parts);
    if (blending.mode == BlendMode::Composite) return integrate(volume, function, line.from, line.to, parts);
    return project(volume, function, line.from, line.to, parts, blending.mode == BlendMode::Maximum);
  };
  const glm::dvec3 forward = glm::normalize(camera.focalPoint - camera.position);
  const glm::dvec3 right = glm::normalize(glm::cross(forward, camera.viewUp));
  const glm::dvec3 up = glm::cross(right, forward);
  const double halfHeight = camera.parallelProjection
                                ? camera.parallelScale
                                : std::tan(0.5 * camera.viewAngle * 3.14159265358979323846 / 180.0);
  const double perPixel = 2.0 * halfHeight / height;
  const double smallest = std::min({volume.spacing.x, volume.spacing.y, volume.spacing.z});
  Image image{width, height, {}, {}};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const glm::dvec3 offset =
          (x + 0.5 - 0.5 * width) * perPixel * right + (y + 0.5 - 0.5 * height) * perPixel * up;
      Line line{};
      const bool hits = camera.parallelProjection
                            ? clip(volume.bounds, camera.position + offset, forward, line)
                            : clip(volume.bounds, camera.position, forward + offset, line);
      const double voxels = hits ? glm::length(line.to - line.from) / smallest : 0.0;
      const int samples = std::max(1, static_cast<int>(std::ceil(voxels * samplesPerVoxel)));
      image.rgba.push_back(hits ? glm::vec4(colorOf(line, samples)) : glm::vec4(0.0F));
    }
  }
  return image;
}

}  // namespace vdi::reference
