#include "vdi/stream/Line.h"

#include "vdi/stream/StreamLine.h"

namespace vdi::stream {

std::shared_ptr<Line> line(boost::asio::io_context& context, const Url& url, LineEvents events) {
  return std::make_shared<StreamLine<Plain>>(url, std::move(events), context);
}

std::shared_ptr<Line> commandLine(boost::asio::io_context& context, const std::string& command,
                                  LineEvents events) {
  Url nowhere;
  nowhere.host = "localhost";  // HTTP wants one
  auto made = std::make_shared<StreamLine<Plain>>(nowhere, std::move(events), context);
  made->runFirst(command);
  return made;
}

}  // namespace vdi::stream
