// One connection to the server: HTTP first, a WebSocket if that is asked for. Not part of the library's
// interface.
#pragma once

#include <boost/asio/ssl/context.hpp>
#include <cstdint>
#include <functional>
#include <memory>

#include "vdi/stream/Http.h"
#include "vdi/stream/Transport.h"
#include "vdi/stream/Viewer.h"

namespace vdi::stream {

/// The parts of a server that its connections use, and that outlive them. Each connection calls `leave` once.
struct Surroundings {
  Hub& hub;
  const Site& site;
  std::function<void()> leave;
};

/// It lives as long as something is under way on it.
class Connection {
 public:
  virtual ~Connection() = default;
  virtual void start() = 0;
  /// Says goodbye to a viewer; others are cut off.
  virtual void finish() = 0;
  /// Cuts it off.
  virtual void cut() = 0;
  /// Whether it has shown the token.
  virtual bool isWelcome() const = 0;
};

/// Encrypted, unless `tls` is null.
std::shared_ptr<Connection> connection(Plain::socket_type socket, boost::asio::ssl::context* tls,
                                       const Surroundings& surroundings);

}  // namespace vdi::stream
