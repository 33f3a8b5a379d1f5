#include "vdi/stream/Client.h"

#include <algorithm>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <string_view>
#include <thread>
#include <utility>
#include <variant>

#include "vdi/core/Error.h"
#include "vdi/stream/Line.h"

namespace vdi::stream {

namespace {

namespace asio = boost::asio;

constexpr std::chrono::milliseconds firstPause{250};
constexpr std::chrono::milliseconds longestPause{5000};
constexpr std::chrono::seconds longestEnd{2};
/// Limits that a server doesn't reach if it waits for acknowledgements.
constexpr std::uint64_t mostAhead = std::uint64_t{32} << 20;  // bytes, in addition to a whole level
constexpr std::size_t mostWaiting = 65536;
constexpr std::size_t longestSeries = std::size_t{1} << 20;

}  // namespace

class Client::Impl {
 public:
  explicit Impl(ClientOptions options) : options_(std::move(options)) {
    if (options_.url.isEncrypted) prepareTls();
    standing_.since = std::chrono::steady_clock::now();
    asio::post(context_, [this] { connect(); });
    thread_ = std::thread([this] { run(); });
  }

  ~Impl() {
    asio::post(context_, [this] {
      isEnding_ = true;
      pause_.cancel();
      if (!line_) {
        context_.stop();
        return;
      }
      work_.reset();
      end_.expires_after(longestEnd);
      end_.async_wait([this](boost::system::error_code error) {
        if (!error) context_.stop();  // the destructor must not wait any longer
      });
      line_->close();
    });
    thread_.join();
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  std::optional<Received> next(std::chrono::milliseconds timeout) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, timeout, [this] { return !wholes_.empty() || failure_; });
    if (!wholes_.empty()) {
      Whole whole = std::move(wholes_.front());
      wholes_.pop_front();
      waitingBytes_ -= whole.received.level.bytes;
      const Level& level = whole.received.level;
      const Ack ack{level.frame, level.level, level.bytes};
      asio::post(context_, [this, ack, connection = whole.connection] {
        if (connection == connection_) send(ack);
      });
      return std::move(whole.received);
    }
    if (failure_) throw Error(*failure_);
    return std::nullopt;
  }

  Standing standing() const {
    const std::scoped_lock lock(mutex_);
    return standing_;
  }

  Series seriesFrom(std::size_t from) const {
    const std::scoped_lock lock(mutex_);
    const auto first = static_cast<std::ptrdiff_t>(std::min(from, series_.size()));
    return {{series_.times.begin() + first, series_.times.end()},
            {series_.steps.begin() + first, series_.steps.end()}};
  }

  void show(std::optional<std::uint32_t> index) {
    asio::post(context_, [this, index] {
      shown_ = index;
      isPaused_ = false;
      if (index) {
        askForShown(0);
      } else {
        send(Resume{});
      }
    });
  }

  void pause() {
    asio::post(context_, [this] {
      isPaused_ = true;
      send(Pause{});
    });
  }

 private:
  struct Whole {
    Received received;
    std::uint64_t connection;
  };

  void prepareTls() {
    tls_.set_default_verify_paths();
    if (options_.authority.empty()) return;
    boost::system::error_code error;
    tls_.load_verify_file(options_.authority.string(), error);
    if (error)
      throw Error(ErrorCode::Io, "can't use the certificates: " + error.message(),
                  options_.authority.string());
  }

  Assembly newAssembly() const {
    return Assembly(options_.decodes ? Assembly::Gives::Vdis : Assembly::Gives::Files);
  }

  std::string name() const { return options_.command.empty() ? options_.url.authority() : "the command"; }

  void run() {
    for (bool done = false; !done;) {
      try {
        context_.run();
        done = true;
      } catch (const std::exception& error) {
        fail(ErrorCode::Communication, error.what());
      }
    }
  }

  template <typename Change>
  void change(Change change) {
    const std::scoped_lock lock(mutex_);
    change();
    changed_.notify_all();
  }

  void connect() {
    if (isEnding_) return;
    ++connection_;
    cause_.clear();
    assembly_ = newAssembly();
    LineEvents events{
        [this] { sayHello(); }, [this](std::string_view text) { guarded([&] { take(text); }); },
        [this](std::span<const std::byte> message) { guarded([&] { take(message); }); },
        [this](std::uint16_t code, const std::string& why, bool isFinal) { lose(code, why, isFinal); }};
    if (!options_.command.empty()) {
      line_ = commandLine(context_, options_.command, std::move(events));
    } else {
      line_ = line(context_, options_.url.isEncrypted ? &tls_ : nullptr, options_.url, std::move(events));
    }
    line_->start();
  }

  void sayHello() {
    isWelcome_ = false;
    Hello hello;
    hello.token = line_->token();
    if (!session_.empty() && have_) {
      hello.session = session_;
      hello.have = have_;
    }
    line_->send(textOf(FromViewer(hello)));
  }

  void send(const FromViewer& message) {
    if (line_ && isWelcome_) line_->send(textOf(message));
  }

  /// Asks for the wanted frame if it is an entry of the series, at index `from` or later. A restarted server
  /// may still be listing its files, and disconnects viewers that ask for frames that it hasn't listed.
  void askForShown(std::size_t from) {
    if (shown_ && *shown_ >= from && *shown_ < series_.size()) send(Show{*shown_});
  }

  /// Runs `work`, which handles a message of the server. An error in `work` makes this client fail.
  template <typename Work>
  void guarded(Work work) {
    try {
      work();
    } catch (const Error& error) {
      fail(error.code(), name() + ": " + error.what());
      line_->close();
    }
  }

  void take(std::string_view text) {
    const FromServer message = serverMessage(text);
    std::visit([this](const auto& m) { take(m); }, message);
  }
  void take(const Welcome& welcome) {
    if (welcome.version != protocolVersion)
      throw Error(ErrorCode::Format, "the server uses another protocol version");
    isWelcome_ = true;
    wait_ = firstPause;
    const bool isOther = session_ != welcome.session;
    if (isOther) have_.reset();
    session_ = welcome.session;
    change([&] {
      standing_.isConnected = true;
      standing_.since = std::chrono::steady_clock::now();
      standing_.session = session_;
      standing_.hasState = false;
      if (isOther) standing_.hasBeenLive = false;
      standing_.series = welcome.series ? std::optional(welcome.series->size()) : std::nullopt;
      series_ = welcome.series.value_or(Series());
    });
    askForShown(0);
    if (isPaused_) send(Pause{});
  }
  void take(const SeriesPart& part) {
    if (part.from != series_.size() || part.from + part.entries.size() > longestSeries)
      throw Error(ErrorCode::Format, "a part of a series is out of order, or it is too long");
    change([&] {
      series_.times.insert(series_.times.end(), part.entries.times.begin(), part.entries.times.end());
      series_.steps.insert(series_.steps.end(), part.entries.steps.begin(), part.entries.steps.end());
      standing_.series = series_.size();
    });
    askForShown(part.from);
  }
  void take(const State& state) {
    change([&] {
      standing_.state = state;
      standing_.hasState = true;
      if (state.phase == Phase::Live) standing_.hasBeenLive = true;
    });
  }
  void take(const Level& level) {
    assembly_.begin(level, options_.mostLevelBytes);
    acknowledged_ = 0;
  }
  void take(const Missing& missing) {
    Received none;
    none.level.frame = missing.frame;
    none.missing = missing.cause;
    none.session = session_;
    keep(std::move(none));
  }
  void take(const Refusal& refusal) { cause_ = refusal.cause; }
  static void take(const Steering&) {}  // this viewer doesn't drive
  static void take(const Denied&) {}
  static void take(const Unknown&) {}
  void take(std::span<const std::byte> message) {
    std::optional<Received> whole = assembly_.add(message);
    if (whole) {
      const Level& level = whole->level;
      if (level.level + 1 == level.levels) have_ = level.frame;
      whole->session = session_;
      keep(*std::move(whole));
      return;
    }
    const std::optional<Ack> progress = assembly_.progress();
    if (progress && progress->bytes - acknowledged_ >= ackBytes) {
      acknowledged_ = progress->bytes;
      send(*progress);
    }
  }

  /// Keeps a level for next(), within bounds.
  void keep(Received received) {
    const std::uint64_t bytes = received.level.bytes;
    change([&] {
      const bool isTooMuch =
          wholes_.size() >= mostWaiting ||
          (!wholes_.empty() && waitingBytes_ + bytes > options_.mostLevelBytes + mostAhead);
      if (isTooMuch) throw Error(ErrorCode::Format, "the server doesn't wait for acknowledgements");
      wholes_.push_back({std::move(received), connection_});
      waitingBytes_ += bytes;
    });
  }

  void lose(std::uint16_t code, const std::string& why, bool isFinal) {
    line_.reset();
    end_.cancel();
    isWelcome_ = false;
    const std::string trouble = cause_.empty() ? why : cause_;
    change([&] {
      if (standing_.isConnected) standing_.since = std::chrono::steady_clock::now();
      standing_.isConnected = false;
      standing_.trouble = trouble;
    });
    const auto close = static_cast<Close>(code);
    if (close == Close::WrongToken) fail(ErrorCode::InvalidArgument, name() + ": " + trouble);
    if (close == Close::OtherVersion || close == Close::BadMessage)
      fail(ErrorCode::Format, name() + ": " + trouble);
    if (isFinal) fail(ErrorCode::Io, trouble);
    if (isEnding_) context_.stop();
    if (isEnding_ || hasFailed_) return;
    if (options_.log && trouble != said_) options_.log(trouble);
    said_ = trouble;
    pause_.expires_after(wait_);
    pause_.async_wait([this](boost::system::error_code error) {
      if (!error) connect();
    });
    wait_ = std::min(2 * wait_, longestPause);
  }

  /// Makes the client fail for good: another attempt would be of no use.
  void fail(ErrorCode code, const std::string& what) {
    if (std::exchange(hasFailed_, true)) return;
    change([&] { failure_.emplace(code, what); });
  }

  const ClientOptions options_;

  mutable std::mutex mutex_;  // guards the next six members
  std::condition_variable changed_;
  std::deque<Whole> wholes_;
  std::uint64_t waitingBytes_ = 0;  // of wholes_
  Standing standing_;
  Series series_;  // only the thread changes it
  std::optional<Error> failure_;

  // The rest belongs to the thread.
  asio::io_context context_{1};
  asio::executor_work_guard<asio::io_context::executor_type> work_{context_.get_executor()};
  asio::steady_timer pause_{context_};
  asio::steady_timer end_{context_};
  asio::ssl::context tls_{asio::ssl::context::tls_client};
  std::shared_ptr<Line> line_;
  Assembly assembly_ = newAssembly();
  std::uint64_t connection_ = 0;
  std::uint64_t acknowledged_ = 0;  // of the level under way
  std::string session_;
  std::optional<std::uint32_t> have_;
  std::optional<std::uint32_t> shown_;
  std::string cause_;  // given by the server
  std::string said_;
  std::chrono::milliseconds wait_ = firstPause;
  bool isPaused_ = false;
  bool isWelcome_ = false;
  bool isEnding_ = false;
  bool hasFailed_ = false;
  std::thread thread_;
};

Client::Client(ClientOptions options) : impl_(std::make_unique<Impl>(std::move(options))) {}
Client::~Client() = default;

std::optional<Received> Client::next(std::chrono::milliseconds timeout) {
  return impl_->next(timeout);
}

Client::Standing Client::standing() const {
  return impl_->standing();
}

Series Client::seriesFrom(std::size_t from) const {
  return impl_->seriesFrom(from);
}

void Client::show(std::uint32_t index) {
  impl_->show(index);
}

void Client::pause() {
  impl_->pause();
}

void Client::resume() {
  impl_->show(std::nullopt);
}

}  // namespace vdi::stream
