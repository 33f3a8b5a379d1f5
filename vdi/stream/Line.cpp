#include "vdi/stream/Line.h"

#include <openssl/err.h>
#include <openssl/ssl.h>

#include <boost/asio/buffer.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/ssl/error.hpp>
#include <boost/asio/ssl/host_name_verification.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/field.hpp>
#include <boost/beast/websocket/error.hpp>
#include <boost/beast/websocket/stream.hpp>
#include <chrono>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "vdi/stream/Command.h"
#include "vdi/stream/Pipe.h"
#include "vdi/stream/Protocol.h"
#include "vdi/stream/Transport.h"

namespace vdi::stream {

namespace {

class SocketLine : public Line, public std::enable_shared_from_this<SocketLine> {
 public:
  SocketLine(boost::asio::io_context& context, boost::asio::ssl::context* tls, const Url& url,
             LineEvents events)
      : url_(url),
        events_(std::move(events)),
        resolver_(context),
        patience_(context),
        socket_(context, tls),
        token_(url.token) {}

  /// start() runs this command and communicates over its standard input and output.
  void runFirst(const std::string& command) { command_ = command; }

  std::string token() const override { return token_; }

  void start() override {
    if (!command_.empty()) return run();
    resolver_.async_resolve(url_.host, std::to_string(url_.port),
                            [self = shared_from_this()](Error error, const Resolver::results_type& found) {
                              if (error) return self->fail("can't find " + self->url_.host, error);
                              for (const auto& entry : found) self->endpoints_.push_back(entry.endpoint());
                              self->connect(boost::asio::error::host_not_found);
                            });
  }

  void send(std::string text) override {
    if (hasEnded_) return;
    queue_.push_back(std::move(text));
    write();
  }

  void close() override {
    if (hasEnded_) return;
    if (!isOpen_) {
      end(0, "closed", false);
      return;
    }
    patience_.expires_after(std::chrono::seconds(1));
    patience_.async_wait([self = shared_from_this()](Error error) {
      if (!error) self->end(0, "closed", false);
    });
    isClosing_ = true;
    if (!isWriting_) closeNow();
  }

 private:
  using Error = boost::beast::error_code;
  using Resolver = boost::asio::ip::tcp::resolver;

  std::string name() const { return command_.empty() ? url_.authority() : "the command"; }

  void run() {
    process_.emplace(command_);
    Error error;
    transport().socket().assign(boost::asio::generic::stream_protocol(AF_UNIX, 0), process_->takeSocket(),
                                error);
    if (error) return fail("can't talk to the command", error);
    transport().expires_after(forGreeting);
    readGreeting();
  }

  /// Reads up to the greeting, and skips what a shell writes when it starts.
  void readGreeting() {
    boost::asio::async_read_until(
        socket_.next_layer(), boost::asio::dynamic_buffer(line_, mostGreetingBytes), '\n',
        [self = shared_from_this()](Error error, std::size_t count) {
          if (self->hasEnded_) return;
          self->greetingBytes_ += count;
          if (error == boost::asio::error::not_found || self->greetingBytes_ > mostGreetingBytes)
            return self->end(0, "the command doesn't start as vdi serve --stdio does", true);
          if (error) return self->endOfCommand();
          const std::optional<std::string> token =
              tokenInGreeting(std::string_view(self->line_).substr(0, count - 1));
          self->line_.erase(0, count);
          if (!token) return self->readGreeting();
          self->token_ = *token;
          self->upgrade();
        });
  }

  void endOfCommand() {
    transport().close();
    const Command::Ending ending = process_->end();
    end(0, "the command " + ending.how + " and offered no VDIs", ending.isNotFound);
  }

  Plain& transport() { return boost::beast::get_lowest_layer(socket_); }

  /// Connects to the host's next address. `last` is the reason why the previous one failed.
  void connect(Error last) {
    if (hasEnded_) return;
    if (endpoints_.empty()) return fail("can't connect to " + url_.authority(), last);
    const boost::asio::ip::tcp::endpoint endpoint = endpoints_.front();
    endpoints_.pop_front();
    transport().expires_after(waiting);
    transport().async_connect(Plain::endpoint_type(endpoint), [self = shared_from_this()](Error error) {
      if (!error) return self->secure();
      self->transport().close();
      self->connect(error);
    });
  }

  void secure() {
    auto* const tls = socket_.next_layer().tls();
    if (tls == nullptr) return upgrade();
    SSL_set_tlsext_host_name(tls->native_handle(), url_.host.c_str());
    tls->set_verify_mode(boost::asio::ssl::verify_peer);
    tls->set_verify_callback(boost::asio::ssl::host_name_verification(url_.host));
    tls->async_handshake(boost::asio::ssl::stream_base::client, [self = shared_from_this()](Error error) {
      if (!error) return self->upgrade();
      const bool isDistrust =
          ERR_GET_REASON(static_cast<unsigned long>(error.value())) == SSL_R_CERTIFICATE_VERIFY_FAILED &&
          error.category() == boost::asio::error::get_ssl_category();
      const std::string where = self->url_.authority();
      if (isDistrust) return self->end(0, "the certificate of " + where + " isn't trusted", true);
      self->fail("can't encrypt the connection to " + where, error);
    });
  }

  void upgrade() {
    namespace websocket = boost::beast::websocket;
    transport().expires_never();
    socket_.set_option(websocket::stream_base::timeout{waiting, silence, true});
    socket_.set_option(websocket::stream_base::decorator([](websocket::request_type& request) {
      request.set(boost::beast::http::field::sec_websocket_protocol, subprotocol);
    }));
    socket_.read_message_max(maxServerText);
    socket_.auto_fragment(false);
    socket_.async_handshake(
        response_, url_.authority(), url_.streamTarget(), [self = shared_from_this()](Error error) {
          if (error == websocket::error::upgrade_declined) {
            // A server error, such as a proxy's 502, may be temporary.
            constexpr int serverErrors = 500;
            const int status = static_cast<int>(self->response_.result_int());
            self->end(0, self->name() + " has no VDIs to offer: HTTP status " + std::to_string(status),
                      status < serverErrors);
          } else if (error) {
            self->fail("can't talk to " + self->name(), error);
          } else if (!self->hasEnded_) {
            self->isOpen_ = true;
            self->events_.opened();
            self->write();
            self->read();
          }
        });
  }

  void read() {
    socket_.async_read(buffer_, [self = shared_from_this()](Error error, std::size_t) {
      if (self->hasEnded_) return;
      if (error) return self->endOfReading(error);
      const auto data = self->buffer_.cdata();
      const auto* const bytes = static_cast<const std::byte*>(data.data());
      if (self->socket_.got_text()) {
        self->events_.text({reinterpret_cast<const char*>(bytes), data.size()});
      } else {
        self->events_.binary({bytes, data.size()});
      }
      // async_close reads what is left by itself. A concurrent read might never end.
      if (self->hasEnded_ || self->isClosing_) return;
      self->buffer_.consume(data.size());
      self->read();
    });
  }

  void endOfReading(Error error) {
    if (error != boost::beast::websocket::error::closed) return fail("the connection is lost", error);
    const auto& reason = socket_.reason();
    const std::string why(reason.reason.data(), reason.reason.size());
    end(reason.code, why.empty() ? "the server closed the connection" : why, false);
  }

  void write() {
    if (!isOpen_ || isWriting_ || isClosing_ || queue_.empty()) return;
    isWriting_ = true;
    writing_ = std::move(queue_.front());
    queue_.pop_front();
    socket_.text(true);
    socket_.async_write(boost::asio::buffer(writing_), [self = shared_from_this()](Error error, std::size_t) {
      self->isWriting_ = false;
      if (self->hasEnded_) return;
      if (self->isClosing_) return self->closeNow();
      if (!error) self->write();  // the read under way reports why it failed
    });
  }

  void closeNow() {
    isWriting_ = true;
    socket_.async_close(boost::beast::websocket::close_code::normal,
                        [self = shared_from_this()](Error) { self->end(0, "closed", false); });
  }

  void fail(const std::string& what, Error error) { end(0, what + ": " + error.message(), false); }

  void end(std::uint16_t code, const std::string& why, bool isFinal) {
    if (std::exchange(hasEnded_, true)) return;
    resolver_.cancel();
    patience_.cancel();
    transport().close();
    process_.reset();
    events_.ended(code, why, isFinal);
  }

  static constexpr std::chrono::seconds waiting{10};
  static constexpr std::chrono::seconds silence{60};
  static constexpr std::chrono::seconds forGreeting{120};  // somebody may have to enter a password
  static constexpr std::size_t mostGreetingBytes = std::size_t{64} << 10;

  const Url url_;
  LineEvents events_;
  Resolver resolver_;
  boost::asio::steady_timer patience_;
  std::deque<boost::asio::ip::tcp::endpoint> endpoints_;
  boost::beast::websocket::stream<Transport> socket_;
  boost::beast::websocket::response_type response_;
  boost::beast::flat_buffer buffer_;
  std::deque<std::string> queue_;
  std::string writing_;
  std::string command_;
  std::optional<Command> process_;
  std::string line_;
  std::size_t greetingBytes_ = 0;
  std::string token_;
  bool isOpen_ = false;
  bool isWriting_ = false;
  bool isClosing_ = false;
  bool hasEnded_ = false;
};

}  // namespace

std::shared_ptr<Line> line(boost::asio::io_context& context, boost::asio::ssl::context* tls, const Url& url,
                           LineEvents events) {
  return std::make_shared<SocketLine>(context, tls, url, std::move(events));
}

std::shared_ptr<Line> commandLine(boost::asio::io_context& context, const std::string& command,
                                  LineEvents events) {
  Url nowhere;
  nowhere.host = "localhost";  // HTTP requires a host
  auto made = std::make_shared<SocketLine>(context, nullptr, nowhere, std::move(events));
  made->runFirst(command);
  return made;
}

}  // namespace vdi::stream
