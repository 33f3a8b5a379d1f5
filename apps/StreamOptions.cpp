#include "apps/StreamOptions.h"
#include "apps/Say.h"

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string_view>

#include "vdi/core/Error.h"
#include "vdi/stream/GivenToken.h"
#include "vdi/stream/Url.h"

namespace vdi::apps {

std::string tokenOf(const std::string& file) {
  constexpr mode_t others = S_IRGRP | S_IROTH;
  std::string token = stream::givenToken(file);
  struct stat status {};
  if (!file.empty() && ::stat(file.c_str(), &status) == 0 && (status.st_mode & others) != 0) {
    say(fmt::format("warning: other users can read the token in {}; chmod 600 keeps it secret", file));
  }
  return token;
}

stream::ClientOptions clientOf(const std::string& from, const std::string& tokenFile) {
  stream::ClientOptions options;
  options.log = say;
  const bool isLink = from.starts_with("http://") || from.starts_with("https://");
  if (!isLink) {
    options.command = from;
    return options;
  }
  options.url = stream::parseUrl(from);
  if (options.url.token.empty()) options.url.token = tokenOf(tokenFile);
  if (options.url.token.empty()) {
    throw Error(ErrorCode::InvalidArgument, "the link has no token; use --token-file",
                options.url.authority());
  }
  return options;
}

void hideTokens(std::span<char* const> arguments) {
  constexpr std::string_view name = "token=";
  for (char* const argument : arguments) {
    const std::string_view text(argument);
    const std::size_t more =
        std::min(text.find_first_of("?#"), text.size());  // a proxy may have a token, too
    for (std::size_t at = text.find(name, more); at != std::string_view::npos; at = text.find(name, at)) {
      at += name.size();
      const std::size_t end = std::min(text.find_first_of("& '\"", at), text.size());
      std::fill(argument + at, argument + end, 'x');
    }
  }
}

void addTokenOption(CLI::App& command, std::string& file, const std::string& otherwise) {
  command
      .add_option("--token-file", file,
                  "file whose first line is the token, which may also be in VDI_TOKEN; " + otherwise)
      ->type_name("FILE");
}

double bytesPerSecond(const std::string& rate) {
  constexpr double bits = 1.0 / 8.0;
  const std::map<std::string, double> units{{"kbit", 1e3 * bits}, {"Mbit", 1e6 * bits}, {"Gbit", 1e9 * bits},
                                            {"kB", 1e3},          {"MB", 1e6},          {"GB", 1e9}};
  if (rate.empty()) return 0.0;
  char* end = nullptr;
  const double number = std::strtod(rate.c_str(), &end);
  const auto unit = units.find(end);
  if (end == rate.c_str() || unit == units.end() || !std::isfinite(number) || number <= 0.0) {
    throw Error(ErrorCode::InvalidArgument,
                "a rate is a number > 0 followed by kbit, Mbit, Gbit, kB, MB or GB", rate);
  }
  return number * unit->second;
}

std::string requireRate(const std::string& text) {
  try {
    (void)bytesPerSecond(text);
    return "";
  } catch (const Error& error) {
    return error.what();
  }
}

std::string requireOrigin(const std::string& text) {
  if (stream::isOrigin(text)) return "";
  return fmt::format("'{}' is {}", text, stream::notAnOrigin);
}

}  // namespace vdi::apps
