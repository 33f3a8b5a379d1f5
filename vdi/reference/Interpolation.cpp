#include "vdi/reference/Interpolation.h"

#include <algorithm>

namespace vdi::reference {

double interpolate(const Block& block, const glm::dvec3& world, Interpolation interpolation) {
  const IndexBox all = block.extended();
  const glm::dvec3 position =
      glm::clamp((world - block.origin) / block.spacing, glm::dvec3(all.lo), glm::dvec3(all.hi - 1));
  if (interpolation == Interpolation::Nearest) {
    const glm::ivec3 at(glm::floor(position + 0.5));
    return valueAt(block, at.x, at.y, at.z);
  }
  const glm::ivec3 base = glm::min(glm::ivec3(glm::floor(position)), glm::max(all.hi - 2, all.lo));
  const glm::dvec3 share = position - glm::dvec3(base);
  // Represents infinite values by finite ones beyond all others: interpolating between opposite signs gives
  // no NaN.
  constexpr double infinite = 1e305;
  double sum = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const glm::ivec3 step{corner & 1, (corner >> 1) & 1, (corner >> 2) & 1};
    const glm::dvec3 weight = glm::mix(1.0 - share, share, glm::dvec3(step));
    const double product = weight.x * weight.y * weight.z;
    const glm::ivec3 at = glm::min(base + step, all.hi - 1);
    if (product > 0.0) sum += product * std::clamp(valueAt(block, at.x, at.y, at.z), -infinite, infinite);
  }
  return sum;
}

}  // namespace vdi::reference
