#include "vdi/stream/Http.h"

#include <fmt/format.h>
#include <fmt/ranges.h>  // fmt::join
#include <openssl/evp.h>
#include <openssl/sha.h>

#include <algorithm>
#include <array>
#include <boost/beast/core/string.hpp>
#include <boost/beast/http/error.hpp>
#include <boost/beast/http/field.hpp>
#include <boost/beast/http/rfc7230.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <charconv>
#include <string_view>
#include <utility>

#include "vdi/stream/Protocol.h"
#include "vdi/stream/Url.h"

namespace vdi::stream {

namespace {

namespace http = boost::beast::http;

template <typename View>
std::string_view plain(const View& view) {
  return {view.data(), view.size()};
}

std::string_view field(const HttpRequest& request, http::field name) {
  const auto found = request.find(name);
  return found == request.end() ? std::string_view() : plain(found->value());
}

/// The credentials with their scheme, whose case doesn't matter, spelled as `scheme`. A blank ends `scheme`;
/// the credentials may have several.
std::string spelledAs(std::string_view scheme, std::string_view credentials) {
  const auto found = credentials.substr(0, scheme.size());
  if (!boost::beast::iequals({found.data(), found.size()}, {scheme.data(), scheme.size()}))
    return std::string(credentials);
  credentials.remove_prefix(scheme.size());
  credentials.remove_prefix(std::min(credentials.find_first_not_of(' '), credentials.size()));
  return std::string(scheme).append(credentials);
}

std::string sha256InBase64(std::string_view text) {
  std::array<unsigned char, SHA256_DIGEST_LENGTH> digest{};
  SHA256(reinterpret_cast<const unsigned char*>(text.data()), text.size(), digest.data());
  constexpr std::size_t textLength = (digest.size() + 2) / 3 * 4;
  std::array<unsigned char, textLength + 1> encoded{};
  EVP_EncodeBlock(encoded.data(), digest.data(), static_cast<int>(digest.size()));
  return {reinterpret_cast<const char*>(encoded.data()), textLength};
}

HttpReply replyTo(const HttpRequest& request, http::status status, const char* type, std::string body) {
  HttpReply reply(status, request.version());
  reply.set(http::field::content_type, type);
  reply.set(http::field::cache_control, "no-store");
  reply.set("Referrer-Policy", "no-referrer");
  reply.set("X-Content-Type-Options", "nosniff");
  reply.set("Cross-Origin-Resource-Policy", "same-origin");
  reply.keep_alive(false);
  reply.content_length(body.size());
  if (request.method() != http::verb::head) reply.body() = std::move(body);
  return reply;
}

}  // namespace

std::string scriptSources(const std::string& page) {
  std::string sources;
  constexpr std::string_view end = "</script>";
  for (std::size_t at = page.find("<script"); at != std::string::npos; at = page.find("<script", at)) {
    const std::size_t begin = page.find('>', at);
    const std::size_t stop = begin == std::string::npos ? begin : page.find(end, begin);
    if (stop == std::string::npos) break;
    sources += (sources.empty() ? "'sha256-" : " 'sha256-") +
               sha256InBase64(std::string_view(page).substr(begin + 1, stop - begin - 1)) + "'";
    at = stop + end.size();
  }
  return sources.empty() ? "'none'" : sources;
}

std::string_view pathOf(std::string_view target) {
  return target.substr(0, target.find('?'));
}

std::string queryField(std::string_view target, std::string_view name) {
  constexpr int hex = 16;
  std::string_view query = target.substr(pathOf(target).size());
  query.remove_prefix(std::min<std::size_t>(query.size(), 1));
  std::string value;
  for (std::string_view rest = fieldOf(query, name); !rest.empty();) {
    unsigned char code = 0;
    const char* const digits = rest.data() + 1;
    const bool isCoded = rest.size() > 2 && rest.front() == '%' &&
                         std::from_chars(digits, digits + 2, code, hex).ptr == digits + 2;
    value += isCoded ? static_cast<char>(code) : rest.front();
    rest.remove_prefix(isCoded ? 3 : 1);
  }
  return value;
}

Site::Site(SiteOptions options)
    : options_(std::move(options)),
      policy_(
          "default-src 'none'; script-src " + scriptSources(options_.page) +
          "; style-src 'unsafe-inline'; img-src data: blob:; worker-src blob:; connect-src 'self'; "
          "base-uri 'none'; form-action 'none'; frame-ancestors " +
          (options_.embedders.empty() ? "'none'" : fmt::format("{}", fmt::join(options_.embedders, " ")))),
      token_(options_.token) {}

HttpReply Site::refusal(const HttpRequest& request, const std::string& cause) {
  return replyTo(request, http::status::forbidden, "text/plain; charset=utf-8", cause + "\n");
}

HttpReply Site::fault(boost::beast::error_code error) {
  const HttpRequest none(http::verb::get, "", 11);  // HTTP/1.1
  if (error == http::error::header_limit) {
    return replyTo(none, http::status::request_header_fields_too_large, "text/plain; charset=utf-8",
                   "the request's head is too large\n");
  }
  return replyTo(none, http::status::bad_request, "text/plain; charset=utf-8",
                 "this isn't an HTTP request\n");
}

HttpReply Site::reply(const HttpRequest& request) {
  const bool reads = request.method() == http::verb::get || request.method() == http::verb::head;
  const std::string_view target = plain(request.target());
  const std::string_view path = pathOf(target);
  if (reads && path == "/") {
    HttpReply reply = replyTo(request, http::status::ok, "text/html; charset=utf-8", options_.page);
    reply.set("Content-Security-Policy", policy_);
    if (!options_.embedders.empty()) reply.set("Cross-Origin-Resource-Policy", "cross-origin");
    return reply;
  }
  if (reads && path == "/stream") {
    if (request.find(http::field::sec_websocket_key) != request.end())
      sayOnce(
          "a proxy in front of this server passes no WebSockets on: the headers Upgrade and Connection are "
          "missing");
    const std::string origin = queryField(target, "origin");
    if (!origin.empty() && !admitsOrigin(origin, field(request, http::field::host)))
      return refusal(request, refusalOf(origin));
    HttpReply reply = replyTo(request, http::status::upgrade_required, "text/plain; charset=utf-8",
                              "this address speaks WebSocket only\n");
    reply.set(http::field::upgrade, "websocket");
    reply.set(http::field::connection, "upgrade, close");
    return reply;
  }
  if (reads && path == "/status") {
    constexpr std::string_view scheme = "Bearer ";
    const std::string given = spelledAs(scheme, field(request, http::field::authorization));
    if (given.starts_with(scheme) && token_.accepts(given.substr(scheme.size())))
      return replyTo(request, http::status::ok, "application/json", options_.status());
    HttpReply reply = replyTo(request, http::status::unauthorized, "text/plain; charset=utf-8",
                              "the status requires the token\n");
    reply.set(http::field::www_authenticate, "Bearer");
    return reply;
  }
  if (!reads && (path == "/" || path == "/status" || path == "/stream")) {
    HttpReply reply = replyTo(request, http::status::method_not_allowed, "text/plain; charset=utf-8",
                              "this server only answers GET and HEAD\n");
    reply.set(http::field::allow, "GET, HEAD");
    return reply;
  }
  return replyTo(request, http::status::not_found, "text/plain; charset=utf-8", "not found\n");
}

bool Site::admitsOrigin(std::string_view origin, std::string_view host) const {
  if (std::ranges::find(options_.origins, origin) != options_.origins.end()) return true;
  if (host.empty()) return false;
  // Proxies may add the usual port to Host. Browsers never add it to Origin.
  for (const auto& [scheme, port] : {std::pair("http://", ":80"), std::pair("https://", ":443")}) {
    const std::string own = scheme + std::string(host);
    if (origin == own || std::string(origin) + port == own) return true;
  }
  return false;
}

std::string Site::refusalOf(std::string_view origin) const {
  // Other texts may be long, or not fit for a terminal.
  if (!isOrigin(origin)) return "a page without an origin, such as one in a sandboxed frame, may not connect";
  std::string option = options_.originOption;
  const std::size_t place = option.find("{}");
  if (place == std::string::npos) return fmt::format("pages of {} may not connect", origin);
  option.replace(place, 2, origin);
  return fmt::format("pages of {} may not connect; to allow it, use {}", origin, option);
}

void Site::sayOnce(const std::string& line) {
  constexpr std::size_t most = 32;
  if (said_.size() >= most || std::ranges::find(said_, line) != said_.end()) return;
  said_.push_back(line);
  if (options_.log) options_.log(line);
}

bool Site::admits(const HttpRequest& request, std::string& cause) {
  const auto protocols = field(request, http::field::sec_websocket_protocol);
  if (!http::token_list({protocols.data(), protocols.size()}).exists(subprotocol)) {
    cause = std::string("this server speaks ") + subprotocol;
    return false;
  }
  const auto found = request.find(http::field::origin);
  if (found == request.end()) return true;  // not a browser
  const std::string_view origin = plain(found->value());
  if (admitsOrigin(origin, field(request, http::field::host))) return true;
  cause = refusalOf(origin);
  sayOnce(cause);
  return false;
}

}  // namespace vdi::stream
