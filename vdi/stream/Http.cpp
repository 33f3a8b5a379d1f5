#include "vdi/stream/Http.h"

#include <openssl/evp.h>
#include <openssl/sha.h>

#include <algorithm>
#include <array>
#include <boost/beast/core/string.hpp>
#include <boost/beast/http/error.hpp>
#include <boost/beast/http/field.hpp>
#include <boost/beast/http/rfc7230.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <string_view>
#include <utility>

#include "vdi/stream/Protocol.h"

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

Site::Site(std::string page, const std::string& token, std::vector<std::string> origins,
           std::function<std::string()> status)
    : page_(std::move(page)),
      policy_("default-src 'none'; script-src " + scriptSources(page_) +
              "; style-src 'unsafe-inline'; img-src data: blob:; worker-src blob:; connect-src 'self'; "
              "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"),
      token_(token),
      origins_(std::move(origins)),
      status_(std::move(status)) {}

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

HttpReply Site::reply(const HttpRequest& request) const {
  const bool reads = request.method() == http::verb::get || request.method() == http::verb::head;
  const std::string_view target = plain(request.target());
  if (reads && target == "/") {
    HttpReply reply = replyTo(request, http::status::ok, "text/html; charset=utf-8", page_);
    reply.set("Content-Security-Policy", policy_);
    return reply;
  }
  if (reads && target == "/status") {
    constexpr std::string_view scheme = "Bearer ";
    const std::string given = spelledAs(scheme, field(request, http::field::authorization));
    if (given.starts_with(scheme) && token_.accepts(given.substr(scheme.size())))
      return replyTo(request, http::status::ok, "application/json", status_());
    HttpReply reply = replyTo(request, http::status::unauthorized, "text/plain; charset=utf-8",
                              "the status requires the token\n");
    reply.set(http::field::www_authenticate, "Bearer");
    return reply;
  }
  const std::string_view resource = target.substr(0, target.find('?'));
  if (!reads && (resource == "/" || resource == "/status" || resource == "/stream")) {
    HttpReply reply = replyTo(request, http::status::method_not_allowed, "text/plain; charset=utf-8",
                              "this server only answers GET and HEAD\n");
    reply.set(http::field::allow, "GET, HEAD");
    return reply;
  }
  return replyTo(request, http::status::not_found, "text/plain; charset=utf-8", "not found\n");
}

bool Site::admits(const HttpRequest& request, std::string& cause) const {
  const auto protocols = field(request, http::field::sec_websocket_protocol);
  if (!http::token_list({protocols.data(), protocols.size()}).exists(subprotocol)) {
    cause = std::string("this server speaks ") + subprotocol;
    return false;
  }
  const auto found = request.find(http::field::origin);
  if (found == request.end()) return true;  // not a browser
  const std::string_view origin = plain(found->value());
  const std::string host(field(request, http::field::host));
  const bool isOwn = !host.empty() && (origin == "http://" + host || origin == "https://" + host);
  if (isOwn || std::find(origins_.begin(), origins_.end(), origin) != origins_.end()) return true;
  cause = "pages of this origin may not connect";
  return false;
}

}  // namespace vdi::stream
