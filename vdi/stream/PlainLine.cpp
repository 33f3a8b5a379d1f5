#include "vdi/stream/Line.h"

#include "vdi/stream/StreamLine.h"

namespace vdi::stream {

std::shared_ptr<Line> line(boost::asio::io_context& context, const Url& url, LineEvents events) {
  return std::make_shared<StreamLine<Plain>>(url, std::move(events), context);
}

}  // namespace vdi::stream
