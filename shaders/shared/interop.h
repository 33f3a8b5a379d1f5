// Lets one header describe constants and structs to C++ and GLSL. GLSL's scalar layout
// (GL_EXT_scalar_block_layout) equals that of C++ for structs of 4-byte members, and of 8-byte members at
// multiples of 8.
#ifndef VDI_SHARED_INTEROP_H
#define VDI_SHARED_INTEROP_H

#ifdef __cplusplus
#include <cstdint>
#include <glm/glm.hpp>
namespace vdi::shared {
using uint = std::uint32_t;
using uint64_t = std::uint64_t;
using vec2 = glm::vec2;
using vec3 = glm::vec3;
using vec4 = glm::vec4;
using uvec3 = glm::uvec3;
using uvec4 = glm::uvec4;
using ivec2 = glm::ivec2;
#define VDI_SHARED_BEGIN namespace vdi::shared {
#define VDI_SHARED_END }
#define VDI_CONST inline constexpr
#define VDI_ADDRESS(type) std::uint64_t
}
namespace vdi::gpu {
namespace shared = vdi::shared;
}
#else
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference2 : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#define VDI_SHARED_BEGIN
#define VDI_SHARED_END
#define VDI_CONST const
#define VDI_ADDRESS(type) type
#endif

#endif
