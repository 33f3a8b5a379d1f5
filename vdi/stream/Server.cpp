#include "vdi/stream/Server.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <future>
#include <map>
#include <memory>
#include <thread>
#include <utility>

#include "vdi/core/Error.h"
#include "vdi/io/JsonText.h"
#include "vdi/stream/Connection.h"
#include "vdi/stream/Http.h"
#include "vdi/stream/Token.h"
#include "vdi/stream/Url.h"
#include "vdi/stream/Viewer.h"

namespace vdi::stream {

namespace {

namespace asio = boost::asio;
using asio::ip::tcp;

constexpr std::chrono::seconds goodbyePatience{1};  // for goodbyes, and again after connections are cut
constexpr std::chrono::milliseconds acceptPause{100};
constexpr std::chrono::milliseconds failurePause{1};  // memory may be free by then

std::string addressText(const std::string& host, std::uint16_t port) {
  const bool isV6 = host.find(':') != std::string::npos;
  return isV6 ? fmt::format("[{}]:{}", host, port) : fmt::format("{}:{}", host, port);
}

/// The host name used in links; for a wildcard address, the machine's name.
std::string nameInLinks(const std::string& host) {
  if (host != "0.0.0.0" && host != "::") return host;
  constexpr std::size_t longest = 256;
  std::array<char, longest> name{};
  return ::gethostname(name.data(), name.size() - 1) == 0 ? std::string(name.data()) : host;
}

void requireOrigins(const std::vector<std::string>& origins) {
  for (const std::string& origin : origins) {
    if (!isOrigin(origin)) throw Error(ErrorCode::InvalidArgument, notAnOrigin, origin);
  }
}

std::unique_ptr<asio::ssl::context> tlsContext(const ServerOptions& options) {
  if (options.certificate.empty() && options.key.empty()) return nullptr;
  if (options.certificate.empty() || options.key.empty())
    throw Error(ErrorCode::InvalidArgument, "TLS needs a certificate and its key");
  auto context = std::make_unique<asio::ssl::context>(asio::ssl::context::tls_server);
  context->set_options(asio::ssl::context::default_workarounds | asio::ssl::context::no_tlsv1 |
                       asio::ssl::context::no_tlsv1_1);
  boost::system::error_code error;
  context->use_certificate_chain_file(options.certificate.string(), error);
  if (error) throw Error(ErrorCode::Io, "can't use the certificate: " + error.message(), options.certificate);
  context->use_private_key_file(options.key.string(), asio::ssl::context::pem, error);
  if (error) throw Error(ErrorCode::Io, "can't use the certificate's key: " + error.message(), options.key);
  return context;
}

}  // namespace

class Server::Impl {
 public:
  explicit Impl(ServerOptions options)
      : options_((requireToken(options.token, "token"), requireOrigins(options.origins),
                  requireOrigins(options.embedders), std::move(options))),
        tls_(tlsContext(options_)),
        hub_({options_.token, options_.mostBytesPerSecond, options_.mostViewers, options_.mostHeldBytes,
              options_.show, options_.steer, options_.log}),
        site_({std::move(options_.page), options_.token, options_.origins, options_.originOption,
               options_.embedders, [this] { return statusText(); }, options_.log}),
        acceptor_(context_),
        pause_(context_),
        patience_(context_),
        work_(asio::make_work_guard(context_)) {
    if (options_.listens) {
      listen();
      accept();
    }
    thread_ = std::thread([this] { run(); });
  }

  ~Impl() {
    try {
      asio::post(context_, [this] { finish(); });
    } catch (const std::exception&) {  // out of memory, peers get no goodbye
      context_.stop();
    }
    thread_.join();
    dropConnections();
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  std::uint16_t port() const { return port_; }
  std::string address() const {
    return fmt::format("{}://{}/", tls_ ? "https" : "http", addressText(nameInLinks(options_.host), port_));
  }
  std::string link() const { return address() + "#token=" + options_.token; }

  template <typename Work>
  void onThread(Work work) {
    asio::post(context_, std::move(work));
  }
  Hub& hub() { return hub_; }
  void publish(FramePtr frame) {
    onThread([this, held = std::move(frame)] {
      hub_.publish(held, Clock::now());
      carriesWholeFrames_ = hub_.carriesWholeFrames();
    });
  }
  bool carriesWholeFrames() const { return carriesWholeFrames_; }

  /// Calls `question` on the server's thread and returns its answer.
  template <typename Answer>
  Answer ask(const std::function<Answer()>& question) {
    std::promise<Answer> promise;
    std::future<Answer> answer = promise.get_future();
    onThread([&] {
      try {
        promise.set_value(question());
      } catch (...) {
        promise.set_exception(std::current_exception());
      }
    });
    return answer.get();
  }

  ServerStatus statusNow() const {
    return {hub_.session(), hub_.phase(), hub_.viewerCount(), hub_.published()};
  }

  void adopt(int descriptor) {
    Plain::socket_type socket(context_);
    boost::system::error_code error;
    socket.assign(asio::generic::stream_protocol(AF_UNIX, 0), descriptor, error);
    if (error) throw Error(ErrorCode::Io, "can't serve the descriptor: " + error.message());
    // Shared, so that the handler can be copied although a socket can't be.
    onThread(
        [this, held = std::make_shared<Plain::socket_type>(std::move(socket))] { serve(std::move(*held)); });
  }

 private:
  std::string statusText() const {
    const ServerStatus now = statusNow();
    return io::JsonObject()
        .add("session", io::jsonOf(now.session))
        .add("state", io::jsonOf(toString(now.phase)))
        .add("viewers", io::jsonOf(now.viewers))
        .add("frames", io::jsonOf(now.frames))
        .text();
  }
  /// Never throws: without memory, the operator gets no line, and the thread goes on.
  void say(const char* line) const noexcept {
    try {
      if (options_.log) options_.log(line);
    } catch (const std::exception&) {
    }
  }

  void listen() {
    boost::system::error_code error;
    tcp::resolver resolver(context_);
    const auto found = resolver.resolve(options_.host, std::to_string(options_.port),
                                        tcp::resolver::passive | tcp::resolver::address_configured, error);
    const auto fail = [&] {
      throw Error(ErrorCode::Io, "can't listen: " + error.message(),
                  addressText(options_.host, options_.port));
    };
    if (error || found.begin() == found.end()) fail();
    const tcp::endpoint endpoint = found.begin()->endpoint();
    acceptor_.open(endpoint.protocol(), error);
    if (!error) acceptor_.set_option(tcp::acceptor::reuse_address(true), error);
    if (!error) acceptor_.bind(endpoint, error);
    if (!error) acceptor_.listen(asio::socket_base::max_listen_connections, error);
    if (error) fail();
    port_ = acceptor_.local_endpoint().port();
  }

  void accept() {
    acceptor_.async_accept([this](boost::system::error_code error, tcp::socket socket) {
      if (error == asio::error::operation_aborted || !acceptor_.is_open()) return;
      if (error) {  // too many open files, for example; some may be closed soon
        pause_.expires_after(acceptPause);
        pause_.async_wait([this](boost::system::error_code cancelled) {
          if (!cancelled) accept();
        });
        return;
      }
      boost::system::error_code ignored;
      socket.set_option(tcp::no_delay(true), ignored);
      serve(std::move(socket));
      accept();
    });
  }

  /// Call after an exception, which may have come before the server accepted the next peer. Returns
  /// false if there is no memory: then call it again.
  bool acceptAnew() {
    if (!acceptor_.is_open()) return true;
    try {
      acceptor_.cancel();
      pause_.cancel();
      accept();
      return true;
    } catch (const std::exception&) {
      return false;
    }
  }

  void serve(Plain::socket_type socket) {
    if (isEnding_ || (connections_.size() >= options_.mostConnections && !makeRoom()))
      return;  // closes the socket
    const std::uint64_t number = nextNumber_++;
    const Surroundings surroundings{hub_, site_, [this, number] { leave(number); }};
    const std::shared_ptr<Connection> made =
        connection(std::move(socket), tls_ ? &*tls_ : nullptr, surroundings);
    connections_.emplace(number, made);
    made->start();
  }

  /// Cuts the oldest connection that hasn't shown the token, so that peers that open many
  /// connections and send little or nothing don't keep others out. Returns whether there was one.
  bool makeRoom() {
    for (auto at = connections_.begin(); at != connections_.end(); ++at) {
      const std::shared_ptr<Connection> oldest = at->second.lock();
      if (oldest && oldest->isWelcome()) continue;
      connections_.erase(at);
      if (oldest) oldest->cut();
      return true;
    }
    return false;
  }

  void leave(std::uint64_t number) {
    connections_.erase(number);
    if (isEnding_ && connections_.empty()) stop();
  }

  void finish() {
    isEnding_ = true;
    try {
      sayGoodbye();
    } catch (const std::exception&) {  // out of memory
      context_.stop();
    }
  }

  /// Tells each connection that the server ends. Cuts those that still exist after goodbyePatience.
  void sayGoodbye() {
    boost::system::error_code ignored;
    acceptor_.close(ignored);
    pause_.cancel();
    hub_.setPhase(Phase::Ended);
    forEach([](Connection& connection) { connection.finish(); });
    if (connections_.empty()) {
      stop();
      return;
    }
    patience_.expires_after(goodbyePatience);
    patience_.async_wait([this](boost::system::error_code) {
      forEach([](Connection& connection) { connection.cut(); });
      work_.reset();
      if (connections_.empty()) return;
      patience_.expires_after(goodbyePatience);
      patience_.async_wait([this](boost::system::error_code error) {
        if (!error) context_.stop();  // the destructor must not wait any longer
      });
    });
  }

  /// Call after the thread has ended. Connections that are left must go before the context: Beast's part of
  /// its destructor would allocate memory for them, and the end of a connection uses the timers.
  void dropConnections() noexcept {
    boost::system::error_code ignored;
    acceptor_.close(ignored);
    for (auto at = connections_.begin(); at != connections_.end();) {
      const std::shared_ptr<Connection> left = (at++)->second.lock();  // may be the last one to hold it
      if (left) left->cut();
    }
    context_.restart();
    for (bool isDone = connections_.empty(); !isDone;) {
      try {
        context_.poll();
        isDone = true;
      } catch (const std::exception&) {  // from one handler; the others still wait
      }
    }
  }

  template <typename Do>
  void forEach(Do work) {
    const auto all = connections_;  // a copy, because some may leave
    for (const auto& [number, weak] : all) {
      if (const std::shared_ptr<Connection> connection = weak.lock()) work(*connection);
    }
  }

  void stop() {
    patience_.cancel();
    work_.reset();
  }

  void run() {
    bool accepts = true;
    while (!context_.stopped()) {
      try {
        accepts = accepts || acceptAnew();
        if (accepts) {
          context_.run();
        } else {
          context_.run_for(acceptPause);  // serves the peers that there are, or learns that the server ends
        }
      } catch (const std::exception& error) {
        // One connection failed and is lost, or memory ran out.
        accepts = false;
        say(error.what());
        std::this_thread::sleep_for(failurePause);
      }
    }
  }

  ServerOptions options_;
  std::unique_ptr<asio::ssl::context> tls_;
  Hub hub_;
  Site site_;
  std::map<std::uint64_t, std::weak_ptr<Connection>> connections_;
  std::uint64_t nextNumber_ = 0;
  std::atomic<bool> carriesWholeFrames_{true};
  bool isEnding_ = false;
  std::uint16_t port_ = 0;
  asio::io_context context_{1};  // must end before the members above, which its handlers' connections use
  tcp::acceptor acceptor_;
  asio::steady_timer pause_;
  asio::steady_timer patience_;
  asio::executor_work_guard<asio::io_context::executor_type> work_;
  std::thread thread_;
};

Server::Server(ServerOptions options) : impl_(std::make_unique<Impl>(std::move(options))) {}
Server::~Server() = default;

std::uint16_t Server::port() const {
  return impl_->port();
}

std::string Server::address() const {
  return impl_->address();
}

std::string Server::link() const {
  return impl_->link();
}

void Server::publish(FramePtr frame) {
  impl_->publish(std::move(frame));
}

bool Server::carriesWholeFrames() const {
  return impl_->carriesWholeFrames();
}

void Server::provide(FramePtr frame) {
  impl_->onThread([&hub = impl_->hub(), held = std::move(frame)] { hub.provide(held, Clock::now()); });
}

void Server::miss(Missing missing) {
  impl_->onThread([&hub = impl_->hub(), held = std::move(missing)] { hub.miss(held); });
}

bool Server::isWanted(std::uint32_t index) const {
  return impl_->ask<bool>([this, index] { return impl_->hub().isWanted(index); });
}

void Server::append(Series entries) {
  impl_->onThread([&hub = impl_->hub(), held = std::move(entries)] { hub.append(held); });
}

void Server::setPhase(Phase phase, std::string cause) {
  impl_->onThread([&hub = impl_->hub(), phase, held = std::move(cause)] { hub.setPhase(phase, held); });
}

void Server::setControls(Controls controls) {
  impl_->onThread([&hub = impl_->hub(), held = std::move(controls)] { hub.setControls(held); });
}

void Server::adopt(int descriptor) {
  impl_->adopt(descriptor);
}

ServerStatus Server::status() const {
  return impl_->ask<ServerStatus>([this] { return impl_->statusNow(); });
}

}  // namespace vdi::stream
