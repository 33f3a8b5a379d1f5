#include "vdi/stream/Protocol.h"

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>

#include "vdi/io/Json.h"
#include "vdi/io/JsonText.h"
#include "vdi/stream/SteeringJson.h"

namespace vdi::stream {

static_assert(std::endian::native == std::endian::little, "chunk heads are copied as they lie in memory");

namespace {

using io::jsonFlag;
using io::jsonListOf;
using io::JsonObject;
using io::jsonOf;
using io::JsonValue;

JsonValue parsed(std::string_view text, std::size_t mostBytes) {
  constexpr std::size_t depth = 3;  // object, series, times
  return io::parseJson(text, "a message", {.bytes = mostBytes, .depth = depth});
}

template <typename Integer>
Integer countIn(const JsonValue& value) {
  // JavaScript writes whole numbers up to 2^53 without a point.
  return static_cast<Integer>(value.count(std::numeric_limits<Integer>::max()));
}

/// Reads the fields of a message.
class Fields {
 public:
  explicit Fields(const JsonValue& object) : object_(object) {}

  const std::string& text(const char* name) const { return object_.at(name).text(); }
  template <typename Integer = std::uint32_t>
  Integer count(const char* name) const {
    return countIn<Integer>(object_.at(name));
  }
  template <typename Integer = std::uint32_t>
  std::optional<Integer> countIfAny(const char* name) const {
    const std::optional<JsonValue> value = object_.findUnlessNull(name);
    return value ? std::optional(countIn<Integer>(*value)) : std::nullopt;
  }
  /// "times" and "steps" of the object.
  Series series() const {
    const std::vector<JsonValue> times = object_.at("times").items();
    const std::vector<JsonValue> steps = object_.at("steps").items();
    if (times.size() != steps.size()) refuse("\"times\" and \"steps\" must be arrays of equal length");
    Series series;
    for (const JsonValue& time : times)
      series.times.push_back(time.isNull() ? std::nullopt : std::optional(time.number()));
    for (const JsonValue& step : steps) series.steps.push_back(countIn<std::uint64_t>(step));
    return series;
  }

 private:
  const JsonValue& object_;
};

std::string numberOrNull(const std::optional<double>& value) {
  return value && std::isfinite(*value) ? jsonOf(*value) : "null";
}

template <typename Number>
std::string countOrNull(const std::optional<Number>& value) {
  return value ? jsonOf(*value) : "null";
}

JsonObject messageOf(const char* type) {
  JsonObject message;
  message.add("type", jsonOf(type));
  return message;
}

void addSeries(JsonObject& object, const Series& series) {
  std::vector<std::string> times;
  times.reserve(series.times.size());
  for (const std::optional<double>& time : series.times) times.push_back(numberOrNull(time));
  std::vector<std::string> steps;
  steps.reserve(series.steps.size());
  for (const std::uint64_t step : series.steps) steps.push_back(jsonOf(step));
  object.add("times", jsonListOf(times)).add("steps", jsonListOf(steps));
}

Phase phaseOf(const std::string& name) {
  for (const Phase phase : {Phase::Waiting, Phase::Live, Phase::Ended}) {
    if (name == toString(phase)) return phase;
  }
  refuse("\"state\" is none of waiting, live and ended");
}

JsonObject objectOf(const Hello& hello) {
  JsonObject message = messageOf("hello");
  message.add("version", jsonOf(hello.version)).add("token", jsonOf(hello.token));
  message.add("session", hello.session ? jsonOf(*hello.session) : "null");
  message.add("have", countOrNull(hello.have));
  return message;
}
JsonObject objectOf(const Ack& ack) {
  JsonObject message = messageOf("ack");
  message.add("frame", jsonOf(ack.frame)).add("level", jsonOf(ack.level)).add("bytes", jsonOf(ack.bytes));
  return message;
}
JsonObject objectOf(const Show& show) {
  JsonObject message = messageOf("show");
  message.add("index", jsonOf(show.index));
  return message;
}
JsonObject objectOf(const Pause&) {
  return messageOf("pause");
}
JsonObject objectOf(const Resume&) {
  return messageOf("resume");
}
JsonObject objectOf(const Drive&) {
  return messageOf("drive");
}
JsonObject objectOf(const Release&) {
  return messageOf("release");
}
JsonObject objectOf(const Steer& steer) {
  JsonObject message = messageOf("steer");
  addWish(message, steer.wish);
  return message;
}
JsonObject objectOf(const Welcome& welcome) {
  JsonObject message = messageOf("welcome");
  message.add("version", jsonOf(welcome.version)).add("session", jsonOf(welcome.session));
  message.add("steer", jsonFlag(welcome.steer)).add("viewers", jsonOf(welcome.viewers));
  message.add("pulse", jsonOf(welcome.pulse));
  JsonObject series;
  if (welcome.series) addSeries(series, *welcome.series);
  message.add("series", welcome.series ? series.text() : "null");
  return message;
}
JsonObject objectOf(const SeriesPart& part) {
  JsonObject message = messageOf("series");
  addSeries(message, part.entries);
  message.add("from", jsonOf(part.from));
  return message;
}
JsonObject objectOf(const State& state) {
  JsonObject message = messageOf("state");
  message.add("state", jsonOf(toString(state.phase))).add("viewers", jsonOf(state.viewers));
  if (!state.cause.empty()) message.add("cause", jsonOf(state.cause));
  return message;
}
JsonObject objectOf(const Level& level) {
  JsonObject message = messageOf("level");
  message.add("frame", jsonOf(level.frame)).add("level", jsonOf(level.level));
  message.add("levels", jsonOf(level.levels)).add("bytes", jsonOf(level.bytes));
  message.add("width", jsonOf(level.width)).add("height", jsonOf(level.height));
  message.add("step", jsonOf(level.step)).add("time", numberOrNull(level.time));
  message.add("age", jsonOf(level.age)).add("dropped", jsonOf(level.dropped));
  return message;
}
JsonObject objectOf(const Missing& missing) {
  JsonObject message = messageOf("missing");
  message.add("frame", jsonOf(missing.frame)).add("cause", jsonOf(missing.cause));
  return message;
}
JsonObject objectOf(const Steering& steering) {
  JsonObject message = messageOf("steering");
  addControls(message, steering.controls);
  message.add("you", jsonOf(steering.you)).add("driver", countOrNull(steering.driver));
  return message;
}
JsonObject objectOf(const Denied& denied) {
  JsonObject message = messageOf("denied");
  message.add("cause", jsonOf(denied.cause));
  return message;
}
JsonObject objectOf(const Refusal& refusal) {
  JsonObject message = messageOf("error");
  message.add("cause", jsonOf(refusal.cause));
  return message;
}
JsonObject objectOf(const Unknown&) {
  return messageOf("unknown");
}

template <typename Message>
std::string dumped(const Message& message) {
  return std::visit([](const auto& m) { return objectOf(m).text(); }, message);
}

Hello helloIn(const JsonValue& object) {
  const Fields fields(object);
  Hello hello;
  hello.version = static_cast<int>(fields.count<std::uint16_t>("version"));
  // A message of another version may have other fields, so only the version is read.
  if (hello.version != protocolVersion) return hello;
  hello.token = fields.text("token");
  if (const auto session = object.findUnlessNull("session")) hello.session = session->text();
  hello.have = fields.countIfAny("have");
  return hello;
}

Welcome welcomeIn(const JsonValue& object) {
  const Fields fields(object);
  Welcome welcome;
  welcome.version = static_cast<int>(fields.count<std::uint16_t>("version"));
  welcome.session = fields.text("session");
  welcome.steer = object.at("steer").flag();
  welcome.viewers = fields.count("viewers");
  welcome.pulse = fields.countIfAny("pulse").value_or(welcome.pulse);
  if (const auto series = object.findUnlessNull("series")) welcome.series = Fields(*series).series();
  return welcome;
}

State stateIn(const JsonValue& object) {
  const Fields fields(object);
  State state{phaseOf(fields.text("state")), fields.count("viewers"), {}};
  if (const auto cause = object.findUnlessNull("cause")) state.cause = cause->text();
  return state;
}

Steering steeringIn(const JsonValue& object) {
  const Fields fields(object);
  return {fields.count("you"), fields.countIfAny("driver"), controlsIn(object)};
}

Level levelIn(const JsonValue& object) {
  constexpr std::uint32_t mostLists = 1U << 20U;  // along an axis
  const Fields fields(object);
  Level level;
  level.frame = fields.count("frame");
  level.level = fields.count("level");
  level.levels = fields.count("levels");
  level.bytes = fields.count<std::uint64_t>("bytes");
  const auto width = fields.count("width");
  const auto height = fields.count("height");
  if (level.level >= level.levels || level.bytes == 0 || width > mostLists || height > mostLists)
    refuse("a level's numbers are out of range");
  level.width = static_cast<int>(width);
  level.height = static_cast<int>(height);
  level.step = fields.countIfAny<std::uint64_t>("step").value_or(0);
  if (const auto time = object.findUnlessNull("time")) level.time = time->number();
  level.age = object.at("age").number();
  level.dropped = fields.count<std::uint64_t>("dropped");
  return level;
}

}  // namespace

const char* toString(Phase phase) {
  switch (phase) {
    case Phase::Waiting:
      return "waiting";
    case Phase::Live:
      return "live";
    default:
      return "ended";
  }
}

std::string textOf(const FromViewer& message) {
  return dumped(message);
}

std::string textOf(const FromServer& message) {
  return dumped(message);
}

FromViewer viewerMessage(std::string_view text) {
  const JsonValue object = parsed(text, maxViewerText);
  const Fields fields(object);
  const std::string& type = fields.text("type");
  if (type == "hello") return helloIn(object);
  if (type == "ack")
    return Ack{fields.count("frame"), fields.count("level"), fields.count<std::uint64_t>("bytes")};
  if (type == "show") return Show{fields.count("index")};
  if (type == "pause") return Pause{};
  if (type == "resume") return Resume{};
  if (type == "drive") return Drive{};
  if (type == "release") return Release{};
  if (type == "steer") return Steer{wishIn(object)};
  refuse("a message is of an unknown type");
}

FromServer serverMessage(std::string_view text) {
  const JsonValue object = parsed(text, maxServerText);
  const Fields fields(object);
  const std::string& type = fields.text("type");
  if (type == "welcome") return welcomeIn(object);
  if (type == "series") return SeriesPart{fields.count("from"), fields.series()};
  if (type == "state") return stateIn(object);
  if (type == "level") return levelIn(object);
  if (type == "missing") return Missing{fields.count("frame"), fields.text("cause")};
  if (type == "steering") return steeringIn(object);
  if (type == "denied") return Denied{fields.text("cause")};
  if (type == "error") return Refusal{fields.text("cause")};
  return Unknown{};
}

std::string_view closeReason(std::string_view cause) {
  constexpr std::size_t longest = 123;  // RFC 6455, 5.5.1
  if (cause.size() <= longest) return cause;
  const auto isContinuation = [](char byte) { return (static_cast<unsigned char>(byte) & 0xc0U) == 0x80U; };
  std::size_t end = longest;
  while (end > 0 && isContinuation(cause[end])) --end;
  return cause.substr(0, end);
}

std::array<std::byte, chunkHeadBytes> chunkHead(const Chunk& chunk) {
  std::array<std::byte, chunkHeadBytes> head{};
  std::memcpy(head.data(), &chunk.frame, sizeof(chunk.frame));
  std::memcpy(head.data() + 4, &chunk.level, sizeof(chunk.level));
  std::memcpy(head.data() + 8, &chunk.offset, sizeof(chunk.offset));
  return head;
}

Chunk chunkIn(std::span<const std::byte> message) {
  if (message.size() <= chunkHeadBytes) refuse("a part of a level is too short");
  if (message.size() > chunkHeadBytes + chunkBytes) refuse("a part of a level is too long");
  Chunk chunk;
  std::memcpy(&chunk.frame, message.data(), sizeof(chunk.frame));
  std::memcpy(&chunk.level, message.data() + 4, sizeof(chunk.level));
  std::memcpy(&chunk.offset, message.data() + 8, sizeof(chunk.offset));
  chunk.bytes = message.subspan(chunkHeadBytes);
  return chunk;
}

}  // namespace vdi::stream
