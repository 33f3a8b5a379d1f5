// Damaged, reordered and invented messages, in both directions: texts, conversations, and bytes on a real
// connection. Each must be refused with Error{Format}, or the connection closed; nothing else may happen.
// Each case has the same data in every run, for two seconds. With VDI_FUZZ_SECONDS=600 it goes on
// with other data for that time. The test is meant to run under sanitizers.
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/websocket/stream.hpp>
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "tests/Catch.h"
#include "tests/FuzzTime.h"
#include "tests/io/Samples.h"
#include "vdi/core/Error.h"
#include "vdi/io/VdiFile.h"
#include "vdi/stream/Assembly.h"
#include "vdi/stream/Client.h"
#include "vdi/stream/Protocol.h"
#include "vdi/stream/Server.h"
#include "vdi/stream/Viewer.h"

using namespace vdi;
using namespace vdi::stream;

namespace {

using namespace std::chrono_literals;
using test::Noise;

const std::string token(32, 't');
constexpr std::size_t mebibyte = std::size_t{1} << 20;
constexpr double usualSeconds = 2.0;

/// Bytes of a message, with up to four changes.
std::string changed(std::string bytes, Noise& noise) {
  static const std::vector<std::string> pieces{"-1",
                                               "1e999",
                                               "18446744073709551616",
                                               "4294967295",
                                               "9007199254740993",
                                               "0.5",
                                               "null",
                                               "true",
                                               "\"\"",
                                               "[]",
                                               "{}",
                                               "[[[[[[",
                                               "{\"a\":{",
                                               "\\u0000",
                                               ",",
                                               "\"",
                                               "\xff",
                                               ":",
                                               "\"type\":\"ack\"",
                                               "\"levels\"",
                                               "\\ud800"};
  const std::uint32_t changes = noise.below(5);
  for (std::uint32_t i = 0; i < changes; ++i) {
    const std::size_t at = noise.below(static_cast<std::uint32_t>(bytes.size()) + 1);
    const std::size_t count = std::min<std::size_t>(noise.below(12), bytes.size() - at);
    const std::string& piece = pieces[noise.below(static_cast<std::uint32_t>(pieces.size()))];
    switch (noise.below(6)) {
      case 0:
        if (at < bytes.size()) bytes[at] = static_cast<char>(bytes[at] ^ (1 << noise.below(8)));
        break;
      case 1:
        bytes.erase(at, count);
        break;
      case 2:
        bytes.insert(at, piece);
        break;
      case 3:
        bytes.insert(at, bytes.substr(at, count));
        break;
      case 4:
        bytes.resize(at);
        break;
      default: {  // in place of a value
        const std::size_t colon = bytes.find(':', at);
        if (colon == std::string::npos) break;
        const std::size_t end = std::min(bytes.find_first_of(",}]", colon), bytes.size());
        bytes.replace(colon + 1, end - colon - 1, piece);
      }
    }
  }
  return bytes;
}

Controls controls() {
  Controls result;
  result.generator =
      GeneratorControls{{640, 360}, 25, std::array{0.0, 0.5}, {"X Ray", "Cool to Warm"}, 0.0, {}};
  result.parameters = {{"feed", false, 0.03, 0.0, 0.1}, {"steps", true, 3.0, 1.0, 9.0}};
  return result;
}

/// A driving viewer's request. Some of it is out of bounds.
Wish wishOf(Noise& noise) {
  const auto chance = [&noise] { return noise.below(3) == 0; };
  Wish wish;
  if (chance()) {
    wish.camera.emplace();
    wish.camera->position = {noise.unit(), noise.unit(), 2.0 + noise.unit()};
    wish.camera->parallelProjection = chance();
  }
  if (chance()) wish.resolution = {static_cast<int>(1 + noise.below(2000)), 360};
  if (chance()) wish.supersegments = 1 + static_cast<int>(noise.below(30));
  if (chance()) wish.samplingRate = chance() ? 0.0 : 0.5 + 32.0 * noise.unit();
  if (chance()) wish.range = {noise.unit() - 1.0, noise.unit() + 1e-3};
  if (chance()) wish.preset = chance() ? "none" : "X Ray";
  if (chance()) wish.period = 1 + static_cast<int>(noise.below(20));
  if (chance()) wish.paused = chance();
  if (chance()) wish.parameters["feed"] = 0.15 * noise.unit();
  if (chance()) wish.parameters["steps"] = noise.below(12);
  return wish;
}

FromViewer viewersMessage(Noise& noise) {
  switch (noise.below(14)) {
    case 0: {
      Hello hello;
      hello.token = noise.below(8) == 0 ? "wrong" : token;
      if (noise.below(2) == 0) hello.session = "0123";
      if (noise.below(2) == 0) hello.have = noise.bits();
      return hello;
    }
    case 1:
      return Show{noise.below(5)};
    case 2:
      return Pause{};
    case 3:
      return Resume{};
    case 4:
    case 5:
      return Drive{};
    case 6:
      return Release{};
    case 7:
    case 8:
    case 9:
      return Steer{wishOf(noise)};
    default:
      return Ack{noise.below(50), noise.below(3), noise.bits()};
  }
}

/// The parsed message; nullopt if it is refused. A parsed message must survive another writing and parsing.
template <typename Message, typename Parse>
std::optional<Message> understood(const std::string& text, Parse parse) {
  std::optional<Message> message;
  try {
    message = parse(text);
  } catch (const Error& error) {
    REQUIRE(error.code() == ErrorCode::Format);
    return std::nullopt;
  }
  REQUIRE(parse(textOf(*message)) == *message);
  return message;
}

std::shared_ptr<const EncodedLevel> levelOf(int width, std::uint64_t seed) {
  return std::make_shared<EncodedLevel>(
      EncodedLevel{io::encode(test::noisyVdi(width, width / 2, 6, seed)), width, width / 2});
}

FramePtr frameOf(std::uint32_t id) {
  auto frame = std::make_shared<Frame>();
  frame->id = id;
  frame->levelCount = 2;
  frame->levels = {levelOf(12, id + 1), levelOf(40, id + 1)};
  return frame;
}

Series seriesOf(std::size_t frames) {
  Series series;
  series.times.assign(frames, 0.25);
  series.steps.assign(frames, 7);
  return series;
}

struct Message {
  bool isText;
  std::string bytes;
};

/// All messages from a server to a viewer to which it sends a few frames.
std::vector<Message> conversation() {
  Hub::Options options;
  options.token = token;
  options.mostViewers = 1;
  options.show = [](std::uint32_t) {};
  options.steer = [](std::uint32_t, const Wish&) {};
  Hub hub(options);
  hub.setControls(controls());
  hub.append(seriesOf(3));
  Viewer viewer(hub, [] {});
  Hello hello;
  hello.token = token;
  viewer.receive(textOf(FromViewer(hello)), Clock::now());
  std::vector<Message> messages;
  for (std::uint32_t id = 0; id < 3; ++id) {
    hub.publish(frameOf(id), Clock::now());
    if (id == 1) hub.append(seriesOf(2));
    for (bool goesOn = true; goesOn;) {
      const Viewer::Outgoing next = viewer.next(Clock::now());
      if (const auto* const text = std::get_if<std::string>(&next)) {
        messages.push_back({true, *text});
      } else if (const auto* const part = std::get_if<Viewer::Binary>(&next)) {
        std::string bytes(reinterpret_cast<const char*>(part->head.data()), part->head.size());
        bytes.append(reinterpret_cast<const char*>(part->bytes.data()), part->bytes.size());
        messages.push_back({false, bytes});
      } else {
        goesOn = false;
      }
    }
  }
  return messages;
}

/// Messages changed, left out, repeated or in another order.
std::vector<Message> changed(std::vector<Message> messages, Noise& noise) {
  const std::uint32_t changes = 1 + noise.below(3);
  for (std::uint32_t i = 0; i < changes && !messages.empty(); ++i) {
    const std::size_t at = noise.below(static_cast<std::uint32_t>(messages.size()));
    const std::size_t other = noise.below(static_cast<std::uint32_t>(messages.size()));
    const auto place = messages.begin() + static_cast<std::ptrdiff_t>(at);
    switch (noise.below(8)) {
      case 0:
        messages.erase(place);
        break;
      case 1: {
        const Message copy = messages[other];
        messages.insert(place, copy);
        break;
      }
      case 2:
        std::swap(messages[at], messages[other]);
        break;
      case 3:
        messages[at].isText = !messages[at].isText;
        break;
      default:
        messages[at].bytes = changed(std::move(messages[at].bytes), noise);
    }
  }
  return messages;
}

std::vector<std::byte> bytesOf(const std::string& text) {
  std::vector<std::byte> bytes(text.size());
  std::transform(text.begin(), text.end(), bytes.begin(), [](char c) { return static_cast<std::byte>(c); });
  return bytes;
}

/// A WebSocket's frame as a viewer sends it.
std::string masked(unsigned char opcode, const std::string& payload, Noise& noise) {
  std::string frame(1, static_cast<char>(0x80U | opcode));
  if (payload.size() < 126) {
    frame += static_cast<char>(0x80U | payload.size());
  } else {
    frame += static_cast<char>(0x80U | 126U);
    frame += static_cast<char>(payload.size() >> 8U);
    frame += static_cast<char>(payload.size() & 0xffU);
  }
  const std::string mask{static_cast<char>(noise.bits()), static_cast<char>(noise.bits()),
                         static_cast<char>(noise.bits()), static_cast<char>(noise.bits())};
  frame += mask;
  for (std::size_t i = 0; i < payload.size(); ++i)
    frame += static_cast<char>(payload[i] ^ mask[i % mask.size()]);
  return frame;
}

/// The bytes that a viewer writes to its connection.
std::string viewersBytes(Noise& noise) {
  const std::string request =
      "GET /stream HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
      "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n"
      "Sec-WebSocket-Protocol: pv-vdi.1\r\n\r\n";
  std::string bytes = noise.below(4) == 0 ? changed(request, noise) : request;
  Hello hello;
  hello.token = token;
  bytes += masked(1, textOf(FromViewer(hello)), noise);
  const std::uint32_t count = noise.below(6);
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::string frame = masked(noise.below(6) == 0 ? static_cast<unsigned char>(noise.below(16)) : 1,
                                     changed(textOf(viewersMessage(noise)), noise), noise);
    bytes += noise.below(3) == 0 ? changed(frame, noise) : frame;
  }
  return bytes;
}

}  // namespace

TEST_CASE("damaged messages of viewers harm nobody") {
  constexpr std::uint64_t limit = 3 * mebibyte;
  std::vector<FramePtr> frames;
  for (std::uint32_t id = 0; id < 50; ++id) frames.push_back(frameOf(id));
  Hub::Options options;
  options.token = token;
  options.mostViewers = 5;
  options.mostHeldBytes = limit;
  options.show = [](std::uint32_t) {};
  std::uint64_t sent = 0;
  std::uint64_t refused = 0;
  std::uint64_t steered = 0;
  options.steer = [&steered](std::uint32_t, const Wish& wish) {
    REQUIRE(objectionTo(wish, controls()).empty());
    ++steered;
  };
  const test::FuzzTime time(usualSeconds);
  for (std::uint64_t seed = test::fuzzSeed(); !time.isOver(); ++seed) {
    Noise noise(seed);
    Hub hub(options);
    hub.setControls(controls());
    hub.append(seriesOf(4));
    Clock::time_point now = Clock::now();
    std::vector<std::unique_ptr<Viewer>> viewers;
    for (int step = 0; step < 200; ++step) {
      now += std::chrono::milliseconds(noise.below(100));
      if (viewers.empty() || noise.below(10) == 0) {
        viewers.push_back(std::make_unique<Viewer>(hub, [] {}));
        Hello hello;
        hello.token = token;
        viewers.back()->receive(changed(textOf(FromViewer(hello)), noise), now);
      }
      if (noise.below(8) == 0) hub.publish(frames[noise.below(50)], now);
      if (noise.below(8) == 0) hub.provide(frames[noise.below(4)], now);
      if (noise.below(30) == 0) hub.miss({noise.below(5), "gone"});
      const std::size_t which = noise.below(static_cast<std::uint32_t>(viewers.size()));
      Viewer& viewer = *viewers[which];
      const std::string sound = textOf(viewersMessage(noise));
      const std::string text = noise.below(3) == 0 ? sound : changed(sound, noise);
      if (!understood<FromViewer>(text, viewerMessage)) ++refused;
      (void)understood<FromServer>(text, serverMessage);  // nor does what comes from the wrong side
      viewer.receive(text, now);
      bool isGone = noise.below(40) == 0;
      for (std::uint32_t i = noise.below(8); i > 0 && !isGone; --i) {
        const Viewer::Outgoing next = viewer.next(now);
        if (const auto* const part = std::get_if<Viewer::Binary>(&next)) {
          const std::byte* const begin = part->level->bytes.data();
          REQUIRE(part->bytes.data() >= begin);
          REQUIRE(part->bytes.data() + part->bytes.size() <= begin + part->level->bytes.size());
          sent += part->bytes.size();
        } else if (const auto* const said = std::get_if<std::string>(&next)) {
          REQUIRE(understood<FromServer>(*said, serverMessage));
        }
        isGone = std::holds_alternative<Viewer::Farewell>(next);
      }
      if (isGone) viewers.erase(viewers.begin() + static_cast<std::ptrdiff_t>(which));
      REQUIRE(hub.viewerCount() <= options.mostViewers);
      REQUIRE(hub.heldBytes() <= limit);
    }
  }
  CHECK(sent > mebibyte);
  CHECK(refused > 1000);
  CHECK(steered > 0);
}

TEST_CASE("damaged messages of a server give whole levels or an error") {
  const std::vector<Message> good = conversation();
  // Texts that the conversation doesn't have.
  const std::array<FromServer, 3> others{Missing{3, "gone"}, Denied{"viewer 2 drives"},
                                         Refusal{"the token is wrong"}};
  std::uint64_t wholes = 0;
  std::uint64_t refused = 0;
  const test::FuzzTime time(usualSeconds);
  for (std::uint64_t seed = test::fuzzSeed(); !time.isOver(); ++seed) {
    Noise noise(seed);
    (void)understood<FromServer>(changed(textOf(others[noise.below(3)]), noise), serverMessage);
    Assembly assembly;
    try {
      for (const Message& message : changed(good, noise)) {
        if (message.isText) {
          (void)understood<FromViewer>(message.bytes, viewerMessage);
          const auto news = understood<FromServer>(message.bytes, serverMessage);
          if (!news) throw Error(ErrorCode::Format, "no message");
          if (const auto* const level = std::get_if<Level>(&*news)) assembly.begin(*level, 64 * mebibyte);
          continue;
        }
        const std::optional<Received> whole = assembly.add(bytesOf(message.bytes));
        if (!whole) continue;
        REQUIRE(whole->file.size() == whole->level.bytes);
        (void)io::decode(whole->file);
        ++wholes;
      }
    } catch (const Error& error) {
      REQUIRE(error.code() == ErrorCode::Format);
      ++refused;
    }
  }
  CHECK(wholes > 100);
  CHECK(refused > 100);
}

TEST_CASE("damaged bytes on a connection end only that connection") {
  ServerOptions options;
  options.listens = false;
  options.token = token;
  options.show = [](std::uint32_t) {};
  Server server(options);
  server.append(seriesOf(3));
  server.publish(frameOf(2));
  std::uint64_t answers = 0;
  std::uint64_t rounds = 0;
  for (const test::FuzzTime time(usualSeconds); !time.isOver(); ++rounds) {
    Noise noise(test::fuzzSeed() + rounds);
    std::array<int, 2> ends{};
    REQUIRE(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) == 0);
    server.adopt(ends[1]);
    const std::string bytes = viewersBytes(noise);
    for (std::size_t at = 0; at < bytes.size();) {
      const std::size_t count = std::min<std::size_t>(bytes.size() - at, 1 + noise.below(600));
      const ssize_t written = ::send(ends[0], bytes.data() + at, count, MSG_NOSIGNAL);
      if (written <= 0) break;  // it has closed the connection
      at += static_cast<std::size_t>(written);
    }
    ::shutdown(ends[0], SHUT_WR);
    std::array<char, 65536> buffer{};
    bool hasAnswered = false;
    while (::read(ends[0], buffer.data(), buffer.size()) > 0) hasAnswered = true;
    ::close(ends[0]);
    answers += hasAnswered ? 1 : 0;
  }
  CHECK(rounds > 50);
  CHECK(answers > rounds / 2);
  const auto end = Clock::now() + 20s;
  while (server.status().viewers > 0 && Clock::now() < end) std::this_thread::sleep_for(10ms);
  CHECK(server.status().viewers == 0);
}

TEST_CASE("a server that sends damaged messages ends a client with one error") {
  namespace websocket = boost::beast::websocket;
  using boost::asio::ip::tcp;
  const std::vector<Message> good = conversation();
  boost::asio::io_context context;
  tcp::acceptor acceptor(context, tcp::endpoint(boost::asio::ip::make_address("127.0.0.1"), 0));
  ClientOptions options;
  options.url = parseUrl("http://127.0.0.1:" + std::to_string(acceptor.local_endpoint().port()) + "/");
  options.url.token = token;
  options.mostLevelBytes = 64 * mebibyte;
  std::uint64_t wholes = 0;
  std::uint64_t refused = 0;
  std::uint64_t lost = 0;
  const test::FuzzTime time(usualSeconds);
  for (std::uint64_t seed = test::fuzzSeed(); !time.isOver(); ++seed) {
    Noise noise(seed);
    Client client(options);
    websocket::stream<tcp::socket> socket(acceptor.accept());
    socket.set_option(websocket::stream_base::decorator([](websocket::response_type& response) {
      response.set(boost::beast::http::field::sec_websocket_protocol, subprotocol);
    }));
    boost::beast::error_code error;
    socket.accept(error);
    REQUIRE_FALSE(error);
    boost::beast::flat_buffer hello;
    socket.read(hello, error);
    for (const Message& message : changed(good, noise)) {
      socket.text(message.isText);
      if (error) break;
      socket.write(boost::asio::buffer(message.bytes), error);
    }
    // Bytes that are no message, or an end in the middle of one.
    const std::string rest(noise.below(20), static_cast<char>(noise.bits()));
    boost::asio::write(socket.next_layer(), boost::asio::buffer(rest), error);
    socket.next_layer().close(error);
    try {
      const auto end = Clock::now() + 20s;
      while (client.standing().trouble.empty() && Clock::now() < end) {
        if (client.next(1ms)) ++wholes;
      }
      REQUIRE_FALSE(client.standing().trouble.empty());
      while (client.next(0ms)) ++wholes;
      ++lost;
    } catch (const Error& failure) {
      REQUIRE(failure.code() == ErrorCode::Format);
      ++refused;
    }
  }
  CHECK(wholes > 10);
  CHECK(refused > 10);
  CHECK(lost > 0);
}
