#include "vdi/stream/Connection.h"

#include <array>
#include <boost/asio/buffer.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/string_type.hpp>
#include <boost/beast/http/error.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/write.hpp>
#include <boost/beast/websocket/stream.hpp>
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>

#include "vdi/stream/Protocol.h"

namespace vdi::stream {

namespace {

namespace limits {

// Timeouts for sending the request, for reading the reply, and for a viewer's hello.
constexpr std::chrono::seconds request{10};
constexpr std::chrono::seconds reply{30};
constexpr std::chrono::seconds hello{5};
// A viewer that says nothing for this time gets a ping, and is cut off if it doesn't answer.
constexpr std::chrono::seconds silence{60};
constexpr std::uint32_t headBytes = 8192;

}  // namespace limits

class SocketConnection : public Connection, public std::enable_shared_from_this<SocketConnection> {
 public:
  SocketConnection(Plain::socket_type socket, boost::asio::ssl::context* tls,
                   const Surroundings& surroundings)
      : surroundings_(surroundings),
        socket_(std::move(socket), tls),
        timer_(socket_.get_executor()),
        helloTimer_(socket_.get_executor()) {}
  ~SocketConnection() override { surroundings_.leave(); }
  SocketConnection(const SocketConnection&) = delete;
  SocketConnection& operator=(const SocketConnection&) = delete;

  void start() override {
    parser_.header_limit(limits::headBytes);
    parser_.body_limit(0);
    transport().expires_after(limits::request);
    auto* const tls = socket_.next_layer().tls();
    if (tls == nullptr) return readRequest();
    tls->async_handshake(boost::asio::ssl::stream_base::server, [self = shared_from_this()](Error error) {
      if (!error) self->readRequest();
    });
  }

  void finish() override {
    if (isWelcome()) {
      viewer_->refuse(Close::GoingAway, "the server is shutting down");
    } else {
      cut();
    }
  }

  bool isWelcome() const override { return viewer_ && viewer_->isWelcome() && !hasEnded_; }

  void cut() override {
    timer_.cancel();
    helloTimer_.cancel();
    transport().close();
  }

 private:
  using Error = boost::beast::error_code;

  Plain& transport() { return boost::beast::get_lowest_layer(socket_); }

  void readRequest() {
    namespace http = boost::beast::http;
    http::async_read(
        socket_.next_layer(), buffer_, parser_, [self = shared_from_this()](Error error, std::size_t) {
          if (error == http::error::end_of_stream || error == http::error::partial_message) return;
          const HttpRequest& request = self->parser_.get();
          const bool isWhole = !error && (request.version() < 11 || request.count(http::field::host) == 1);
          if (isWhole) return self->answer();
          // No request that the server knows has a body, so the reply depends on the head alone.
          if (error == http::error::body_limit) return self->send(self->surroundings_.site.reply(request));
          const bool isOfHttp = error.category() == http::make_error_code(http::error::bad_method).category();
          if (!error || isOfHttp) self->send(Site::fault(error));
        });
  }

  void answer() {
    const HttpRequest& request = parser_.get();
    if (!boost::beast::websocket::is_upgrade(request) ||
        pathOf({request.target().data(), request.target().size()}) != "/stream") {
      send(surroundings_.site.reply(request));
      return;
    }
    std::string cause;
    if (!surroundings_.site.admits(request, cause)) {
      send(Site::refusal(request, cause));
      return;
    }
    upgrade();
  }

  void send(HttpReply reply) {
    reply_ = std::move(reply);
    transport().expires_after(limits::reply);
    boost::beast::http::async_write(socket_.next_layer(), reply_,
                                    [self = shared_from_this()](Error error, std::size_t) {
                                      if (!error) self->hangUp();
                                    });
  }

  /// Ends the connection after a reply. Closing it at once could cost the peer the reply's end.
  void hangUp() {
    auto* const tls = socket_.next_layer().tls();
    if (tls != nullptr) return tls->async_shutdown([self = shared_from_this()](Error) { self->cut(); });
    Error ignored;
    transport().socket().shutdown(Plain::socket_type::shutdown_send, ignored);
    cut();
  }

  void upgrade() {
    namespace websocket = boost::beast::websocket;
    transport().expires_never();  // the WebSocket has limits of its own
    socket_.set_option(websocket::stream_base::timeout{limits::request, limits::silence, true});
    socket_.set_option(websocket::stream_base::decorator([](websocket::response_type& response) {
      response.set(boost::beast::http::field::sec_websocket_protocol, subprotocol);
    }));
    socket_.read_message_max(maxViewerText);
    socket_.auto_fragment(false);
    socket_.async_accept(parser_.get(), [self = shared_from_this()](Error error) {
      if (!error) self->converse();
    });
  }

  void converse() {
    viewer_.emplace(surroundings_.hub, [this] { pump(); });
    helloTimer_.expires_after(limits::hello);
    helloTimer_.async_wait([self = shared_from_this()](Error error) {
      if (!error && !self->viewer_->isWelcome())
        self->viewer_->refuse(Close::Late, "no \"hello\" came in time");
    });
    buffer_.clear();
    listen();
  }

  void listen() {
    socket_.async_read(buffer_, [self = shared_from_this()](Error error, std::size_t) {
      if (error || self->hasEnded_) {
        self->end();
        return;
      }
      try {
        self->receive();
      } catch (const std::exception&) {  // without memory, only this connection is lost
        self->end();
        throw;
      }
    });
  }

  /// Handles the message in the buffer.
  void receive() {
    const auto data = buffer_.cdata();
    if (socket_.got_text()) {
      viewer_->receive({static_cast<const char*>(data.data()), data.size()}, Clock::now());
    } else {
      viewer_->refuse(Close::BadMessage, "a viewer's messages are text");
    }
    buffer_.consume(data.size());
    pump();
    // async_close reads what is left by itself. A concurrent read might never end.
    const bool isClosing = isWriting_ && std::holds_alternative<Viewer::Farewell>(outgoing_);
    if (!isClosing) listen();
  }

  /// Call when the viewer is gone. Operations under way end with an error and then release this object.
  void end() {
    if (std::exchange(hasEnded_, true)) return;
    cut();
    viewer_->leave();
  }

  /// Sends the waiting messages, one after the other. Never throws: the hub calls it for one viewer
  /// after the other. Without memory, the connection is cut, and the read under way then ends it.
  void pump() noexcept {
    try {
      sendNext();
    } catch (const std::exception&) {
      cut();
    }
  }

  void sendNext() {
    if (hasEnded_) return;
    if (isWriting_) {
      // A level that can't be sent would block the reason for the disconnection, too.
      if (viewer_->isStalled() && std::holds_alternative<Viewer::Binary>(outgoing_)) cut();
      return;
    }
    outgoing_ = viewer_->next(Clock::now());
    std::visit([this](auto& message) { put(message); }, outgoing_);
  }

  template <typename Buffers>
  void write(bool isText, const Buffers& buffers) {
    isWriting_ = true;
    socket_.text(isText);
    socket_.async_write(buffers, [self = shared_from_this()](Error error, std::size_t) {
      self->isWriting_ = false;
      if (error) {
        self->end();
      } else {
        self->pump();
      }
    });
  }

  void put(const std::string& text) { write(true, boost::asio::buffer(text)); }

  void put(const Viewer::Binary& part) {
    write(false, std::array{boost::asio::const_buffer(part.head.data(), part.head.size()),
                            boost::asio::const_buffer(part.bytes.data(), part.bytes.size())});
  }

  void put(const Viewer::Wait& wait) {
    if (!wait.until) return;
    timer_.expires_at(*wait.until);
    timer_.async_wait([weak = weak_from_this()](Error error) {
      const auto self = weak.lock();
      if (!error && self) self->pump();
    });
  }

  void put(const Viewer::Farewell& farewell) {
    isWriting_ = true;
    const std::string_view text = closeReason(farewell.cause);
    const boost::beast::websocket::close_reason reason(
        static_cast<boost::beast::websocket::close_code>(farewell.code),
        boost::beast::string_view(text.data(), text.size()));
    socket_.async_close(reason, [self = shared_from_this()](Error) { self->end(); });
  }

  const Surroundings surroundings_;
  boost::beast::websocket::stream<Transport> socket_;
  boost::asio::steady_timer timer_;
  boost::asio::steady_timer helloTimer_;
  boost::beast::flat_buffer buffer_;
  boost::beast::http::request_parser<boost::beast::http::empty_body> parser_;
  HttpReply reply_;
  std::optional<Viewer> viewer_;
  Viewer::Outgoing outgoing_;
  bool isWriting_ = false;
  bool hasEnded_ = false;
};

}  // namespace

std::shared_ptr<Connection> connection(Plain::socket_type socket, boost::asio::ssl::context* tls,
                                       const Surroundings& surroundings) {
  return std::make_shared<SocketConnection>(std::move(socket), tls, surroundings);
}

}  // namespace vdi::stream
