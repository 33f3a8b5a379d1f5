#pragma once
// std::bit_cast, also for libstdc++ before GCC 11, as in ParaView's SDK images (gcc-toolset-10).

#include <version>

#ifdef __cpp_lib_bit_cast
#include <bit>
#else
#include <cstring>
#include <type_traits>
#endif

namespace vdi {

#ifdef __cpp_lib_bit_cast
using std::bit_cast;
#else
/// The value of type To that has the bits of `from`.
template <class To, class From>
requires(sizeof(To) == sizeof(From) && std::is_trivially_copyable_v<To> &&
         std::is_trivially_copyable_v<From>) To bit_cast(const From& from)
noexcept {  // NOLINT(readability-identifier-naming): the standard's name
  To to;
  std::memcpy(&to, &from, sizeof(To));
  return to;
}
#endif

}  // namespace vdi
