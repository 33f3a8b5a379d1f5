// The environment variables that pv-vdi reads: one table, and one way to read and check each kind.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace vdi {

struct EnvironmentVariable {
  const char* name;     // VDI_...
  const char* values;   // what it may be, for messages and help
  const char* meaning;  // one sentence, without a full stop
  bool forUsers;        // false: for tests and measurements
};

/// All of them, by name. The user guide lists those that are for users.
std::span<const EnvironmentVariable> environmentVariables();

/// The value of a variable of the table; nullopt if it is unset or empty.
std::optional<std::string> environmentText(const char* name);

/// The same for whole numbers from `least` on. `text`, where it is given, is read instead: another rank's.
/// Throws Error{InvalidArgument} that names the variable and what it may be.
std::optional<std::uint32_t> environmentCount(const char* name, std::uint32_t least);
std::optional<std::uint32_t> environmentCount(const char* name, std::uint32_t least, std::string_view text);

/// The same for 0 and 1; false if it is unset.
bool environmentFlag(const char* name);

/// Throws the Error{InvalidArgument} of a value that a variable may not have.
[[noreturn]] void refuseEnvironment(const char* name, std::string_view value);

}  // namespace vdi
