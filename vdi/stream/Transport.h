// The byte stream that Boost.Beast runs over. Not part of the library's interface.
#pragma once

#include <array>
#include <boost/asio/async_result.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/generic/stream_protocol.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <boost/beast/core/basic_stream.hpp>
#include <boost/beast/core/error.hpp>
#include <boost/beast/core/role.hpp>
#include <cstddef>
#include <memory>
#include <type_traits>
#include <utility>
#include <variant>

namespace vdi::stream {

/// TCP, or one end of a pair of local sockets.
using Plain = boost::beast::basic_stream<boost::asio::generic::stream_protocol>;

/// A handler of any type, called once. It hides the types of Beast's operations, so that the compiler
/// instantiates those of the streams below, which take most of Beast's compile time, for one type only.
class Completion {
 public:
  template <typename Handler>
  explicit Completion(Handler handler) : held_(std::make_unique<Held<Handler>>(std::move(handler))) {}

  void operator()(boost::beast::error_code error, std::size_t bytes = 0) {
    std::unique_ptr<Base> held = std::move(held_);
    Base& base = *held;
    base.call(std::move(held), error, bytes);
  }

 private:
  struct Base {
    Base() = default;
    virtual ~Base() = default;
    Base(const Base&) = delete;
    Base& operator=(const Base&) = delete;
    /// Frees `self` before the call, as Asio's operations do: the handler may start another one.
    virtual void call(std::unique_ptr<Base> self, boost::beast::error_code error, std::size_t bytes) = 0;
  };
  template <typename Handler>
  struct Held : Base {
    explicit Held(Handler handler) : handler_(std::move(handler)) {}
    void call(std::unique_ptr<Base> self, boost::beast::error_code error, std::size_t bytes) override {
      Handler handler = std::move(handler_);
      self.reset();
      if constexpr (std::is_invocable_v<Handler&, boost::beast::error_code, std::size_t>) {
        handler(error, bytes);
      } else {
        handler(error);
      }
    }
    Handler handler_;
  };

  std::unique_ptr<Base> held_;
};

/// The first of a sequence's buffers. An operation that transfers some of the bytes needs no more.
template <typename Buffer>
class FirstBuffers {
 public:
  using value_type = Buffer;
  using const_iterator = const Buffer*;

  template <typename Sequence>
  explicit FirstBuffers(const Sequence& sequence) {
    const auto end = boost::asio::buffer_sequence_end(sequence);
    for (auto at = boost::asio::buffer_sequence_begin(sequence); at != end && count_ < buffers_.size(); ++at)
      buffers_[count_++] = Buffer(*at);
  }
  const_iterator begin() const { return buffers_.data(); }
  const_iterator end() const { return buffers_.data() + count_; }

 private:
  std::array<Buffer, 16> buffers_;
  std::size_t count_ = 0;
};

/// Plain, or TLS over it. An AsyncStream in Beast's sense, whose handlers run on the thread of the
/// io_context.
class Transport {
 public:
  using executor_type = Plain::executor_type;
  using Encrypted = boost::asio::ssl::stream<Plain>;
  template <typename Handler>
  using Transferred =
      typename boost::asio::async_result<std::decay_t<Handler>,
                                         void(boost::beast::error_code, std::size_t)>::return_type;

  /// Uses TLS unless `tls` is null. `tls` must outlive the transport.
  Transport(Plain::socket_type socket, boost::asio::ssl::context* tls);
  Transport(boost::asio::io_context& context, boost::asio::ssl::context* tls);

  executor_type get_executor() { return next_layer().get_executor(); }
  Plain& next_layer();
  /// The TLS stream; null without TLS.
  Encrypted* tls() { return std::get_if<Encrypted>(&stream_); }

  template <typename Buffers, typename Handler>
  Transferred<Handler> async_read_some(const Buffers& buffers, Handler&& handler) {
    return boost::asio::async_initiate<Handler, void(boost::beast::error_code, std::size_t)>(
        [this](auto&& completion, const Buffers& to) {
          readSome(FirstBuffers<boost::asio::mutable_buffer>(to),
                   Completion(std::forward<decltype(completion)>(completion)));
        },
        handler, buffers);
  }
  template <typename Buffers, typename Handler>
  Transferred<Handler> async_write_some(const Buffers& buffers, Handler&& handler) {
    return boost::asio::async_initiate<Handler, void(boost::beast::error_code, std::size_t)>(
        [this](auto&& completion, const Buffers& from) {
          writeSome(FirstBuffers<boost::asio::const_buffer>(from),
                    Completion(std::forward<decltype(completion)>(completion)));
        },
        handler, buffers);
  }
  /// Ends the connection after a WebSocket's last message.
  void tearDown(boost::beast::role_type role, Completion done);

 private:
  void readSome(const FirstBuffers<boost::asio::mutable_buffer>& buffers, Completion done);
  void writeSome(const FirstBuffers<boost::asio::const_buffer>& buffers, Completion done);

  std::variant<Plain, Encrypted> stream_;
};

/// Beast finds this function by argument-dependent lookup.
template <typename Handler>
void async_teardown(boost::beast::role_type role, Transport& transport, Handler&& handler) {
  transport.tearDown(role, Completion(std::forward<Handler>(handler)));
}

}  // namespace vdi::stream
