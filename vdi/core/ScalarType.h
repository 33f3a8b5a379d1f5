// The types of scalars that a block may hold. There are no 64-bit integers among them: these come in only
// through vdi_catalyst.h, its Fortran and Python twins, and ParaView's data sets.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <type_traits>

namespace vdi {

/// The enumerators index tables.
enum class ScalarType : std::uint32_t {
  U8 = 0,
  I8 = 1,
  U16 = 2,
  I16 = 3,
  U32 = 4,
  I32 = 5,
  F32 = 6,
  F64 = 7
};

std::size_t sizeOf(ScalarType type);
const char* toString(ScalarType type);  // "u8" ... "f64"
/// Throws Error{InvalidArgument} for a name that toString does not produce.
ScalarType scalarTypeFromString(const std::string& name);

/// Calls `function` with the data as a pointer to its own type.
template <typename Void, typename Function>
auto withTyped(ScalarType type, Void* data, Function function) {
  const auto as = [&](auto zero) {
    using T = std::conditional_t<std::is_const_v<Void>, const decltype(zero), decltype(zero)>;
    return function(static_cast<T*>(data));
  };
  switch (type) {
    case ScalarType::U8:
      return as(std::uint8_t{});
    case ScalarType::I8:
      return as(std::int8_t{});
    case ScalarType::U16:
      return as(std::uint16_t{});
    case ScalarType::I16:
      return as(std::int16_t{});
    case ScalarType::U32:
      return as(std::uint32_t{});
    case ScalarType::I32:
      return as(std::int32_t{});
    case ScalarType::F32:
      return as(float{});
    case ScalarType::F64:
      break;
  }
  return as(double{});
}

}  // namespace vdi
