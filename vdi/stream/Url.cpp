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

constexpr std::string_view plainScheme = "http://";
constexpr std::string_view encryptedScheme = "https://";

/// Whether a request may have the text in its first line.
bool isTarget(std::string_view text) {
  constexpr char firstVisible = '!';
  constexpr char lastVisible = '~';
  return std::ranges::all_of(text, [](char c) { return c >= firstVisible && c <= lastVisible; });
}

}  // namespace

std::string Url::authority() const {
  const bool isV6 = host.find(':') != std::string::npos;
  return isV6 ? fmt::format("[{}]:{}", host, port) : fmt::format("{}:{}", host, port);
}

std::string Url::streamTarget() const {
  return folder + "stream" + query;
}

Url parseUrl(std::string_view text) {
  const std::size_t hash = std::min(text.find('#'), text.size());
  const std::size_t question = std::min(text.find('?'), hash);
  const std::string_view address = text.substr(0, question);
  Url url;
  url.isEncrypted = address.starts_with(encryptedScheme);
  const bool isKnown = url.isEncrypted || address.starts_with(plainScheme);
  const std::string_view rest =
      isKnown ? address.substr((url.isEncrypted ? encryptedScheme : plainScheme).size()) : std::string_view();
  const std::size_t slash = std::min(rest.find('/'), rest.size());
  url.query = text.substr(question, hash - question);
  if (!isKnown || !split(rest.substr(0, slash), url) || !isTarget(rest.substr(slash)) ||
      !isTarget(url.query)) {
    throw Error(ErrorCode::InvalidArgument, "a link must have the form http(s)://HOST:PORT/PATH/#token=TOKEN",
                std::string(address));
  }
  url.folder = rest.substr(slash);
  if (!url.folder.ends_with('/')) url.folder += '/';
  url.token = fieldOf(text.substr(hash).substr(hash < text.size() ? 1 : 0), "token");
  return url;
}

std::string_view fieldOf(std::string_view fields, std::string_view name) {
  while (!fields.empty()) {
    const std::string_view part = fields.substr(0, fields.find('&'));
    fields.remove_prefix(std::min(part.size() + 1, fields.size()));
    if (part.starts_with(name) && part.substr(name.size()).starts_with('='))
      return part.substr(name.size() + 1);
  }
  return {};
}

bool isOrigin(std::string_view text) {
  constexpr std::size_t longest = 300;
  const bool isEncrypted = text.starts_with(encryptedScheme);
  if (text.size() > longest || !(isEncrypted || text.starts_with(plainScheme))) return false;
  const std::string_view authority = text.substr((isEncrypted ? encryptedScheme : plainScheme).size());
  Url url;
  url.isEncrypted = isEncrypted;
  constexpr std::string_view ofNames = "abcdefghijklmnopqrstuvwxyz0123456789._-";
  constexpr std::string_view ofV6 = "abcdef0123456789:.";
  if (!split(authority, url)) return false;
  if (url.host.find_first_not_of(authority.starts_with('[') ? ofV6 : ofNames) != std::string::npos)
    return false;
  // Browsers leave out the usual port, and write others without leading zeros.
  const std::string host = authority.starts_with('[') ? "[" + url.host + "]" : url.host;
  const bool hasPort = url.port != (isEncrypted ? httpsPort : httpPort);
  return authority == (hasPort ? host + ":" + std::to_string(url.port) : host);
}

}  // namespace vdi::stream
