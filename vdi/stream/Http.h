// Answers plain HTTP requests, and decides which requests may open the stream. Uses no sockets.
#pragma once

#include <boost/beast/core/error.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/string_body.hpp>
#include <functional>
#include <string>
#include <vector>

#include "vdi/stream/Token.h"

namespace vdi::stream {

using HttpRequest = boost::beast::http::request<boost::beast::http::empty_body>;
using HttpReply = boost::beast::http::response<boost::beast::http::string_body>;

class Site {
 public:
  /// `page` is served at /. `status` returns the JSON for /status.
  Site(std::string page, const std::string& token, std::vector<std::string> origins,
       std::function<std::string()> status);

  HttpReply reply(const HttpRequest& request) const;
  /// Whether a request may open a WebSocket at /stream. If not, sets `cause` to the reason.
  bool admits(const HttpRequest& request, std::string& cause) const;
  /// The reply to a request that isn't admitted.
  static HttpReply refusal(const HttpRequest& request, const std::string& cause);
  /// The reply to what isn't a request, or one with too large a head. `error`: the parser's.
  static HttpReply fault(boost::beast::error_code error);

 private:
  std::string page_;
  std::string policy_;  // Content-Security-Policy of the page
  TokenCheck token_;
  std::vector<std::string> origins_;
  std::function<std::string()> status_;
};

/// The sources of the page's scripts, for script-src: 'sha256-…' of each element's text.
std::string scriptSources(const std::string& page);

}  // namespace vdi::stream
