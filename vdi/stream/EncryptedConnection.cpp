#include <boost/beast/websocket/ssl.hpp>

#include "vdi/stream/Connection.h"
#include "vdi/stream/StreamConnection.h"

namespace vdi::stream {

std::shared_ptr<Connection> encryptedConnection(Plain::socket_type socket, boost::asio::ssl::context& context,
                                                const Surroundings& surroundings) {
  return std::make_shared<StreamConnection<Encrypted>>(surroundings, std::move(socket), context);
}

}  // namespace vdi::stream
