// Names of the enumerators that users write.
#pragma once

#include <array>
#include <string>

#include "vdi/core/Error.h"

namespace vdi {

template <typename Enum>
struct EnumName {
  Enum value;
  const char* name;
};
template <typename Enum, std::size_t Count = 2>
using EnumNames = std::array<EnumName<Enum>, Count>;

template <typename Enum, std::size_t Count>
const char* nameOf(Enum value, const EnumNames<Enum, Count>& names) {
  for (const EnumName<Enum>& known : names) {
    if (known.value == value) return known.name;
  }
  return "unknown";
}

/// Throws Error{InvalidArgument} that lists the valid names, in their order. `what` is the kind of thing
/// named, such as "algorithm".
template <typename Enum, std::size_t Count>
Enum namedValue(const std::string& name, const char* what, const EnumNames<Enum, Count>& names) {
  std::string list;
  for (std::size_t i = 0; i < Count; ++i) {
    if (name == names[i].name) return names[i].value;
    if (i > 0) list += i + 1 == Count ? " or " : ", ";
    list += names[i].name;
  }
  throw Error(ErrorCode::InvalidArgument, std::string("no ") + what + " '" + name + "'; use " + list);
}

}  // namespace vdi
