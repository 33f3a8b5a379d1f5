// One connection of a client. Not part of the library's interface.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ssl/context.hpp>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "vdi/stream/Url.h"

namespace vdi::stream {

/// The callbacks of a line, called on the thread of its io_context, and never after `ended`.
struct LineEvents {
  std::function<void()> opened;
  std::function<void(std::string_view text)> text;
  std::function<void(std::span<const std::byte> message)> binary;
  /// `code` is WebSocket's status code, or 0. `isFinal` means that another attempt would fail too.
  std::function<void(std::uint16_t code, const std::string& why, bool isFinal)> ended;
};

/// A line lives until it has ended, and as long as it has an owner.
class Line {
 public:
  virtual ~Line() = default;
  virtual void start() = 0;
  /// The token to show to the server: the link's, or the one in a command's greeting.
  virtual std::string token() const = 0;
  virtual void send(std::string text) = 0;
  virtual void close() = 0;  // with WebSocket's handshake, within a second
};

/// Makes a line to `url`, encrypted unless `tls` is null.
std::shared_ptr<Line> line(boost::asio::io_context& context, boost::asio::ssl::context* tls, const Url& url,
                           LineEvents events);
/// Makes a line over the standard input and output of a shell command, to a process that runs serveOver
/// (Pipe.h).
std::shared_ptr<Line> commandLine(boost::asio::io_context& context, const std::string& command,
                                  LineEvents events);

}  // namespace vdi::stream
