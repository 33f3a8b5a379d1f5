// Half floats, four at a time, in the layout of an R16G16B16A16_SFLOAT texel.
#pragma once

#include <glm/glm.hpp>
#include <glm/gtc/packing.hpp>

namespace vdi {

/// Rounds; requires |v| <= 65504.
inline glm::u16vec4 toHalf(const glm::vec4& v) {
  return {glm::packHalf1x16(v.x), glm::packHalf1x16(v.y), glm::packHalf1x16(v.z), glm::packHalf1x16(v.w)};
}

inline glm::vec4 fromHalf(const glm::u16vec4& v) {
  return {glm::unpackHalf1x16(v.x), glm::unpackHalf1x16(v.y), glm::unpackHalf1x16(v.z),
          glm::unpackHalf1x16(v.w)};
}

}  // namespace vdi
