#include <boost/beast/websocket/ssl.hpp>

#include "vdi/stream/Line.h"
#include "vdi/stream/StreamLine.h"

namespace vdi::stream {

std::shared_ptr<Line> encryptedLine(boost::asio::io_context& context, boost::asio::ssl::context& tls,
                                    const Url& url, LineEvents events) {
  return std::make_shared<StreamLine<Encrypted>>(url, std::move(events), context, tls);
}

}  // namespace vdi::stream
