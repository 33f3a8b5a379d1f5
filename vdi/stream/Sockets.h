// The transports that Boost.Beast runs over. Not part of the library's interface.
#pragma once

#include <boost/asio/generic/stream_protocol.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <boost/beast/core/basic_stream.hpp>

namespace vdi::stream {

/// TCP, or one end of a pair of local sockets.
using Plain = boost::beast::basic_stream<boost::asio::generic::stream_protocol>;
using Encrypted = boost::asio::ssl::stream<Plain>;

}  // namespace vdi::stream
