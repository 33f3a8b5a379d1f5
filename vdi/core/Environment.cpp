#include "vdi/core/Environment.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cerrno>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <system_error>

#include "vdi/core/Error.h"

namespace vdi {

namespace {

constexpr std::array variables{
    EnvironmentVariable{"VDI_BANDS", "a whole number, at least 1",
                        "The number of bands in which a frame is made", false},
    EnvironmentVariable{"VDI_CACHE", "a folder, or 'off'",
                        "The folder for compiled shaders, instead of ~/.cache/pv-vdi", true},
    EnvironmentVariable{"VDI_CUDA_PATIENCE", "a whole number of seconds, at least 1",
                        "The time that a step waits for the work on a simulation's CUDA stream", true},
    EnvironmentVariable{"VDI_DEVICE", "an index or a part of a name", "The Vulkan device to use", true},
    EnvironmentVariable{"VDI_ISOLATION", "process, restart or none",
                        "Whether the Catalyst adaptor makes frames in processes of their own", true},
    EnvironmentVariable{"VDI_ISOLATION_LAUNCHER", "a command, in which {ranks} and {hosts} are replaced",
                        "The command that starts these processes, instead of mpirun", true},
    EnvironmentVariable{"VDI_ISOLATION_PATIENCE", "a whole number of seconds, at least 0",
                        "The time that a simulation waits for a frame of these processes", true},
    EnvironmentVariable{
        "VDI_LOG", "a file, or two separated by ','",
        "The log of a run with Catalyst scripts: JSON lines in a .jsonl file, text in another", true},
    EnvironmentVariable{"VDI_PLUGIN", "a file",
                        "The plugin that Catalyst scripts load, instead of the installed one", true},
    EnvironmentVariable{"VDI_RANKS_PER_HOST", "a whole number; 0 means the real number",
                        "The number of ranks assumed on each host", false},
    EnvironmentVariable{"VDI_TOKEN", "16 to 256 letters, digits, '-', '.', '_' and '~'",
                        "The secret that viewers of a VDI server need", true},
    EnvironmentVariable{"VDI_TRANSPORT", "shared or mpi",
                        "The way in which ranks of one host exchange bytes: shared memory or messages",
                        false},
    EnvironmentVariable{"VDI_VALIDATION", "0 or 1", "Whether the Vulkan validation layer checks all calls",
                        true},
};

const EnvironmentVariable& entryOf(const char* name) {
  const auto* const found =
      std::find_if(variables.begin(), variables.end(),
                   [&](const EnvironmentVariable& entry) { return std::strcmp(entry.name, name) == 0; });
  assert(found != variables.end());
  return *found;
}

}  // namespace

std::span<const EnvironmentVariable> environmentVariables() {
  return variables;
}

std::optional<std::string> environmentText(const char* name) {
  const char* const value = std::getenv(entryOf(name).name);
  if (value == nullptr || *value == '\0') return std::nullopt;
  return value;
}

std::optional<std::uint32_t> environmentCount(const char* name, std::uint32_t least) {
  return environmentCount(name, least, environmentText(name).value_or(""));
}

std::optional<std::uint32_t> environmentCount(const char* name, std::uint32_t least, std::string_view text) {
  if (text.empty()) return std::nullopt;
  std::uint32_t count = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), count);
  if (error != std::errc() || end != text.data() + text.size() || count < least)
    refuseEnvironment(name, text);
  return count;
}

bool environmentFlag(const char* name) {
  const std::optional<std::string> text = environmentText(name);
  if (!text || *text == "0") return false;
  if (*text != "1") refuseEnvironment(name, *text);
  return true;
}

std::string cacheFolder() {
  if (const std::optional<std::string> given = environmentText("VDI_CACHE"))
    return *given == "off" ? "" : *given;
  const char* const caches = std::getenv("XDG_CACHE_HOME");
  if (caches != nullptr && *caches == '/') return std::string(caches) + "/pv-vdi";
  const char* const home = std::getenv("HOME");
  return home != nullptr && *home == '/' ? std::string(home) + "/.cache/pv-vdi" : "";
}

std::string cacheIssue() {
  const std::string folder = cacheFolder();
  if (folder.empty() || !environmentText("VDI_CACHE")) return "";
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  if (!failed && ::access(folder.c_str(), W_OK | X_OK) != 0) failed.assign(errno, std::generic_category());
  if (!failed) return "";
  return fmt::format("VDI_CACHE is '{}', where compiled shaders can't be kept: {}", folder, failed.message());
}

void refuseEnvironment(const char* name, std::string_view value) {
  throw Error(ErrorCode::InvalidArgument,
              fmt::format("{} is '{}'; it may be {}", name, value, entryOf(name).values));
}

}  // namespace vdi
