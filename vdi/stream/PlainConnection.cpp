#include "vdi/stream/Connection.h"

#include "vdi/stream/StreamConnection.h"

namespace vdi::stream {

std::shared_ptr<Connection> connection(Plain::socket_type socket, const Surroundings& surroundings) {
  return std::make_shared<StreamConnection<Plain>>(surroundings, std::move(socket));
}

}  // namespace vdi::stream
