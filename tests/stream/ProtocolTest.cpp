// Messages: what one side writes the other reads, and nothing else.
#include <algorithm>
#include <limits>

#include "tests/Catch.h"
#include "tests/Thrown.h"
#include "tests/io/Samples.h"
#include "vdi/core/Error.h"
#include "vdi/stream/Assembly.h"
#include "vdi/stream/Http.h"
#include "vdi/stream/Protocol.h"
#include "vdi/stream/Token.h"
#include "vdi/stream/Url.h"

using namespace vdi;
using namespace vdi::stream;

namespace {

Wish everyWish() {
  Wish wish;
  wish.camera.emplace();
  wish.camera->position = {1.0, -2.0, 1e9};
  wish.camera->viewAngle = 12.5;
  wish.resolution = {1920, 1080};
  wish.supersegments = 1024;
  wish.samplingRate = 0.5;
  wish.range = {-0.5, 0.25};
  wish.preset = "X Ray";
  wish.period = 1000000;
  wish.paused = true;
  wish.parameters = {{"feed", 0.037}, {"kill", -1e-300}};
  return wish;
}

const std::vector<FromViewer>& viewerMessages() {
  static const std::vector<FromViewer> all{Hello{1, "0123456789abcdef", "session", 7U},
                                           Hello{1, "~token~.-_", std::nullopt, std::nullopt},
                                           Ack{4294967295U, 1, std::uint64_t{1} << 53U},
                                           Show{12},
                                           Pause{},
                                           Resume{},
                                           Drive{},
                                           Release{},
                                           Steer{},
                                           Steer{everyWish()}};
  return all;
}

Controls everyControl() {
  Controls controls;
  controls.generator =
      GeneratorControls{{0, 360}, 1024, std::array{-1.0, 1e300}, {"Viridis", "X Ray"}, 64.0, "X Ray"};
  controls.period = 7;
  controls.paused = true;
  controls.parameters = {{"feed", false, 0.037, 0.0, 0.1}, {"seeds_0.x-y", true, 3.0, -1.0, 1e15}};
  return controls;
}

const std::vector<FromServer>& serverMessages() {
  static const std::vector<FromServer> all{
      Welcome{1, "abc", false, std::nullopt, 3},
      Welcome{1, "abc", true, Series{{0.5, std::nullopt, -1e300}, {1, 2, std::uint64_t{1} << 60U}}, 1, 15},
      SeriesPart{4096, Series{{2.0}, {9}}},
      SeriesPart{0, Series{{2.0, 3.0}, {(std::uint64_t{1} << 53U) + 1, std::uint64_t{0} - 1}}},
      State{Phase::Waiting, 0, {}},
      State{Phase::Live, 8, {}},
      State{Phase::Ended, 1, {}},
      State{Phase::Waiting, 2, "the source doesn't answer"},
      Level{7, 1, 2, 123456789, 1921, 1081, 200, 0.125, 0.5, 3},
      Level{7, 0, 1, 1, 1, 1, 0, std::nullopt, 0.0, 0},
      Missing{3, "gone"},
      Steering{1, std::nullopt, Controls{}},
      Steering{4294967295U, 2, everyControl()},
      Denied{"viewer 2 drives"},
      Refusal{"the token is wrong"}};
  return all;
}

std::string steerWithCamera(const std::string& position, const std::string& focalPoint,
                            const std::string& angle) {
  return R"({"type":"steer","camera":{"viewUp":[0,1,0],"position":)" + position + R"(,"focalPoint":)" +
         focalPoint + R"(,"viewAngle":)" + angle + "}}";
}

std::vector<std::byte> message(const Chunk& chunk) {
  const auto head = chunkHead(chunk);
  std::vector<std::byte> bytes(head.size() + chunk.bytes.size());
  std::copy(head.begin(), head.end(), bytes.begin());
  std::copy(chunk.bytes.begin(), chunk.bytes.end(), bytes.begin() + chunkHeadBytes);
  return bytes;
}

}  // namespace

TEST_CASE("messages are read as they were written") {
  for (const FromViewer& m : viewerMessages()) CHECK(viewerMessage(textOf(m)) == m);
  for (const FromServer& m : serverMessages()) CHECK(serverMessage(textOf(m)) == m);
  CHECK(serverMessage(R"({"type":"to come","x":[1]})") == FromServer(Unknown{}));
  // Messages that another program writes.
  CHECK(serverMessage(R"({"type":"welcome","version":1,"session":"s","steer":false,"viewers":1})") ==
        FromServer(Welcome{1, "s", false, std::nullopt, 1, 0}));
  CHECK(viewerMessage(R"( {"bytes":5,"more":{"a":[1]},"level":0,"frame":2,"type":"ack"})") ==
        FromViewer(Ack{2, 0, 5}));
  CHECK(std::get<Hello>(viewerMessage(R"({"type":"hello","version":9})")).version == 9);
  Wish parallel;
  parallel.camera.emplace();
  parallel.camera->parallelProjection = true;
  parallel.camera->parallelScale = 3.0;
  CHECK(viewerMessage(textOf(FromViewer(Steer{parallel}))) == FromViewer(Steer{parallel}));
  const Level endless{1, 0, 1, 5, 1, 1, 0, std::numeric_limits<double>::quiet_NaN(), 0.0, 0};
  CHECK_FALSE(std::get<Level>(serverMessage(textOf(FromServer(endless)))).time);
}

TEST_CASE("a close frame's reason ends between characters") {
  const std::string room(123, 'a');
  CHECK(stream::closeReason(room) == room);
  CHECK(stream::closeReason(room + "b") == room);
  const std::string sign = "\u20ac";  // three bytes
  for (std::size_t before = 118; before <= 123; ++before) {
    const std::string cause = std::string(before, 'a') + sign + "b";
    const bool hasSign = before + sign.size() <= 123;
    CHECK(stream::closeReason(cause) ==
          cause.substr(0, hasSign ? std::min<std::size_t>(before + 4, 123) : before));
  }
}

TEST_CASE("messages of viewers that make no sense are refused") {
  const std::vector<std::string> bad{
      "",
      "null",
      "[]",
      "7",
      "\"hello\"",
      "{",
      "{}",
      R"({"type":null})",
      R"({"type":"hello"})",
      R"({"type":"hello","version":"1","token":"t"})",
      R"({"type":"hello","version":1,"token":5})",
      R"({"type":"hello","version":1})",
      R"({"type":"hello","version":1,"token":"t","have":-1})",
      R"({"type":"hello","version":1,"token":"t","have":4294967296})",
      R"({"type":"hello","version":1e999,"token":"t"})",
      R"({"type":"ack","frame":1,"level":0})",
      R"({"type":"ack","frame":1,"level":0,"bytes":0.5})",
      R"({"type":"ack","frame":1,"level":0,"bytes":-5})",
      R"({"type":"show"})",
      R"({"type":"show","index":null})",
      R"({"type":"welcome"})",
      R"({"type":"pause"} x)",
      R"({"type":"steer","camera":5})",
      R"({"type":"steer","camera":{"position":[0,0,1]}})",
      steerWithCamera("[0,0,1]", "[0,0,1]", "30"),
      steerWithCamera("[0,0,1]", "[0,0]", "30"),
      steerWithCamera("[0,0,1]", "[0,0,0]", "180"),
      steerWithCamera("[0,0,1e999]", "[0,0,0]", "30"),
      steerWithCamera("[0,0,\"1\"]", "[0,0,0]", "30"),
      R"({"type":"steer","resolution":[0,360]})",
      R"({"type":"steer","resolution":[640,32769]})",
      R"({"type":"steer","resolution":[640.5,360]})",
      R"({"type":"steer","resolution":[640]})",
      R"({"type":"steer","supersegments":0})",
      R"({"type":"steer","supersegments":1025})",
      R"({"type":"steer","supersegments":18446744073709551615})",
      R"({"type":"steer","sampling_rate":"2"})",
      R"({"type":"steer","sampling_rate":64.5})",
      R"({"type":"steer","sampling_rate":0.01})",
      R"({"type":"steer","sampling_rate":-1})",
      R"({"type":"steer","range":[1,1]})",
      R"({"type":"steer","range":[-1e308,1e308]})",
      R"({"type":"steer","preset":7})",
      R"({"type":"steer","period":-1})",
      R"({"type":"steer","paused":1})",
      R"({"type":"steer","parameters":[1]})",
      R"({"type":"steer","parameters":{"feed":"1"}})",
      R"({"type":"steer","parameters":{"a b":1}})",
      R"({"type":"steer","parameters":{"":1}})",
      "{\"type\":\"steer\",\"parameters\":{\"" + std::string(65, 'a') + "\":1}}",
      "{\"type\":\"steer\",\"preset\":\"" + std::string(65, 'a') + "\"}",
      R"({"type":"pause","a":[[[[1]]]]})",
      std::string(4000, '['),
      "{\"type\":\"pause\",\"a\":\"" + std::string(4096, 'a') + "\"}",
      "{\"type\":\"\xff\"}"};
  for (const std::string& m : bad) {
    INFO(m.substr(0, 80));
    CHECK(test::errorOf([&] { viewerMessage(m); }).code() == ErrorCode::Format);
  }
}

TEST_CASE("messages of servers that make no sense are refused") {
  const std::vector<std::string> bad{
      R"({"type":"welcome","version":1,"session":"s","steer":false,"series":{"times":[1],"steps":[]},"viewers":1})",
      R"({"type":"welcome","version":1,"session":"s","steer":false,"series":[],"viewers":1})",
      R"({"type":"welcome","version":1,"session":"s","steer":false,"viewers":1,"pulse":-1})",
      R"({"type":"state","state":"asleep","viewers":1})",
      R"({"type":"steering","you":1,"period":1,"paused":false})",
      R"({"type":"steering","you":1,"period":1,"paused":false,"parameters":[5]})",
      R"({"type":"steering","you":1,"period":1,"paused":false,"parameters":[{"name":"a","whole":true,"value":5,"low":0,"high":1}]})",
      R"({"type":"steering","you":1,"period":1,"paused":false,"parameters":[],"generator":{}})",
      R"({"type":"steering","you":1,"period":1,"paused":false,"parameters":[],"generator":{"resolution":[640,360],"supersegments":1025,"range":null,"presets":[]}})",
      R"({"type":"level","frame":1,"level":2,"levels":2,"bytes":1,"width":1,"height":1,"age":0,"dropped":0})",
      R"({"type":"level","frame":1,"level":0,"levels":2,"bytes":0,"width":1,"height":1,"age":0,"dropped":0})",
      R"({"type":"level","frame":1,"level":0,"levels":2,"bytes":9,"width":4294967295,"height":1,"age":0,"dropped":0})"};
  for (const std::string& m : bad) {
    INFO(m);
    CHECK(test::errorOf([&] { serverMessage(m); }).code() == ErrorCode::Format);
  }
}

TEST_CASE("levels are put together only from parts in order") {
  std::vector<std::byte> file(stream::chunkBytes + 1000);
  test::Noise noise(3);
  for (std::byte& b : file) b = static_cast<std::byte>(noise.below(256));
  const std::span<const std::byte> all(file);
  const Level level{5, 1, 2, file.size(), 10, 10, 0, 0.0, 0.0, 0};
  const auto first = message({5, 1, 0, all.first(stream::chunkBytes)});
  const auto second = message({5, 1, stream::chunkBytes, all.subspan(stream::chunkBytes)});
  const auto refuses = [](Assembly& assembly, const std::vector<std::byte>& m) {
    return test::errorOf([&] { assembly.add(m); }).code() == ErrorCode::Format;
  };
  Assembly assembly;
  CHECK(refuses(assembly, first));  // none was begun
  assembly.begin(level, file.size());
  CHECK_FALSE(assembly.add(first));
  CHECK(assembly.progress() == Ack{5, 1, stream::chunkBytes});
  CHECK(refuses(assembly, first));  // replayed
  CHECK(refuses(assembly, message({4, 1, stream::chunkBytes, all.subspan(stream::chunkBytes)})));
  CHECK(refuses(assembly, message({5, 0, stream::chunkBytes, all.subspan(stream::chunkBytes)})));
  CHECK(refuses(assembly, message({5, 1, stream::chunkBytes + 1, all.subspan(stream::chunkBytes)})));
  CHECK(refuses(assembly, message({5, 1, stream::chunkBytes, all.first(1001)})));  // beyond the end
  CHECK(refuses(assembly, {second.begin(), second.begin() + chunkHeadBytes}));
  CHECK(refuses(assembly, std::vector<std::byte>(3)));
  CHECK(refuses(assembly, std::vector<std::byte>(chunkHeadBytes + stream::chunkBytes + 1)));
  const auto whole = assembly.add(second);
  REQUIRE(whole);
  CHECK(whole->file == file);
  CHECK(whole->level == level);
  CHECK(refuses(assembly, second));
  // An abandoned level leaves nothing behind.
  assembly.begin(level, file.size());
  CHECK_FALSE(assembly.add(first));
  assembly.begin(level, file.size());
  CHECK(assembly.progress() == Ack{5, 1, 0});
  Level large = level;
  large.bytes = std::uint64_t{1} << 62U;
  CHECK(test::errorOf([&] { assembly.begin(large, file.size()); }).code() == ErrorCode::Format);
  assembly.begin(large, std::numeric_limits<std::uint64_t>::max());  // takes no memory
}

TEST_CASE("tokens") {
  const std::string token = randomToken();
  CHECK(token.size() == 64);
  CHECK(token != randomToken());
  requireToken(token, "test");
  const TokenCheck check(token);
  CHECK(check.accepts(token));
  CHECK_FALSE(check.accepts(""));
  CHECK_FALSE(check.accepts(token.substr(1)));
  CHECK_FALSE(check.accepts(token + "0"));
  std::string other = token;
  other.back() = other.back() == '0' ? '1' : '0';
  CHECK_FALSE(check.accepts(other));
  for (const std::string& bad :
       {std::string("short"), std::string(300, 'a'), std::string("sixteen letters &")}) {
    const Error error = test::errorOf([&] { requireToken(bad, "here"); });
    CHECK(error.code() == ErrorCode::InvalidArgument);
    CHECK(std::string(error.what()).find(bad) == std::string::npos);
  }
}

TEST_CASE("links") {
  const Url url = parseUrl("http://node7:8080/#token=abc&camera=1,2");
  CHECK(url.host == "node7");
  CHECK(url.port == 8080);
  CHECK(url.token == "abc");
  CHECK_FALSE(url.isEncrypted);
  CHECK(parseUrl("https://host").port == 443);
  CHECK(parseUrl("http://host#camera=1&token=xyz").token == "xyz");
  CHECK(parseUrl("http://[::1]:99/").host == "::1");
  CHECK(parseUrl("http://[::1]:99/").authority() == "[::1]:99");
  CHECK(parseUrl("http://h:80/#token=a").streamTarget() == "/stream");
  CHECK(parseUrl("http://h").streamTarget() == "/stream");
  for (const char* const folder :
       {"https://h/user/ada/proxy/8080/#token=abc", "https://h/user/ada/proxy/8080#token=abc"}) {
    CHECK(parseUrl(folder).streamTarget() == "/user/ada/proxy/8080/stream");
    CHECK(parseUrl(folder).token == "abc");
    CHECK(parseUrl(folder).host == "h");
  }
  CHECK(parseUrl("https://h/a/?lab=1&x=/#token=abc").streamTarget() == "/a/stream?lab=1&x=/");
  CHECK(parseUrl("https://h?lab=1#token=abc").streamTarget() == "/stream?lab=1");
  for (const std::string bad :
       {"", "host:80", "ftp://h/", "http://", "http://:80/", "http://h:0/", "http://h:66000/",
        "http://h:8x/#token=secret", "http://h:0/?token=secret", "http://h/a b#token=secret",
        "http://h/a\r\nX: y#token=secret", "http://h/?a b", "http://[::1/"}) {
    INFO(bad);
    const Error error = test::errorOf([&] { parseUrl(bad); });
    CHECK(error.code() == ErrorCode::InvalidArgument);
    CHECK(std::string(error.what()).find("secret") == std::string::npos);
  }
}

TEST_CASE("targets of requests") {
  CHECK(pathOf("/?a=b") == "/");
  CHECK(pathOf("/stream?a") == "/stream");
  CHECK(pathOf("/a") == "/a");
  CHECK(queryField("/stream?x=1&origin=https%3A%2F%2Fa.example&y", "origin") == "https://a.example");
  CHECK(queryField("/stream?origin=%", "origin") == "%");
  CHECK(queryField("/stream?origin=%4", "origin") == "%4");
  CHECK(queryField("/stream?origins=1", "origin").empty());
  CHECK(queryField("/stream", "origin").empty());
  CHECK(queryField("", "origin").empty());
}

TEST_CASE("the page's scripts are named by their digests") {
  CHECK(scriptSources("<p>none</p>") == "'none'");
  // printf 'alert(1)' | openssl dgst -sha256 -binary | base64
  const std::string one = "'sha256-bhHHL3z2vDgxUt0W3dWQOrprscmda2Y5pLsLg4GF+pI='";
  CHECK(scriptSources("<script>alert(1)</script>") == one);
  CHECK(scriptSources("a<script type=\"module\">alert(1)</script><script>alert(1)</script>b") ==
        one + " " + one);
  CHECK(scriptSources("<script>alert(1)") == "'none'");
}
