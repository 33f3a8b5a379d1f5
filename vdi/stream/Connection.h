// One connection to the server: HTTP first, then a WebSocket if the peer asks for one. Not part of the
// library's interface.
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
  Site& site;
  std::function<void()> leave;
};

/// A connection lives as long as an operation on it is under way.
class Connection {
 public:
  virtual ~Connection() = default;
  virtual void start() = 0;
  /// Says goodbye to a viewer, and cuts off any other peer.
  virtual void finish() = 0;
  /// Closes the connection at once.
  virtual void cut() = 0;
  /// Whether the peer is a viewer that has shown the token.
  virtual bool isWelcome() const = 0;
};

/// Makes a connection, encrypted unless `tls` is null.
std::shared_ptr<Connection> connection(Plain::socket_type socket, boost::asio::ssl::context* tls,
                                       const Surroundings& surroundings);

}  // namespace vdi::stream
