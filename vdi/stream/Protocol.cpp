#include "vdi/stream/Protocol.h"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>

#include "vdi/stream/SteeringJson.h"

namespace vdi::stream {

static_assert(std::endian::native == std::endian::little, "chunk heads are copied as they lie in memory");

namespace {

using Json = nlohmann::json;

constexpr int maxDepth = 3;  // object, series, times

Json parsed(std::string_view text) {
  const auto shallow = [](int depth, Json::parse_event_t, Json&) {
    if (depth > maxDepth) refuse("a message is nested too deeply");
    return true;
  };
  Json message;
  try {
    message = Json::parse(text.begin(), text.end(), shallow);
  } catch (const Json::exception&) {
    refuse("a message isn't JSON");
  }
  if (!message.is_object()) refuse("a message isn't a JSON object");
  return message;
}

/// Reads the fields of a message.
class Fields {
 public:
  explicit Fields(const Json& object) : object_(object) {}

  std::string text(const char* name) const {
    const Json& value = at(name);
    if (!value.is_string()) refuse(fmt::format("\"{}\" isn't a string", name));
    return value.get<std::string>();
  }
  bool flag(const char* name) const {
    const Json& value = at(name);
    if (!value.is_boolean()) refuse(fmt::format("\"{}\" isn't true or false", name));
    return value.get<bool>();
  }
  double number(const char* name) const {
    const Json& value = at(name);
    if (!value.is_number()) refuse(fmt::format("\"{}\" isn't a number", name));
    return value.get<double>();
  }
  template <typename Integer = std::uint32_t>
  Integer count(const char* name) const {
    return asCount<Integer>(at(name), name);
  }
  bool has(const char* name) const {
    const auto found = object_.find(name);
    return found != object_.end() && !found->is_null();
  }
  std::optional<double> numberIfAny(const char* name) const {
    return has(name) ? std::optional(number(name)) : std::nullopt;
  }
  /// "times" and "steps" of the object.
  Series series() const {
    const Json& times = at("times");
    const Json& steps = at("steps");
    if (!times.is_array() || !steps.is_array() || times.size() != steps.size())
      refuse("\"times\" and \"steps\" aren't arrays of one length");
    Series series;
    for (const Json& time : times) {
      if (!time.is_null() && !time.is_number()) refuse("\"times\" has an entry that isn't a number");
      series.times.push_back(time.is_null() ? std::nullopt : std::optional(time.get<double>()));
    }
    for (const Json& step : steps) series.steps.push_back(asCount<std::uint64_t>(step, "steps"));
    return series;
  }
  const Json& at(const char* name) const {
    const auto found = object_.find(name);
    if (found == object_.end()) refuse(fmt::format("a message lacks \"{}\"", name));
    return *found;
  }

 private:
  template <typename Integer>
  static Integer asCount(const Json& value, const char* name) {
    // JavaScript writes whole numbers up to 2^53 without a point.
    if (!value.is_number_unsigned() || value.get<std::uint64_t>() > std::numeric_limits<Integer>::max())
      refuse(fmt::format("\"{}\" isn't a whole number within its bounds", name));
    return static_cast<Integer>(value.get<std::uint64_t>());
  }
  const Json& object_;
};

Json numberOrNull(const std::optional<double>& value) {
  return value && std::isfinite(*value) ? Json(*value) : Json();
}

Json jsonOf(const Series& series) {
  Json times = Json::array();
  for (const std::optional<double>& time : series.times) times.push_back(numberOrNull(time));
  return {{"times", std::move(times)}, {"steps", series.steps}};
}

Phase phaseOf(const std::string& name) {
  for (const Phase phase : {Phase::Waiting, Phase::Live, Phase::Ended}) {
    if (name == toString(phase)) return phase;
  }
  refuse("\"state\" is none of waiting, live and ended");
}

Json jsonOf(const Hello& hello) {
  Json message{{"type", "hello"}, {"version", hello.version}, {"token", hello.token}};
  message["session"] = hello.session ? Json(*hello.session) : Json();
  message["have"] = hello.have ? Json(*hello.have) : Json();
  return message;
}
Json jsonOf(const Ack& ack) {
  return {{"type", "ack"}, {"frame", ack.frame}, {"level", ack.level}, {"bytes", ack.bytes}};
}
Json jsonOf(const Show& show) {
  return {{"type", "show"}, {"index", show.index}};
}
Json jsonOf(const Pause&) {
  return Json::object({{"type", "pause"}});
}
Json jsonOf(const Resume&) {
  return Json::object({{"type", "resume"}});
}
Json jsonOf(const Drive&) {
  return Json::object({{"type", "drive"}});
}
Json jsonOf(const Release&) {
  return Json::object({{"type", "release"}});
}
Json jsonOf(const Steer& steer) {
  Json message = jsonOf(steer.wish);
  message["type"] = "steer";
  return message;
}
Json jsonOf(const Welcome& welcome) {
  Json message{{"type", "welcome"},      {"version", welcome.version}, {"session", welcome.session},
               {"steer", welcome.steer}, {"viewers", welcome.viewers}, {"pulse", welcome.pulse}};
  message["series"] = welcome.series ? jsonOf(*welcome.series) : Json();
  return message;
}
Json jsonOf(const SeriesPart& part) {
  Json message = jsonOf(part.entries);
  message["type"] = "series";
  message["from"] = part.from;
  return message;
}
Json jsonOf(const State& state) {
  Json message{{"type", "state"}, {"state", toString(state.phase)}, {"viewers", state.viewers}};
  if (!state.cause.empty()) message["cause"] = state.cause;
  return message;
}
Json jsonOf(const Level& level) {
  return {{"type", "level"},        {"frame", level.frame},    {"level", level.level},
          {"levels", level.levels}, {"bytes", level.bytes},    {"width", level.width},
          {"height", level.height}, {"step", level.step},      {"time", numberOrNull(level.time)},
          {"age", level.age},       {"dropped", level.dropped}};
}
Json jsonOf(const Missing& missing) {
  return {{"type", "missing"}, {"frame", missing.frame}, {"cause", missing.cause}};
}
Json jsonOf(const Steering& steering) {
  Json message = jsonOf(steering.controls);
  message["type"] = "steering";
  message["you"] = steering.you;
  message["driver"] = steering.driver ? Json(*steering.driver) : Json();
  return message;
}
Json jsonOf(const Denied& denied) {
  return {{"type", "denied"}, {"cause", denied.cause}};
}
Json jsonOf(const Refusal& refusal) {
  return {{"type", "error"}, {"cause", refusal.cause}};
}
Json jsonOf(const Unknown&) {
  return Json::object({{"type", "unknown"}});
}

template <typename Message>
std::string dumped(const Message& message) {
  return std::visit(
      [](const auto& m) { return jsonOf(m).dump(-1, ' ', false, Json::error_handler_t::replace); }, message);
}

Hello helloIn(const Fields& fields) {
  Hello hello;
  hello.version = static_cast<int>(fields.count<std::uint16_t>("version"));
  // A message of another version may have other fields, so only the version is read.
  if (hello.version != protocolVersion) return hello;
  hello.token = fields.text("token");
  if (fields.has("session")) hello.session = fields.text("session");
  if (fields.has("have")) hello.have = fields.count("have");
  return hello;
}

Welcome welcomeIn(const Fields& fields) {
  Welcome welcome;
  welcome.version = static_cast<int>(fields.count<std::uint16_t>("version"));
  welcome.session = fields.text("session");
  welcome.steer = fields.flag("steer");
  welcome.viewers = fields.count("viewers");
  if (fields.has("pulse")) welcome.pulse = fields.count("pulse");
  if (fields.has("series")) {
    const Json& series = fields.at("series");
    if (!series.is_object()) refuse("\"series\" isn't an object");
    welcome.series = Fields(series).series();
  }
  return welcome;
}

Steering steeringIn(const Fields& fields, const Json& object) {
  Steering steering;
  steering.you = fields.count("you");
  if (fields.has("driver")) steering.driver = fields.count("driver");
  steering.controls = controlsIn(object);
  return steering;
}

Level levelIn(const Fields& fields) {
  constexpr std::uint32_t mostLists = 1U << 20U;  // along an axis
  Level level;
  level.frame = fields.count("frame");
  level.level = fields.count("level");
  level.levels = fields.count("levels");
  level.bytes = fields.count<std::uint64_t>("bytes");
  const auto width = fields.count("width");
  const auto height = fields.count("height");
  if (level.level >= level.levels || level.bytes == 0 || width > mostLists || height > mostLists)
    refuse("a level is out of its bounds");
  level.width = static_cast<int>(width);
  level.height = static_cast<int>(height);
  if (fields.has("step")) level.step = fields.count<std::uint64_t>("step");
  level.time = fields.numberIfAny("time");
  level.age = fields.number("age");
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
  if (text.size() > maxViewerText) refuse("a message is too long");
  const Json object = parsed(text);
  const Fields fields(object);
  const std::string type = fields.text("type");
  if (type == "hello") return helloIn(fields);
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
  if (text.size() > maxServerText) refuse("a message is too long");
  const Json object = parsed(text);
  const Fields fields(object);
  const std::string type = fields.text("type");
  if (type == "welcome") return welcomeIn(fields);
  if (type == "series") return SeriesPart{fields.count("from"), fields.series()};
  if (type == "state") {
    return State{phaseOf(fields.text("state")), fields.count("viewers"),
                 fields.has("cause") ? fields.text("cause") : std::string()};
  }
  if (type == "level") return levelIn(fields);
  if (type == "missing") return Missing{fields.count("frame"), fields.text("cause")};
  if (type == "steering") return steeringIn(fields, object);
  if (type == "denied") return Denied{fields.text("cause")};
  if (type == "error") return Refusal{fields.text("cause")};
  return Unknown{};
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
