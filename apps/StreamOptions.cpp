#include "apps/StreamOptions.h"

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>

#include "vdi/core/Error.h"
#include "vdi/stream/GivenToken.h"
#include "vdi/stream/Url.h"

namespace vdi::apps {

stream::ClientOptions clientOf(const std::string& from, const std::string& tokenFile) {
  stream::ClientOptions options;
  options.log = [](const std::string& line) { fmt::print(stderr, "vdi: {}\n", line); };
  const bool isLink = from.starts_with("http://") || from.starts_with("https://");
  if (!isLink) {
    options.command = from;
    return options;
  }
  options.url = stream::parseUrl(from);
  if (options.url.token.empty()) options.url.token = stream::givenToken(tokenFile);
  if (options.url.token.empty()) {
    throw Error(ErrorCode::InvalidArgument, "the link has no token; use --token-file",
                options.url.authority());
  }
  return options;
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

}  // namespace vdi::apps
