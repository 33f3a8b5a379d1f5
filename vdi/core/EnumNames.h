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
template <typename Enum>
using EnumNames = std::array<EnumName<Enum>, 2>;

template <typename Enum>
const char* nameOf(Enum value, const EnumNames<Enum>& names) {
  for (const EnumName<Enum>& known : names) {
    if (known.value == value) return known.name;
  }
  return "unknown";
}

/// Throws Error{InvalidArgument} that lists the valid names, in their order. `what` is the kind of thing
/// named, such as "algorithm".
template <typename Enum>
Enum namedValue(const std::string& name, const char* what, const EnumNames<Enum>& names) {
  for (const EnumName<Enum>& known : names) {
    if (name == known.name) return known.value;
  }
  throw Error(ErrorCode::InvalidArgument, std::string("no ") + what + " '" + name + "'; there are " +
                                              names[0].name + " and " + names[1].name);
}

}  // namespace vdi
