// Links to servers of VDIs.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace vdi::stream {

struct Url {
  bool isEncrypted = false;
  std::string host;  // an IPv6 address without its brackets
  std::uint16_t port = 0;
  std::string token;  // empty: the link has none

  /// Host and port, as in an HTTP request's Host field and in messages.
  std::string authority() const;
};

/// "http://HOST:PORT/#token=TOKEN", or https. The port defaults to 80 or 443. Throws
/// Error{InvalidArgument} with a message that omits the link's fragment.
Url parseUrl(std::string_view text);

}  // namespace vdi::stream
