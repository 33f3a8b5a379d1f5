#include "vdi/pipeline/Fingerprint.h"

#include <xxhash.h>

#include <array>
#include <optional>
#include <span>
#include <type_traits>
#include <vector>

#include "vdi/core/Camera.h"
#include "vdi/core/GenerateSettings.h"
#include "vdi/core/SettingsTable.h"
#include "vdi/core/TransferFunction.h"

namespace vdi::detail {

namespace {

/// Hashes the bytes of plain values; -0 equals 0.
template <typename T>
std::uint64_t hashOf(std::span<const T> values) {
  static_assert(std::is_arithmetic_v<T> || std::is_enum_v<T>);
  if constexpr (std::is_floating_point_v<T>) {
    std::vector<T> positive(values.begin(), values.end());
    for (T& value : positive) value += T{0};
    return XXH3_64bits(positive.data(), values.size_bytes());
  } else {
    return XXH3_64bits(values.data(), values.size_bytes());
  }
}

template <typename T>
std::uint64_t hashOf(const T& value) {
  return hashOf(std::span<const T>(&value, 1));
}

std::uint64_t hashOf(const glm::dvec3& v) {
  return hashOf(std::span<const double>(&v.x, 3));
}

std::uint64_t hashOf(const std::vector<ColorNode>& nodes) {
  std::vector<double> values;
  for (const ColorNode& node : nodes)
    values.insert(values.end(), {node.x, node.color.x, node.color.y, node.color.z});
  return hashOf(std::span<const double>(values));
}

std::uint64_t hashOf(const std::vector<Light>& lights) {
  std::vector<double> values;
  for (const Light& light : lights) {
    values.insert(values.end(), {light.direction.x, light.direction.y, light.direction.z, light.color.x,
                                 light.color.y, light.color.z});
  }
  return hashOf(std::span<const double>(values));
}

std::uint64_t hashOf(const std::optional<Box>& box) {
  if (!box) return 0;
  const std::array values{box->lo.x, box->lo.y, box->lo.z, box->hi.x, box->hi.y, box->hi.z};
  return hashOf(std::span<const double>(values));
}

std::uint64_t hashOf(const std::vector<ClipPlane>& planes) {
  std::vector<double> values;
  for (const ClipPlane& plane : planes) {
    values.insert(values.end(), {plane.origin.x, plane.origin.y, plane.origin.z, plane.normal.x,
                                 plane.normal.y, plane.normal.z});
  }
  return hashOf(std::span<const double>(values));
}

std::uint64_t hashOf(const std::vector<OpacityNode>& nodes) {
  std::vector<double> values;
  for (const OpacityNode& node : nodes) values.insert(values.end(), {node.x, node.opacity});
  return hashOf(std::span<const double>(values));
}

}  // namespace

std::vector<comm::Communicator::Fingerprint> fingerprintsOf(const Camera& camera,
                                                            const TransferFunction& function,
                                                            const GenerateSettings& settings) {
  std::vector<comm::Communicator::Fingerprint> fingerprints{
      {hashOf(camera.position), "camera position"},
      {hashOf(camera.focalPoint), "camera focal point"},
      {hashOf(camera.viewUp), "camera view-up"},
      {hashOf(camera.viewAngle), "camera view angle"},
      {hashOf(camera.parallelProjection), "camera parallel projection"},
      {hashOf(camera.parallelScale), "camera parallel scale"},
      {hashOf(function.colors), "transfer function's colours"},
      {hashOf(function.opacities), "transfer function's opacities"},
      {hashOf(function.unitDistance), "scalar opacity unit distance"},
      {hashOf(settings.width), "width"},
      {hashOf(settings.height), "height"},
      {hashOf(settings.shading.lights), "lights"},
      {hashOf(settings.region.box), "cropping box"},
      {hashOf(settings.region.planes), "clipping planes"},
      {hashOf(settings.blending.mode), "blend mode"},
      {hashOf(std::span<const double>(settings.blending.isovalues)), "isovalues"}};
  for (const Setting& setting : settingsTable())
    fingerprints.push_back({hashOf(setting.get(settings)), setting.name});
  return fingerprints;
}

}  // namespace vdi::detail
