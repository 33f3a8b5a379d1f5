// Volumes and transfer functions for comparisons with the optical model in double precision
// (vdi/reference/Exact.h).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "vdi/core/Block.h"
#include "vdi/core/Camera.h"
#include "vdi/core/ComponentValues.h"
#include "vdi/core/Image.h"
#include "vdi/core/TransferFunction.h"
#include "vdi/reference/Exact.h"
#include "vdi/synthetic/Decomposition.h"

namespace vdi::test {

/// A field that rises and falls along each ray, from 0 to 1.
inline double waves(const glm::dvec3& p) {
  const double sum = std::sin(5.5 * p.x + 2.0 * p.y) + std::cos(4.5 * p.z - 3.0 * p.y) +
                     0.8 * std::sin(4.0 * p.y + 3.0 * p.z + 1.5 * p.x);
  return std::clamp(0.5 + sum / 5.6, 0.0, 1.0);
}

/// The range of scalars over which [0, 1] is stretched, for a type.
struct Stretch {
  ScalarType type;
  double low;
  double high;
  double at(double share) const { return low + (high - low) * share; }
};

constexpr Stretch stretches[] = {
    {ScalarType::U8, 0.0, 250.0},       {ScalarType::I8, -100.0, 120.0},
    {ScalarType::U16, 1000.0, 60000.0}, {ScalarType::I16, -30000.0, -10000.0},
    {ScalarType::U32, 3.0e9, 4.0e9},    {ScalarType::I32, -2000.0, 5000.0},
    {ScalarType::F32, -7.5, -2.25},     {ScalarType::F64, 1.0e-6, 3.0e-6},
};

/// Numbers that stand for missing values of a type, beyond its range above or at its end.
constexpr double fills[] = {255.0, -128.0, 65535.0, -32768.0, 0.0, -9999.0, 1e20, 9.969209968386869e36};

/// Where opticalScene has missing values. None is next to a value at a face: there the device, whose filters
/// read a little of the next value, leaves out the outer half of the cell, too.
inline bool isMissing(const glm::ivec3& index) {
  return glm::length(glm::dvec3(index) - glm::dvec3(6.5, 5.0, 5.5)) < 3.2;
}

/// A lattice whose longest side is 1: this rank's blocks, and the whole volume of the exact reference. Values
/// that isMissing names are `fill`, if that is given.
struct OpticalScene {
  std::vector<Block> mine;
  reference::ExactVolume whole;
};

/// A whole lattice from the world's origin on. valueAt(index) gives its values.
template <typename ValueAt>
reference::ExactVolume wholeOf(const glm::ivec3& size, double spacing, bool cells, ValueAt valueAt) {
  reference::ExactVolume whole{size,
                               glm::dvec3(cells ? 0.5 * spacing : 0.0),
                               glm::dvec3(spacing),
                               {glm::dvec3(0.0), glm::dvec3(size - (cells ? 0 : 1)) * spacing},
                               {}};
  for (int z = 0; z < size.z; ++z) {
    for (int y = 0; y < size.y; ++y) {
      for (int x = 0; x < size.x; ++x) whole.values.push_back(valueAt(glm::ivec3(x, y, z)));
    }
  }
  return whole;
}

inline OpticalScene opticalScene(const Stretch& stretch, synthetic::Joint joint,
                                 const glm::ivec3& blocks = glm::ivec3(1),
                                 synthetic::Layout layout = synthetic::Layout::OnOneRank, int rank = 0,
                                 int ranks = 1, std::optional<double> fill = {}) {
  const glm::ivec3 size{13, 11, 12};
  const bool cells = joint == synthetic::Joint::Cells;
  const double spacing = 1.0 / (13 - (cells ? 0 : 1));
  const auto valueAt = [&](const glm::ivec3& index) {
    if (fill && isMissing(index)) return *fill;
    return stretch.at(waves((glm::dvec3(index) + (cells ? 0.5 : 0.0)) * spacing));
  };
  const synthetic::Lattice lattice{size, glm::dvec3(0.0), glm::dvec3(spacing), stretch.type, joint};
  OpticalScene scene;
  for (const synthetic::Part& part : synthetic::decompose(size, blocks, layout, joint, ranks, 3)) {
    if (part.owner != rank) continue;
    scene.mine.push_back(synthetic::makeBlock(lattice, part, valueAt));
    if (fill) leaveOutMissing(scene.mine.back(), std::array{*fill, 0.5, 1e300});
  }
  const bool whole = stretch.type != ScalarType::F32 && stretch.type != ScalarType::F64;
  scene.whole = wholeOf(size, spacing, cells, [&](const glm::ivec3& index) {
    if (fill && isMissing(index)) return std::numeric_limits<double>::quiet_NaN();
    const double value = valueAt(index);
    return whole ? std::round(value) : value;
  });
  return scene;
}

struct NamedFunction {
  std::string name;
  TransferFunction function;
  bool steep = false;       // has steps, or thin features
  glm::bvec3 lacks{false};  // channels
};

/// Nodes of the two functions, at places in [0, 1].
using Colors = std::vector<ColorNode>;
using Opacities = std::vector<OpacityNode>;

inline std::vector<NamedFunction> namedFunctions(const Stretch& stretch) {
  const Opacities rising{{0.0, 0.03}, {0.5, 0.3}, {1.0, 0.7}};
  const Opacities falling{{0.0, 0.7}, {0.4, 0.2}, {1.0, 0.02}};
  const Colors hues{{0.0, {0.1, 0.2, 0.9}}, {0.5, {0.9, 0.9, 0.2}}, {1.0, {0.9, 0.1, 0.1}}};
  Colors bands;  // indexed: each value its own
  const glm::dvec3 palette[] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 0}, {0, 1, 1}};
  for (int i = 0; i < 5; ++i) {
    bands.push_back({i / 5.0, palette[i]});
    bands.push_back({(i + 1) / 5.0, palette[i]});
  }
  Colors many;
  Opacities manyOpacities;
  for (int i = 0; i < 256; ++i) {
    const double x = i / 255.0;
    many.push_back({x, 0.5 + 0.5 * glm::sin(glm::dvec3(9.0 * x, 9.0 * x + 2.0, 9.0 * x + 4.0))});
    manyOpacities.push_back({x, 0.25 + 0.2 * std::sin(11.0 * x)});
  }
  Colors decades;  // a hue for each power of ten, down to 1e-9 of the range
  for (int i = 9; i >= 0; --i) {
    const double hue = i;
    decades.push_back({std::pow(10.0, -hue), 0.5 + 0.5 * glm::sin(glm::dvec3(hue, hue + 2.0, hue + 4.0))});
  }
  std::vector<NamedFunction> functions{
      {"hues, rising", {hues, rising}},
      {"hues, falling", {hues, falling}},
      {"no red",
       {{{0.0, {0, 0, 1}}, {0.5, {0, 0.2, 1}}, {1.0, {0, 1, 0.3}}}, rising},
       false,
       {true, false, false}},
      {"red", {{{0.0, {1, 0, 0}}, {1.0, {0.6, 0, 0}}}, rising}, false, {false, true, true}},
      {"green, falling", {{{0.0, {0, 0, 0}}, {1.0, {0, 1, 0}}}, falling}, false, {true, false, true}},
      {"blue, falling", {{{0.0, {0, 0, 0.9}}, {1.0, {0, 0, 0.9}}}, falling}, false, {true, true, false}},
      {"magenta",
       {{{0.0, {1, 0, 0}}, {1.0, {0, 0, 1}}}, {{0.0, 0.3}, {1.0, 0.3}}},
       false,
       {false, true, false}},
      {"black", {{{0.0, {0, 0, 0}}}, rising}, false, {true, true, true}},
      {"256 control points", {many, manyOpacities}},
      {"range within the data's",
       {{{0.3, {0.1, 0.2, 0.9}}, {0.7, {0.9, 0.3, 0.1}}}, {{0.3, 0.1}, {0.7, 0.5}}}},
      {"indexed bands", {bands, rising}, true},
      {"step of opacity", {hues, {{0.0, 0.0}, {0.55, 0.0}, {0.55, 0.6}, {1.0, 0.6}}}, true},
      {"a falling step, opaque", {hues, {{0.0, 1.0}, {0.3, 1.0}, {0.3, 0.0}, {1.0, 0.0}}}, true},
      {"thin bands",
       {hues, {{0.0, 0.0}, {0.28, 0.0}, {0.3, 0.9}, {0.32, 0.0}, {0.68, 0.0}, {0.7, 0.9}, {0.72, 0.0}}},
       true},
      {"air, and a jump of 1e-5", {hues, {{0.0, 0.0}, {0.4, 0.0}, {0.40001, 0.3}, {1.0, 0.8}}}, true},
      {"a peak of 1 - 1e-9", {hues, {{0.0, 0.0}, {0.5, 1.0 - 1e-9}, {1.0, 0.0}}}, true},
      {"decades", {decades, {{0.0, 0.1}, {1e-4, 0.3}, {1e-2, 0.2}, {1.0, 0.6}}}, true},
  };
  for (NamedFunction& named : functions) {
    for (ColorNode& node : named.function.colors) node.x = stretch.at(node.x);
    for (OpacityNode& node : named.function.opacities) node.x = stretch.at(node.x);
    named.function.unitDistance = 0.2;
  }
  return functions;
}

/// Largest and mean difference of the channels, opacity included, in 1/255.
struct Off {
  double largest = 0.0;
  double mean = 0.0;    // mean of the worst channel
  double pixels = 0.0;  // share of them with a channel that is off by more than 8
};

inline Off offBetween(const Image& a, const Image& b) {
  Off off;
  glm::dvec4 sum(0.0);
  for (std::size_t i = 0; i < a.rgba.size(); ++i) {
    const glm::dvec4 apart = 255.0 * glm::abs(glm::dvec4(a.rgba[i]) - glm::dvec4(b.rgba[i]));
    sum += apart;
    const double most = std::max({apart.r, apart.g, apart.b, apart.a});
    off.largest = std::max(off.largest, most);
    off.pixels += (most > 8.0 ? 1.0 : 0.0) / static_cast<double>(a.rgba.size());
  }
  for (int c = 0; c < 4; ++c) off.mean = std::max(off.mean, sum[c] / static_cast<double>(a.rgba.size()));
  return off;
}

/// The largest value of each channel over all pixels.
inline glm::vec3 brightest(const Image& image) {
  glm::vec3 most(0.0F);
  for (const glm::vec4& pixel : image.rgba) most = glm::max(most, glm::vec3(pixel));
  return most;
}

inline float mostOpaque(const Image& image) {
  float most = 0.0F;
  for (const glm::vec4& pixel : image.rgba) most = std::max(most, pixel.a);
  return most;
}

/// A camera that looks at the scene's middle, and whose rays run along no face and through no edge.
inline Camera lookingAt(bool parallel) {
  Camera camera;
  camera.focalPoint = {0.49, 0.43, 0.46};
  camera.position = camera.focalPoint + glm::dvec3(1.31, 0.97, 1.53);
  camera.parallelProjection = parallel;
  camera.parallelScale = 0.75;
  return camera;
}

}  // namespace vdi::test
