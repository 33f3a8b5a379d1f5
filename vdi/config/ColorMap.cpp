#include "vdi/config/ColorMap.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

namespace vdi::config {

using io::JsonValue;
using io::parseJson;

namespace {

constexpr double pi = std::numbers::pi;

/// The white point of daylight, D65.
constexpr glm::dvec3 white{0.9505, 1.0, 1.089};

double toLinear(double c) {
  return c > 0.04045 ? std::pow((c + 0.055) / 1.055, 2.4) : c / 12.92;
}
double fromLinear(double c) {
  return c > 0.0031308 ? 1.055 * std::pow(c, 1.0 / 2.4) - 0.055 : 12.92 * c;
}

/// CIELAB of an sRGB colour.
glm::dvec3 toLab(const glm::dvec3& rgb) {
  const glm::dvec3 l{toLinear(rgb.x), toLinear(rgb.y), toLinear(rgb.z)};
  const glm::dvec3 xyz{0.4124 * l.x + 0.3576 * l.y + 0.1805 * l.z, 0.2126 * l.x + 0.7152 * l.y + 0.0722 * l.z,
                       0.0193 * l.x + 0.1192 * l.y + 0.9505 * l.z};
  const auto f = [](double t) { return t > 0.008856 ? std::cbrt(t) : 7.787 * t + 16.0 / 116.0; };
  const glm::dvec3 share = xyz / white;
  return {116.0 * f(share.y) - 16.0, 500.0 * (f(share.x) - f(share.y)), 200.0 * (f(share.y) - f(share.z))};
}

/// The sRGB colour of a CIELAB one. As VTK does, it darkens colours that are too bright for the screen.
glm::dvec3 fromLab(const glm::dvec3& lab) {
  const double y = (lab.x + 16.0) / 116.0;
  const auto inverse = [](double t) { return t * t * t > 0.008856 ? t * t * t : (t - 16.0 / 116.0) / 7.787; };
  const glm::dvec3 xyz =
      white * glm::dvec3(inverse(y + lab.y / 500.0), inverse(y), inverse(y - lab.z / 200.0));
  const glm::dvec3 l{3.2406 * xyz.x - 1.5372 * xyz.y - 0.4986 * xyz.z,
                     -0.9689 * xyz.x + 1.8758 * xyz.y + 0.0415 * xyz.z,
                     0.0557 * xyz.x - 0.2040 * xyz.y + 1.0570 * xyz.z};
  const glm::dvec3 rgb(fromLinear(l.x), fromLinear(l.y), fromLinear(l.z));
  return glm::max(rgb / std::max({rgb.x, rgb.y, rgb.z, 1.0}), 0.0);
}

/// Lab in polar coordinates: magnitude, saturation as an angle, hue (Moreland, "Diverging Color Maps for
/// Scientific Visualization", 2009).
struct Msh {
  double m = 0.0;
  double s = 0.0;
  double h = 0.0;
};

Msh toMsh(const glm::dvec3& rgb) {
  const glm::dvec3 lab = toLab(rgb);
  Msh msh;
  msh.m = glm::length(lab);
  msh.s = msh.m > 0.001 ? std::acos(lab.x / msh.m) : 0.0;
  msh.h = msh.s > 0.001 ? std::atan2(lab.z, lab.y) : 0.0;
  return msh;
}

glm::dvec3 fromMsh(const Msh& msh) {
  return fromLab({msh.m * std::cos(msh.s), msh.m * std::sin(msh.s) * std::cos(msh.h),
                  msh.m * std::sin(msh.s) * std::sin(msh.h)});
}

/// The hue that an unsaturated colour of magnitude `m` needs for a straight-looking path to `saturated`.
double hueTowards(const Msh& saturated, double m) {
  if (saturated.m >= m - 0.1) return saturated.h;
  const double spin =
      saturated.s * std::sqrt(m * m - saturated.m * saturated.m) / (saturated.m * std::sin(saturated.s));
  return saturated.h > -0.3 * pi ? saturated.h + spin : saturated.h - spin;
}

glm::dvec3 divergingBetween(const glm::dvec3& first, const glm::dvec3& last, double share) {
  Msh a = toMsh(first);
  Msh b = toMsh(last);
  constexpr double grey = 0.05;
  double apart = std::abs(a.h - b.h);
  while (apart > 2.0 * pi) apart -= 2.0 * pi;
  if (apart > pi) apart = 2.0 * pi - apart;
  if (a.s > grey && b.s > grey && apart > 0.33 * pi) {  // white or nearly white lies between different hues
    const double middle = std::max({a.m, b.m, 88.0});
    if (share < 0.5) {
      b = {middle, 0.0, 0.0};
      share = 2.0 * share;
    } else {
      a = {middle, 0.0, 0.0};
      share = 2.0 * share - 1.0;
    }
  }
  if (a.s < grey && b.s > grey) {
    a.h = hueTowards(b, a.m);
  } else if (b.s < grey && a.s > grey) {
    b.h = hueTowards(a, b.m);
  }
  return fromMsh({std::lerp(a.m, b.m, share), std::lerp(a.s, b.s, share), std::lerp(a.h, b.h, share)});
}

glm::dvec3 toHsv(const glm::dvec3& rgb) {
  const double most = std::max({rgb.x, rgb.y, rgb.z});
  const double spread = most - std::min({rgb.x, rgb.y, rgb.z});
  double hue = 0.0;
  if (spread > 0.0) {
    if (most == rgb.x) {
      hue = (rgb.y - rgb.z) / spread;
    } else if (most == rgb.y) {
      hue = 2.0 + (rgb.z - rgb.x) / spread;
    } else {
      hue = 4.0 + (rgb.x - rgb.y) / spread;
    }
    hue /= 6.0;
    if (hue < 0.0) hue += 1.0;
  }
  return {hue, most > 0.0 ? spread / most : 0.0, most};
}

glm::dvec3 fromHsv(const glm::dvec3& hsv) {
  const auto channel = [&](double n) {
    const double k = std::fmod(n + 6.0 * hsv.x, 6.0);
    return hsv.z * (1.0 - hsv.y * std::clamp(std::min(k, 4.0 - k), 0.0, 1.0));
  };
  return {channel(5.0), channel(3.0), channel(1.0)};
}

enum class Space { Rgb, Hsv, Lab, Diverging, Step };

glm::dvec3 between(Space space, const glm::dvec3& first, const glm::dvec3& last, double share) {
  switch (space) {
    case Space::Hsv:
      return fromHsv(glm::mix(toHsv(first), toHsv(last), share));
    case Space::Lab:
      return fromLab(glm::mix(toLab(first), toLab(last), share));
    case Space::Diverging:
      return divergingBetween(first, last, share);
    case Space::Rgb:
    case Space::Step:
      break;
  }
  return glm::mix(first, last, share);
}

/// The nodes of a map in `space`, converted to a map that is linear in RGB.
std::vector<ColorNode> straightened(const std::vector<ColorNode>& nodes, Space space) {
  if (space == Space::Rgb) return nodes;
  constexpr std::size_t inAll = 8192;
  const std::size_t pieces = std::clamp<std::size_t>(inAll / nodes.size(), 1, 64);
  std::vector<ColorNode> straight{nodes.front()};
  for (std::size_t i = 0; i + 1 < nodes.size(); ++i) {
    const ColorNode& first = nodes[i];
    const ColorNode& last = nodes[i + 1];
    if (space == Space::Step) {  // VTK gives an interval its second colour
      straight.push_back({first.x, last.color});
    } else {
      for (std::size_t p = 1; p < pieces && first.x < last.x; ++p) {
        const double share = static_cast<double>(p) / static_cast<double>(pieces);
        straight.push_back(
            {std::lerp(first.x, last.x, share), between(space, first.color, last.color, share)});
      }
    }
    straight.push_back(last);
  }
  return straight;
}

Space spaceOf(const JsonValue& preset) {
  const std::optional<JsonValue> space = preset.find("ColorSpace");
  if (!space) return Space::Rgb;
  const std::string& name = space->text();
  if (name == "RGB") return Space::Rgb;
  if (name == "HSV") return Space::Hsv;
  if (name == "Lab" || name == "CIELAB") return Space::Lab;
  if (name == "Diverging") return Space::Diverging;
  if (name == "Step") return Space::Step;
  space->fail("unknown colour space; use RGB, HSV, Lab, Diverging or Step");
}

/// The array's numbers in rows of four.
std::vector<std::array<double, 4>> rowsOf(const JsonValue& value) {
  constexpr std::size_t width = 4;
  const std::vector<JsonValue> items = value.items();
  if (items.size() < 2 * width || items.size() % width != 0)
    value.fail("must be four numbers for each of at least two nodes");
  std::vector<std::array<double, 4>> rows;
  for (std::size_t i = 0; i < items.size(); i += width) {
    rows.push_back({items[i].number(), items[i + 1].number(), items[i + 2].number(), items[i + 3].number()});
    if (rows.size() > 1 && rows.back()[0] < rows[rows.size() - 2][0]) items[i].fail("nodes must ascend");
  }
  if (!(rows.front()[0] < rows.back()[0])) value.fail("all nodes lie at the same value");
  if (!std::isfinite(rows.back()[0] - rows.front()[0])) value.fail("the nodes lie too far apart");
  return rows;
}

ColorMap readPreset(const JsonValue& preset) {
  const Space space = spaceOf(preset);
  const auto points = preset.find("RGBPoints");
  if (!points) preset.fail("no 'RGBPoints': presets of categories have no colours for values in between");
  std::vector<ColorNode> nodes;
  for (const auto& row : rowsOf(*points)) {
    const glm::dvec3 color(row[1], row[2], row[3]);
    if (color != glm::clamp(color, 0.0, 1.0)) points->fail("colours must be from 0 to 1");
    nodes.push_back({row[0], color});
  }
  ColorMap map{straightened(nodes, space), {}};
  const auto opacities = preset.find("Points");
  if (!opacities) return map;
  for (const auto& row : rowsOf(*opacities)) {
    if (!(row[1] >= 0.0 && row[1] <= 1.0)) opacities->fail("opacities must be from 0 to 1");
    if (row[2] != 0.5 || row[3] != 0.0) opacities->fail("opacities must be linear between nodes");
    map.opacities.push_back({row[0], row[1]});
  }
  return map;
}

/// Moves nodes with ParaView's rounding, so that files equal those of a script bit for bit.
template <typename Node>
void rescale(std::vector<Node>& nodes, double low, double high, const ScalarRange& range) {
  for (Node& node : nodes) {
    const double share = (node.x - low) / (high - low);
    node.x = std::min(range.min + (range.max - range.min) * share, range.max);
  }
  nodes.back().x = range.max;
}

}  // namespace

ColorMap colorMapOf(std::string_view text, const std::string& file, const std::string& name) {
  const JsonValue document = parseJson(text, file, presetLimits);
  std::vector<JsonValue> presets{document};
  if (document.isArray()) presets = document.items();
  if (name.empty()) {
    if (presets.size() != 1)
      document.fail(fmt::format("the file has {} presets; set 'name' to choose one", presets.size()));
    return readPreset(presets.front());
  }
  for (const JsonValue& preset : presets) {
    const auto own = preset.find("Name");
    if (own && own->text() == name) return readPreset(preset);
  }
  document.fail(fmt::format("no preset is named '{}'", name));
}

ColorMap coolToWarm() {
  const std::vector<ColorNode> nodes{{0.0, {0.231373, 0.298039, 0.752941}},
                                     {0.5, {0.865, 0.865, 0.865}},
                                     {1.0, {0.705882, 0.0156863, 0.14902}}};
  return {straightened(nodes, Space::Diverging), {}};
}

ColorMap rescaled(ColorMap map, const ScalarRange& range) {
  const double low = map.colors.front().x;
  const double high = map.colors.back().x;
  rescale(map.colors, low, high, range);
  if (!map.opacities.empty()) rescale(map.opacities, map.opacities.front().x, map.opacities.back().x, range);
  return map;
}

}  // namespace vdi::config
