// Links to servers of VDIs, and origins of pages.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace vdi::stream {

struct Url {
  bool isEncrypted = false;
  std::string host;  // an IPv6 address without its brackets
  std::uint16_t port = 0;
  std::string folder = "/";  // the page's path up to its last "/": behind a proxy, the server's prefix
  std::string query;         // with its "?"; empty: none
  std::string token;         // empty: the link has none

  /// Host and port, as in an HTTP request's Host field and in messages.
  std::string authority() const;
  /// Path and query of the stream, which is beside the page.
  std::string streamTarget() const;
};

/// "http://HOST:PORT/PATH/#token=TOKEN", or https. The port defaults to 80 or 443, the path to "/". A path
/// names the folder of the page, with or without its last "/". Throws Error{InvalidArgument} with a message
/// that omits the link's query and fragment.
Url parseUrl(std::string_view text);

/// The value of the first field of that name in "name=value&name=value", not decoded; empty: it has none.
std::string_view fieldOf(std::string_view fields, std::string_view name);

/// Whether the text is an origin as browsers send it: "https://example.org" or "http://127.0.0.1:8080", in
/// lower case, without a path and without the usual port.
bool isOrigin(std::string_view text);
inline constexpr const char* notAnOrigin =
    "not an origin, such as https://example.org or http://example.org:8080: lower case, without a path and "
    "without the usual port";

}  // namespace vdi::stream
