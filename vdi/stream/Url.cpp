#include "vdi/stream/Url.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <string>

#include "vdi/core/Error.h"

namespace vdi::stream {

namespace {

constexpr std::uint16_t httpPort = 80;
constexpr std::uint16_t httpsPort = 443;

/// Splits an authority into host and port. Returns false if it is malformed.
bool split(std::string_view authority, Url& url) {
  std::string_view port;
  if (authority.starts_with('[')) {
    const std::size_t end = authority.find(']');
    if (end == std::string_view::npos) return false;
    url.host = authority.substr(1, end - 1);
    port = authority.substr(end + 1);
  } else {
    const std::size_t end = std::min(authority.find(':'), authority.size());
    url.host = authority.substr(0, end);
    port = authority.substr(end);
  }
  if (url.host.empty()) return false;
  if (port.empty()) {
    url.port = url.isEncrypted ? httpsPort : httpPort;
    return true;
  }
  const auto [after, error] = std::from_chars(port.data() + 1, port.data() + port.size(), url.port);
  return port.front() == ':' && error == std::errc() && after == port.data() + port.size() && url.port != 0;
}

std::string tokenOf(std::string_view fragment) {
  constexpr std::string_view name = "token=";
  while (!fragment.empty()) {
    const std::size_t end = std::min(fragment.find('&'), fragment.size());
    if (fragment.starts_with(name)) return std::string(fragment.substr(name.size(), end - name.size()));
    fragment.remove_prefix(std::min(end + 1, fragment.size()));
  }
  return {};
}

}  // namespace

std::string Url::authority() const {
  const bool isV6 = host.find(':') != std::string::npos;
  return isV6 ? fmt::format("[{}]:{}", host, port) : fmt::format("{}:{}", host, port);
}

Url parseUrl(std::string_view text) {
  const std::size_t hash = std::min(text.find('#'), text.size());
  const std::string_view address = text.substr(0, hash);
  Url url;
  constexpr std::string_view plainScheme = "http://";
  constexpr std::string_view encryptedScheme = "https://";
  url.isEncrypted = address.starts_with(encryptedScheme);
  const bool isKnown = url.isEncrypted || address.starts_with(plainScheme);
  const std::string_view rest =
      isKnown ? address.substr((url.isEncrypted ? encryptedScheme : plainScheme).size()) : std::string_view();
  const std::size_t slash = std::min(rest.find('/'), rest.size());
  const bool hasPath = rest.size() > slash + 1;
  if (!isKnown || hasPath || !split(rest.substr(0, slash), url)) {
    throw Error(ErrorCode::InvalidArgument, "a link must have the form http(s)://HOST:PORT/#token=TOKEN",
                std::string(address));
  }
  url.token = tokenOf(text.substr(hash).substr(hash < text.size() ? 1 : 0));
  return url;
}

}  // namespace vdi::stream
