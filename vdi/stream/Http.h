// Answers plain HTTP requests, and decides which requests may open the stream. Uses no sockets.
#pragma once

#include <boost/beast/core/error.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/string_body.hpp>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "vdi/stream/Token.h"

namespace vdi::stream {

using HttpRequest = boost::beast::http::request<boost::beast::http::empty_body>;
using HttpReply = boost::beast::http::response<boost::beast::http::string_body>;

struct SiteOptions {
  std::string page;                     // served at /
  std::string token;                    // for /status
  std::vector<std::string> origins;     // of other pages that may connect; isOrigin holds
  std::string originOption;             // how a user allows an origin, with {} in its place: "--origin {}"
  std::vector<std::string> embedders;   // origins of pages that may show this one in a frame
  std::function<std::string()> status;  // returns the JSON for /status
  std::function<void(const std::string& line)> log;  // gets lines for the operator; may be empty
};

class Site {
 public:
  explicit Site(SiteOptions options);

  /// The answer to a request that opens no WebSocket. A page whose WebSocket failed asks for
  /// /stream?origin=ORIGIN, because browsers hide the reason: 403 refuses that origin, and 426 admits it.
  HttpReply reply(const HttpRequest& request);
  /// Whether a request may open a WebSocket at /stream. If not, sets `cause` to the reason. The operator gets
  /// one line for each refused origin.
  bool admits(const HttpRequest& request, std::string& cause);
  /// The reply to a request that isn't admitted.
  static HttpReply refusal(const HttpRequest& request, const std::string& cause);
  /// The reply to what isn't a request, or one with too large a head. `error`: the parser's.
  static HttpReply fault(boost::beast::error_code error);

 private:
  bool admitsOrigin(std::string_view origin, std::string_view host) const;
  /// The reason for the refusal of an origin, in one line.
  std::string refusalOf(std::string_view origin) const;
  /// Logs a line unless it has been logged before. Peers can't make the list of known lines long.
  void sayOnce(const std::string& line);

  SiteOptions options_;
  std::string policy_;  // Content-Security-Policy of the page
  TokenCheck token_;
  std::vector<std::string> said_;
};

/// The path of a request's target, and the value of a field of its query, decoded; empty: it has none.
std::string_view pathOf(std::string_view target);
std::string queryField(std::string_view target, std::string_view name);

/// The sources of the page's scripts, for script-src: 'sha256-…' of each element's text.
std::string scriptSources(const std::string& page);

}  // namespace vdi::stream
