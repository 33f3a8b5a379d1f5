#include "vdi/synthetic/Fields.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "vdi/core/Error.h"

namespace vdi::synthetic {

namespace {

constexpr double pi = std::numbers::pi;

/// Uniform in [0, 1) for a lattice point.
double random(const glm::ivec3& at, std::uint32_t seed) {
  std::uint32_t h = seed * 0x9E3779B1U;
  for (int axis = 0; axis < 3; ++axis) {
    h ^= static_cast<std::uint32_t>(at[axis]) + 0x7F4A7C15U + (h << 6) + (h >> 2);
    h *= 0x85EBCA6BU;
    h ^= h >> 13;
  }
  h *= 0xC2B2AE35U;
  h ^= h >> 16;
  return h / 4294967296.0;
}

/// Value noise, smooth in the first derivative.
double noise(const glm::dvec3& p, std::uint32_t seed) {
  const glm::dvec3 base = glm::floor(p);
  const glm::dvec3 f = p - base;
  const glm::dvec3 s = f * f * (3.0 - 2.0 * f);
  double sum = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const glm::ivec3 step{corner & 1, (corner >> 1) & 1, (corner >> 2) & 1};
    const glm::dvec3 weight = glm::mix(1.0 - s, s, glm::dvec3(step));
    sum += weight.x * weight.y * weight.z * random(glm::ivec3(base) + step, seed);
  }
  return sum;
}

double octaves(const glm::dvec3& p, int count, std::uint32_t seed) {
  double sum = 0.0;
  double amplitude = 0.5;
  double frequency = 1.0;
  for (int i = 0; i < count; ++i) {
    sum += amplitude * noise(p * frequency, seed + static_cast<std::uint32_t>(i));
    amplitude *= 0.5;
    frequency *= 2.03;
  }
  return std::clamp(sum / (1.0 - std::pow(0.5, count)), 0.0, 1.0);
}

double sphere(const glm::dvec3& p) {
  return std::clamp(1.0 - 2.0 * glm::length(p - 0.5), 0.0, 1.0);
}

double shells(const glm::dvec3& p) {
  const double r = glm::length(p - 0.5);
  return r > 0.5 ? 0.0 : 0.5 + 0.5 * std::cos(r * 12.0 * pi);
}

/// Marschner and Lobb 1994, f_M = 6, alpha = 0.25.
double marschnerLobb(const glm::dvec3& p) {
  const glm::dvec3 q = 2.0 * p - 1.0;
  const double rho = std::cos(2.0 * pi * 6.0 * std::cos(pi * std::hypot(q.x, q.y) / 2.0));
  return (1.0 - std::sin(pi * q.z / 2.0) + 0.25 * (1.0 + rho)) / (2.0 * 1.25);
}

/// Two fluids and their turbulent mixing layer.
double mixing(const glm::dvec3& p, std::uint32_t seed) {
  const double front = 0.5 + 0.35 * (octaves(p * glm::dvec3(5.0, 5.0, 3.0), 5, seed) - 0.5);
  const double layer = (p.z - front) / 0.12;
  return std::clamp(0.5 + 0.5 * std::tanh(layer) +
                        0.15 * (octaves(p * 24.0, 3, seed + 77) - 0.5) * std::exp(-layer * layer),
                    0.0, 1.0);
}

/// Two fluids torn into each other everywhere: mostly pure, with an intricate interface.
double interface(const glm::dvec3& p, std::uint32_t seed) {
  const double mixed = octaves(p * 9.0, 6, seed) - 0.5;
  return std::clamp(0.5 + 0.5 * std::tanh(18.0 * mixed), 0.0, 1.0);
}

/// A coiled tube of ribs in empty space: thin, opaque, sparse.
double coil(const glm::dvec3& p) {
  const glm::dvec3 q = p - 0.5;
  const double angle = std::atan2(q.y, q.x);
  const double r = std::hypot(q.x, q.y);
  double best = 0.0;
  for (int turn = -1; turn < 3; ++turn) {
    const double along = (angle / (2.0 * pi) + turn) / 3.0;
    const double spineR = 0.15 + 0.25 * (along + 0.33);
    const double spineZ = 0.3 * std::sin(6.0 * along);
    const double d = std::hypot(r - spineR, q.z - spineZ);
    const double wall = std::exp(-std::pow((d - 0.05) / 0.008, 2.0));
    const double ribs = 0.5 + 0.5 * std::cos(along * 2.0 * pi * 60.0);
    best = std::max({best, wall * ribs, std::exp(-std::pow(d / 0.012, 2.0))});
  }
  return std::clamp(best, 0.0, 1.0);
}

}  // namespace

const std::vector<FieldInfo>& fields() {
  static const std::vector<FieldInfo> infos{
      {"sphere", "1 at the centre, falling linearly to 0 at the faces"},
      {"shells", "concentric smooth shells"},
      {"marschner-lobb", "the test signal of Marschner and Lobb, 1994"},
      {"turbulence", "five octaves of smooth noise; takes a seed"},
      {"mixing", "two fluids with a turbulent layer between; takes a seed"},
      {"interface", "two fluids torn into each other, with an intricate interface everywhere; takes a seed"},
      {"coil", "a thin, ribbed, opaque coil in emptiness"},
      {"ramp", "x + y + z, linear: what interpolation must reproduce"},
  };
  return infos;
}

namespace {

Error noField(const std::string& name) {
  std::string names;
  for (const FieldInfo& info : fields()) names += (names.empty() ? "" : ", ") + info.name;
  return {ErrorCode::InvalidArgument, "no field '" + name + "'; use one of " + names};
}

}  // namespace

std::size_t fieldIndex(const std::string& name) {
  const auto known = std::find_if(fields().begin(), fields().end(),
                                  [&](const FieldInfo& info) { return info.name == name; });
  if (known == fields().end()) throw noField(name);
  return static_cast<std::size_t>(known - fields().begin());
}

Field makeField(const std::string& name, std::uint32_t seed) {
  if (name == "sphere") return sphere;
  if (name == "shells") return shells;
  if (name == "marschner-lobb") return marschnerLobb;
  if (name == "turbulence") return [seed](const glm::dvec3& p) { return octaves(p * 6.0, 5, seed); };
  if (name == "mixing") return [seed](const glm::dvec3& p) { return mixing(p, seed); };
  if (name == "interface") return [seed](const glm::dvec3& p) { return interface(p, seed); };
  if (name == "coil") return coil;
  if (name == "ramp") return [](const glm::dvec3& p) { return (p.x + p.y + p.z) / 3.0; };
  throw noField(name);
}

}  // namespace vdi::synthetic
