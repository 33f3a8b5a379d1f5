// The environment variables that pv-vdi reads: one table, with one way to read and check each kind.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace vdi {

struct EnvironmentVariable {
  const char* name;     // VDI_...
  const char* values;   // the valid values, for messages and help
  const char* meaning;  // a phrase, without a full stop
  bool forUsers;        // false: for tests and measurements
};

/// All variables, sorted by name. The user guide lists them, too; `vdi --help` lists those with forUsers.
std::span<const EnvironmentVariable> environmentVariables();

/// The value of a variable in the table; nullopt if it is unset or empty.
std::optional<std::string> environmentText(const char* name);

/// The value as a whole number, `least` or more. `text`, if given, replaces this environment's value, for
/// example by another rank's. Throws Error{InvalidArgument} that names the variable and its valid values.
std::optional<std::uint32_t> environmentCount(const char* name, std::uint32_t least);
std::optional<std::uint32_t> environmentCount(const char* name, std::uint32_t least, std::string_view text);

/// The value as a flag, 0 or 1; false if it is unset.
bool environmentFlag(const char* name);

/// The folder of data that this user's later runs can reuse; it may not exist yet. It is VDI_CACHE, else
/// pv-vdi in the desktop's folder for caches (XDG_CACHE_HOME, or .cache in HOME). Empty if VDI_CACHE is
/// "off", or none of these is set.
std::string cacheFolder();

/// Why VDI_CACHE's folder can't take data, for a warning: runs continue without it. Empty if it can, or the
/// variable names no folder. Creates the folder if necessary.
std::string cacheIssue();

/// Throws Error{InvalidArgument} that names the variable, the invalid `value` and the valid ones.
[[noreturn]] void refuseEnvironment(const char* name, std::string_view value);

}  // namespace vdi
