#include "vdi/pipeline/Fingerprint.h"

#include <xxhash.h>

#include <array>
#include <cstddef>
#include <cstring>
#include <type_traits>
#include <vector>

#include "vdi/core/Camera.h"
#include "vdi/core/GenerateSettings.h"
#include "vdi/core/TransferFunction.h"

namespace vdi::detail {

namespace {

/// Of the bytes of plain values, in the order that they're added in.
class Fingerprint {
 public:
  template <typename T>
  void add(const T& value) {
    static_assert(std::is_arithmetic_v<T> || std::is_enum_v<T>);
    std::array<std::byte, sizeof(T)> own{};
    std::memcpy(own.data(), &value, sizeof(T));
    for (const std::byte byte : own) bytes_.push_back(byte);
  }
  void add(const glm::dvec3& v) {
    for (int axis = 0; axis < 3; ++axis) add(v[axis]);
  }
  std::uint64_t value() const { return XXH3_64bits(bytes_.data(), bytes_.size()); }

 private:
  std::vector<std::byte> bytes_;
};

}  // namespace

std::uint64_t fingerprintOf(const Camera& camera) {
  Fingerprint print;
  print.add(camera.position);
  print.add(camera.focalPoint);
  print.add(camera.viewUp);
  print.add(camera.viewAngle);
  print.add(camera.parallelProjection);
  print.add(camera.parallelScale);
  return print.value();
}

std::uint64_t fingerprintOf(const TransferFunction& function) {
  Fingerprint print;
  print.add(function.colors.size());
  for (const ColorNode& node : function.colors) {
    print.add(node.x);
    print.add(node.color);
  }
  print.add(function.opacities.size());
  for (const OpacityNode& node : function.opacities) {
    print.add(node.x);
    print.add(node.opacity);
  }
  print.add(function.unitDistance);
  return print.value();
}

std::uint64_t fingerprintOf(const GenerateSettings& settings) {
  Fingerprint print;
  print.add(settings.width);
  print.add(settings.height);
  print.add(settings.margin);
  print.add(settings.supersegments);
  print.add(settings.budget);
  print.add(settings.fill);
  print.add(settings.samplesPerVoxel);
  print.add(settings.algorithm);
  print.add(settings.precision);
  print.add(settings.terminationOpacity);
  return print.value();
}

}  // namespace vdi::detail
