#include "VDITransferFunctions.h"

#include <vtkColorTransferFunction.h>
#include <vtkDiscretizableColorTransferFunction.h>
#include <vtkPiecewiseFunction.h>
#include <vtkSmartPointer.h>

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <vector>

namespace pv {

namespace {

struct Knot {
  double x = 0.0;
  glm::dvec3 value{0.0};  // a colour, or an opacity in each component
};

struct ControlPoint {
  Knot knot;
  bool linear = false;  // whether a straight line leads to the next point
};

/// A function of VTK. It follows a rule of its own between control points, and is constant beyond them.
class Curve {
 public:
  Curve() = default;
  Curve(const Curve&) = delete;
  Curve& operator=(const Curve&) = delete;
  virtual ~Curve() = default;

  virtual std::vector<ControlPoint> points() const = 0;
  /// Returns `count` >= 1 knots from `first` to `last`, evenly spaced, or with evenly spaced logarithms if
  /// the function has a logarithmic scale.
  virtual std::vector<Knot> sampled(double first, double last, std::size_t count) const = 0;
  virtual double tolerance() const { return 1e-3; }
};

double between(double first, double last, std::size_t i, std::size_t count, bool logarithmic) {
  if (count == 1) return 0.5 * (first + last);
  const double share = static_cast<double>(i) / static_cast<double>(count - 1);
  return logarithmic ? std::pow(10.0, std::log10(first) + share * (std::log10(last) - std::log10(first)))
                     : first + share * (last - first);
}

class ColorCurve : public Curve {
 public:
  explicit ColorCurve(vtkColorTransferFunction* function) : function_(function) {}

  std::vector<ControlPoint> points() const override {
    std::vector<ControlPoint> points;
    for (int i = 0; i < function_->GetSize(); ++i) {
      double node[6];  // x, red, green, blue, midpoint, sharpness
      function_->GetNodeValue(i, node);
      const bool linear =
          function_->GetColorSpace() == VTK_CTF_RGB && !logarithmic() && node[4] == 0.5 && node[5] == 0.0;
      points.push_back({{node[0], {node[1], node[2], node[3]}}, linear});
    }
    return points;
  }
  std::vector<Knot> sampled(double first, double last, std::size_t count) const override {
    // GetColor is unsuitable: it looks up discrete values and categories.
    std::vector<double> table(3 * count);
    function_->GetTable(first, last, static_cast<int>(count), table.data());
    std::vector<Knot> knots;
    for (std::size_t i = 0; i < count; ++i) {
      knots.push_back({between(first, last, i, count, logarithmic()),
                       {table[3 * i], table[3 * i + 1], table[3 * i + 2]}});
    }
    return knots;
  }
  /// VTK rounds colours that it interpolates by CIEDE2000 to 8 bits.
  double tolerance() const override {
    return function_->GetColorSpace() == VTK_CTF_LAB_CIEDE2000 ? 0.5 / 255.0 : Curve::tolerance();
  }

 private:
  bool logarithmic() const {
    return function_->GetScale() == VTK_CTF_LOG10 && function_->GetRange()[0] > 0.0;
  }
  vtkColorTransferFunction* function_;
};

class OpacityCurve : public Curve {
 public:
  explicit OpacityCurve(vtkPiecewiseFunction* function) : function_(function) {}

  std::vector<ControlPoint> points() const override {
    std::vector<ControlPoint> points;
    for (int i = 0; i < function_->GetSize(); ++i) {
      double node[4];  // x, opacity, midpoint, sharpness
      function_->GetNodeValue(i, node);
      points.push_back({{node[0], glm::dvec3(node[1])}, !logarithmic() && node[2] == 0.5 && node[3] == 0.0});
    }
    return points;
  }
  std::vector<Knot> sampled(double first, double last, std::size_t count) const override {
    std::vector<Knot> knots;
    if (count == 1) return {{0.5 * (first + last), glm::dvec3(function_->GetValue(0.5 * (first + last)))}};
    std::vector<double> table(count);
    function_->GetTable(first, last, static_cast<int>(count), table.data(), 1, logarithmic() ? 1 : 0);
    for (std::size_t i = 0; i < count; ++i)
      knots.push_back({between(first, last, i, count, logarithmic()), glm::dvec3(table[i])});
    return knots;
  }

 private:
  bool logarithmic() const { return function_->GetUseLogScale() && function_->GetRange()[0] > 0.0; }
  vtkPiecewiseFunction* function_;
};

double difference(const glm::dvec3& a, const glm::dvec3& b) {
  const glm::dvec3 apart = glm::abs(a - b);
  return std::max({apart.x, apart.y, apart.z});
}

/// Whether double precision can tell values between `first` and `last` apart.
bool isWide(double first, double last) {
  return 1e-6 * (last - first) > 1e-13 * std::max(std::abs(first), std::abs(last));
}

/// Samples a stretch without control points. It samples more finely around jumps, and in the end represents a
/// jump by a step.
void addSamples(const Curve& curve, double first, double last, std::size_t count, int levels,
                std::vector<Knot>& knots) {
  constexpr std::size_t finer = 17;
  constexpr double coarse = 1.0 / 32.0;
  const std::vector<Knot> samples = curve.sampled(first, last, count);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (i > 0 && difference(samples[i - 1].value, samples[i].value) > coarse) {
      const double front = samples[i - 1].x;
      const double back = samples[i].x;
      if (levels > 0 && isWide(front, back)) {
        addSamples(curve, front, back, finer, levels - 1, knots);
      } else {
        knots.push_back({0.5 * (front + back), samples[i - 1].value});
        knots.push_back({0.5 * (front + back), samples[i].value});
      }
    }
    knots.push_back(samples[i]);
  }
}

/// Leaves out knots on the straight line between others.
void simplify(std::vector<Knot>& knots, double tolerance) {
  std::vector<Knot> kept;
  const auto isStraight = [&](std::size_t first, std::size_t last) {
    const double length = knots[last].x - knots[first].x;
    for (std::size_t i = first + 1; i < last; ++i) {
      const double share = length > 0.0 ? (knots[i].x - knots[first].x) / length : 0.0;
      const glm::dvec3 line = glm::mix(knots[first].value, knots[last].value, share);
      if (!(difference(line, knots[i].value) <= tolerance)) return false;
    }
    return true;
  };
  for (std::size_t at = 0; at < knots.size();) {
    kept.push_back(knots[at]);
    std::size_t next = at + 1;
    while (next + 1 < knots.size() && isStraight(at, next + 1)) ++next;
    at = next;
  }
  knots = std::move(kept);
}

/// The knots from one control point to the next, both included.
std::vector<Knot> knotsBetween(const Curve& curve, const ControlPoint& from, const Knot& to,
                               std::size_t count) {
  constexpr int levels = 3;
  const double first = from.knot.x;
  const double inset = 1e-6 * (to.x - first);  // VTK's value at a control point differs from those beside it
  std::vector<Knot> knots{from.knot};
  if (!from.linear && isWide(first, to.x)) {
    std::vector<Knot> samples;
    addSamples(curve, first + inset, to.x - inset, count, levels, samples);
    const bool sound = std::all_of(samples.begin(), samples.end(), [](const Knot& knot) {
      return std::isfinite(knot.x) && std::isfinite(knot.value.x + knot.value.y + knot.value.z);
    });
    if (sound) {  // logarithms are finite only for positive numbers
      samples.front().x = first;
      samples.back().x = to.x;
      knots.insert(knots.end(), samples.begin(), samples.end());
    }
  }
  knots.push_back(to);
  simplify(knots, curve.tolerance());
  return knots;
}

/// Puts a jump at the function's ends a little outside, so that scalars at the ends aren't affected.
void addJumpsAtEnds(const Curve& curve, std::vector<Knot>& knots) {
  const Knot first = knots.front();
  const Knot last = knots.back();
  const double width = last.x - first.x;
  const double gap = width > 0.0 ? width / 512.0 : std::max(1e-3 * std::abs(first.x), 1e-6);
  const double gapBelow = first.x > 0.0 ? std::min(gap, 0.5 * first.x) : gap;  // positive, for logarithms
  const glm::dvec3 below = curve.sampled(first.x - gapBelow, first.x - gapBelow, 1).front().value;
  const glm::dvec3 above = curve.sampled(last.x + gap, last.x + gap, 1).front().value;
  if (difference(below, first.value) > curve.tolerance()) {
    const double jump = first.x - 0.5 * gapBelow;
    knots.insert(knots.begin(), {{first.x - gapBelow, below}, {jump, below}, {jump, first.value}});
  }
  if (difference(above, last.value) > curve.tolerance()) {
    const double jump = last.x + 0.5 * gap;
    knots.insert(knots.end(), {{jump, last.value}, {jump, above}, {last.x + gap, above}});
  }
}

/// The knots between which straight lines form the function.
std::vector<Knot> knotsOf(const Curve& curve) {
  constexpr std::size_t samplesInAll = 16384;
  constexpr std::size_t fewest = 9;
  constexpr std::size_t most = 129;
  const std::vector<ControlPoint> points = curve.points();
  std::vector<Knot> knots;
  if (points.empty()) return knots;
  const std::size_t count = std::clamp(samplesInAll / points.size(), fewest, most);
  for (std::size_t i = 0; i + 1 < points.size(); ++i) {
    const std::vector<Knot> more = knotsBetween(curve, points[i], points[i + 1].knot, count);
    knots.insert(knots.end(), more.begin(), std::prev(more.end()));
  }
  knots.push_back(points.back().knot);
  addJumpsAtEnds(curve, knots);
  return knots;
}

std::vector<vdi::ColorNode> colorNodes(const std::vector<Knot>& knots) {
  std::vector<vdi::ColorNode> nodes;
  nodes.reserve(knots.size());
  for (const Knot& knot : knots) nodes.push_back({knot.x, glm::clamp(knot.value, 0.0, 1.0)});
  return nodes;
}

/// Samples a map of another kind at evenly spaced scalars.
std::vector<vdi::ColorNode> colorNodes(vtkScalarsToColors* map) {
  constexpr int samples = 1024;
  const double* range = map->GetRange();
  std::vector<vdi::ColorNode> nodes;
  for (int i = 0; i < samples; ++i) {
    const double x = range[0] + (range[1] - range[0]) * i / (samples - 1);
    double rgb[3];
    map->GetColor(x, rgb);
    nodes.push_back({x, glm::clamp(glm::dvec3(rgb[0], rgb[1], rgb[2]), 0.0, 1.0)});
  }
  return nodes;
}

vtkSmartPointer<vtkScalarsToColors> coolToWarm(double low, double high) {
  auto map = vtkSmartPointer<vtkColorTransferFunction>::New();
  map->SetColorSpaceToDiverging();
  map->AddRGBPoint(low, 0.231373, 0.298039, 0.752941);
  map->AddRGBPoint(0.5 * (low + high), 0.865, 0.865, 0.865);
  map->AddRGBPoint(high, 0.705882, 0.0156863, 0.14902);
  return map;
}

}  // namespace

vdi::TransferFunction transferFunctionOf(vtkScalarsToColors* colors, vtkPiecewiseFunction* opacity,
                                         double low, double high, double unitDistance) {
  vdi::TransferFunction function;
  function.unitDistance = unitDistance;
  const vtkSmartPointer<vtkScalarsToColors> map = colors != nullptr ? colors : coolToWarm(low, high).Get();
  auto* curve = vtkColorTransferFunction::SafeDownCast(map);
  function.colors = curve != nullptr ? colorNodes(knotsOf(ColorCurve(curve))) : colorNodes(map.Get());
  if (auto* own = vtkDiscretizableColorTransferFunction::SafeDownCast(map);
      own != nullptr && opacity == nullptr)
    opacity = own->GetScalarOpacityFunction();
  if (opacity == nullptr || opacity->GetSize() == 0) {
    function.opacities = {{map->GetRange()[0], 0.0}, {map->GetRange()[1], 1.0}};
    return function;
  }
  for (const Knot& knot : knotsOf(OpacityCurve(opacity)))
    function.opacities.push_back({knot.x, std::clamp(knot.value.x, 0.0, 1.0)});
  return function;
}

std::vector<vdi::OpacityNode> stretched(const vdi::TransferFunction& function, double low, double high,
                                        double top) {
  std::vector<vdi::OpacityNode> nodes{{0.0, function.opacityAt(low)}};
  for (const vdi::OpacityNode& node : function.opacities) {
    if (node.x > low && node.x < high) nodes.push_back({(node.x - low) / (high - low) * top, node.opacity});
  }
  nodes.push_back({top, function.opacityAt(high)});
  return nodes;
}

}  // namespace pv
