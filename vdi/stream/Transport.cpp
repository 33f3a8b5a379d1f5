#include "vdi/stream/Transport.h"

#include <boost/beast/websocket/ssl.hpp>
#include <boost/beast/websocket/teardown.hpp>

namespace vdi::stream {

namespace {

using Encrypted = Transport::Encrypted;

template <typename... Arguments>
std::variant<Plain, Encrypted> streamOf(boost::asio::ssl::context* tls, Arguments&&... arguments) {
  if (tls != nullptr) return Encrypted(Plain(std::forward<Arguments>(arguments)...), *tls);
  return Plain(std::forward<Arguments>(arguments)...);
}

}  // namespace

Transport::Transport(Plain::socket_type socket, boost::asio::ssl::context* tls)
    : stream_(streamOf(tls, std::move(socket))) {}

Transport::Transport(boost::asio::io_context& context, boost::asio::ssl::context* tls)
    : stream_(streamOf(tls, context)) {}

Plain& Transport::next_layer() {
  Encrypted* const encrypted = tls();
  return encrypted != nullptr ? encrypted->next_layer() : std::get<Plain>(stream_);
}

void Transport::readSome(const FirstBuffers<boost::asio::mutable_buffer>& buffers, Completion done) {
  std::visit([&](auto& stream) { stream.async_read_some(buffers, std::move(done)); }, stream_);
}

void Transport::writeSome(const FirstBuffers<boost::asio::const_buffer>& buffers, Completion done) {
  std::visit([&](auto& stream) { stream.async_write_some(buffers, std::move(done)); }, stream_);
}

void Transport::tearDown(boost::beast::role_type role, Completion done) {
  // Argument-dependent lookup finds Beast's functions for both types.
  std::visit([&](auto& stream) { async_teardown(role, stream, std::move(done)); }, stream_);
}

}  // namespace vdi::stream
