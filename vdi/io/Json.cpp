#include "vdi/io/Json.h"

#include <fmt/format.h>
#include <fmt/ranges.h>  // fmt::join

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>
#include <span>
#include <utility>
#include <variant>

#include "vdi/core/Error.h"
#include "vdi/io/Files.h"
#include "vdi/io/JsonFault.h"

namespace vdi::io {

struct JsonNode {
  using Members = std::vector<std::pair<std::string, JsonNode>>;
  std::size_t line = 1;
  // A whole number is unsigned only beyond std::int64_t.
  std::variant<std::monostate, bool, std::int64_t, std::uint64_t, double, std::string, std::vector<JsonNode>,
               Members>
      value;
};

namespace {

constexpr std::size_t longestQuote = 60;

/// The text in quotes, cut to fit a message.
std::string inQuotes(const std::string& text) {
  return "'" + (text.size() <= longestQuote ? text : text.substr(0, longestQuote) + "...") + "'";
}

/// Throws an error whose message is one line, even if the document's strings have line ends.
[[noreturn]] void failAt(const std::string& document, std::size_t line, std::string what) {
  std::replace_if(
      what.begin(), what.end(), [](char c) { return static_cast<unsigned char>(c) < ' '; }, '?');
  throw Error(ErrorCode::Format, what, fmt::format("{}, line {}", document, line));
}

/// An iterator over the characters of a text that records how far the parser has read.
class Characters {
 public:
  using iterator_category = std::input_iterator_tag;
  using value_type = char;
  using difference_type = std::ptrdiff_t;
  using pointer = const char*;
  using reference = const char&;

  Characters(const char* at, const char** taken) : at_(at), taken_(taken) {}
  reference operator*() const { return *at_; }
  Characters& operator++() {
    *taken_ = ++at_;
    return *this;
  }
  Characters operator++(int) {
    Characters before = *this;
    ++*this;
    return before;
  }
  bool operator==(const Characters& other) const { return at_ == other.at_; }
  bool operator!=(const Characters& other) const { return at_ != other.at_; }

 private:
  const char* at_;
  const char** taken_;
};

/// Builds the tree of nodes from the parser's events.
class Builder final : public nlohmann::json_sax<nlohmann::json> {
 public:
  Builder(std::string_view text, const std::string& document, const JsonLimits& limits)
      : text_(text), document_(document), limits_(limits), taken_(text.data()), counted_(text.data()) {}

  const char** taken() { return &taken_; }
  JsonNode& root() { return root_; }

  bool null() override { return add(std::monostate()); }
  bool boolean(bool value) override { return add(value); }
  bool number_integer(number_integer_t value) override { return addNumber(std::int64_t{value}); }
  bool number_unsigned(number_unsigned_t value) override {
    constexpr auto most = static_cast<number_unsigned_t>(std::numeric_limits<std::int64_t>::max());
    if (value > most) return addNumber(std::uint64_t{value});
    return addNumber(static_cast<std::int64_t>(value));
  }
  bool number_float(number_float_t value, const string_t&) override { return addNumber(value); }
  bool string(string_t& value) override { return add(std::move(value)); }
  bool binary(binary_t&) override { return false; }  // JSON has no binary values
  bool start_object(std::size_t) override { return open(JsonNode::Members()); }
  bool start_array(std::size_t) override { return open(std::vector<JsonNode>()); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }
  bool key(string_t& name) override {
    auto& members = std::get<JsonNode::Members>(open_.back().value);
    if (!names_.back().insert(name).second)
      failAt(document_, line(), fmt::format("the field {} occurs twice", inQuotes(name)));
    members.emplace_back().first = std::move(name);
    return true;
  }
  bool parse_error(std::size_t taken, const std::string&, const nlohmann::json::exception& error) override {
    failAt(document_, line(), "not valid JSON: " + jsonFault(text_, taken, error.id));
  }

 private:
  /// The line of the last token.
  std::size_t line(std::ptrdiff_t beyond = 0) {
    for (; counted_ < taken_ - beyond; ++counted_) line_ += *counted_ == '\n' ? 1 : 0;
    return line_;
  }
  template <typename Value>
  JsonNode nodeOf(Value value, std::size_t line) {
    if (++values_ > limits_.values)
      failAt(document_, line, fmt::format("more than {} values", limits_.values));
    JsonNode node;
    node.line = line;
    node.value = std::move(value);
    return node;
  }
  /// The parser takes one character beyond a number.
  template <typename Value>
  bool addNumber(Value value) {
    put(nodeOf(value, line(1)));
    return true;
  }
  template <typename Value>
  bool add(Value value) {
    put(nodeOf(std::move(value), line()));
    return true;
  }
  template <typename Value>
  bool open(Value value) {
    if (open_.size() >= limits_.depth)
      failAt(document_, line(), fmt::format("values are nested more than {} deep", limits_.depth));
    open_.push_back(nodeOf(std::move(value), line()));
    names_.emplace_back();
    return true;
  }
  bool close() {
    JsonNode node = std::move(open_.back());
    open_.pop_back();
    names_.pop_back();
    put(std::move(node));
    return true;
  }
  void put(JsonNode node) {
    if (open_.empty()) {
      root_ = std::move(node);
    } else if (auto* members = std::get_if<JsonNode::Members>(&open_.back().value)) {
      members->back().second = std::move(node);
    } else {
      std::get<std::vector<JsonNode>>(open_.back().value).push_back(std::move(node));
    }
  }

  std::string_view text_;
  const std::string& document_;
  const JsonLimits& limits_;
  const char* taken_;
  const char* counted_;
  std::size_t line_ = 1;
  std::size_t values_ = 0;
  std::vector<JsonNode> open_;
  std::vector<std::set<std::string>> names_;  // of each open object, the names so far
  JsonNode root_;
};

/// A step of a JSON pointer (RFC 6901).
std::string escaped(std::string_view name) {
  std::string step;
  for (const char c : name.substr(0, longestQuote))
    step += c == '~' ? "~0" : c == '/' ? "~1" : std::string(1, c);
  return step;
}

}  // namespace

JsonValue::JsonValue(std::shared_ptr<const JsonNode> node, std::shared_ptr<const std::string> document,
                     std::string pointer)
    : node_(std::move(node)), document_(std::move(document)), pointer_(std::move(pointer)) {}

JsonValue JsonValue::child(const JsonNode& node, const std::string& step) const {
  return {std::shared_ptr<const JsonNode>(node_, &node), document_, pointer_ + "/" + step};
}

void JsonValue::fail(const std::string& what) const {
  failAt(*document_, node_->line, pointer_.empty() ? what : pointer_ + ": " + what);
}

bool JsonValue::isArray() const {
  return std::holds_alternative<std::vector<JsonNode>>(node_->value);
}
bool JsonValue::isText() const {
  return std::holds_alternative<std::string>(node_->value);
}
bool JsonValue::isFlag() const {
  return std::holds_alternative<bool>(node_->value);
}
bool JsonValue::isNull() const {
  return std::holds_alternative<std::monostate>(node_->value);
}

std::optional<JsonValue> JsonValue::find(std::string_view name) const {
  const auto* members = std::get_if<JsonNode::Members>(&node_->value);
  if (members == nullptr) fail("must be an object");
  for (const auto& [key, node] : *members) {
    if (key == name) return child(node, escaped(key));
  }
  return std::nullopt;
}

std::optional<JsonValue> JsonValue::findUnlessNull(std::string_view name) const {
  std::optional<JsonValue> value = find(name);
  if (value && value->isNull()) value.reset();
  return value;
}

JsonValue JsonValue::at(std::string_view name) const {
  std::optional<JsonValue> value = find(name);
  if (!value) fail(fmt::format("the field '{}' is missing", name));
  return *value;
}

void JsonValue::requireObject(const std::vector<std::string>& known) const {
  const auto* members = std::get_if<JsonNode::Members>(&node_->value);
  if (members == nullptr) fail("must be an object");
  for (const auto& [key, node] : *members) {
    if (std::find(known.begin(), known.end(), key) == known.end())
      child(node, escaped(key)).fail(fmt::format("no such field; the fields are {}", fmt::join(known, ", ")));
  }
}

double JsonValue::number() const {
  if (const auto* whole = std::get_if<std::int64_t>(&node_->value)) return static_cast<double>(*whole);
  if (const auto* large = std::get_if<std::uint64_t>(&node_->value)) return static_cast<double>(*large);
  const auto* number = std::get_if<double>(&node_->value);
  if (number == nullptr || !std::isfinite(*number)) fail("must be a number");
  return *number;
}

double JsonValue::number(double least, double most) const {
  const double value = number();
  if (!(value >= least && value <= most))
    fail(fmt::format("must be from {} to {}, but is {}", least, most, value));
  return value;
}

std::int64_t JsonValue::whole(std::int64_t least, std::int64_t most) const {
  const auto* value = std::get_if<std::int64_t>(&node_->value);
  if (value == nullptr || *value < least || *value > most)
    fail(fmt::format("must be a whole number from {} to {}", least, most));
  return *value;
}

std::uint64_t JsonValue::count(std::uint64_t most) const {
  std::optional<std::uint64_t> count;
  if (const auto* large = std::get_if<std::uint64_t>(&node_->value)) count = *large;
  const auto* whole = std::get_if<std::int64_t>(&node_->value);
  if (whole != nullptr && *whole >= 0) count = static_cast<std::uint64_t>(*whole);
  if (!count || *count > most) fail(fmt::format("must be a whole number from 0 to {}", most));
  return *count;
}

bool JsonValue::flag() const {
  const auto* value = std::get_if<bool>(&node_->value);
  if (value == nullptr) fail("must be true or false");
  return *value;
}

const std::string& JsonValue::text() const {
  const auto* value = std::get_if<std::string>(&node_->value);
  if (value == nullptr) fail("must be a string");
  return *value;
}

std::vector<JsonValue> JsonValue::items() const {
  const auto* nodes = std::get_if<std::vector<JsonNode>>(&node_->value);
  if (nodes == nullptr) fail("must be an array");
  std::vector<JsonValue> values;
  for (std::size_t i = 0; i < nodes->size(); ++i) values.push_back(child((*nodes)[i], std::to_string(i)));
  return values;
}

std::vector<std::pair<std::string, JsonValue>> JsonValue::members() const {
  const auto* nodes = std::get_if<JsonNode::Members>(&node_->value);
  if (nodes == nullptr) fail("must be an object");
  std::vector<std::pair<std::string, JsonValue>> values;
  values.reserve(nodes->size());
  for (const auto& [name, node] : *nodes) values.emplace_back(name, child(node, escaped(name)));
  return values;
}

std::vector<double> JsonValue::numbers(std::size_t count) const {
  const auto* nodes = std::get_if<std::vector<JsonNode>>(&node_->value);
  if (nodes == nullptr || nodes->size() != count) fail(fmt::format("must be an array of {} numbers", count));
  std::vector<double> numbers;
  for (const JsonValue& item : items()) numbers.push_back(item.number());
  return numbers;
}

JsonValue parseJson(std::string_view text, const std::string& name, const JsonLimits& limits) {
  if (text.size() > limits.bytes)
    throw Error(ErrorCode::Format, fmt::format("the document has more than {} bytes", limits.bytes), name);
  Builder builder(text, name, limits);
  const Characters first(text.data(), builder.taken());
  const Characters last(text.data() + text.size(), builder.taken());
  nlohmann::json::sax_parse(first, last, &builder);
  return {std::make_shared<JsonNode>(std::move(builder.root())), std::make_shared<std::string>(name), ""};
}

std::string readJsonText(const std::string& path, const JsonLimits& limits) {
  const InputFile file(path);
  if (file.size() > limits.bytes) {
    throw Error(ErrorCode::Format,
                fmt::format("the file has {} bytes; at most {} are allowed", file.size(), limits.bytes),
                path);
  }
  std::string text(file.size(), '\0');
  file.readInto(0, std::as_writable_bytes(std::span(text)));
  return text;
}

}  // namespace vdi::io
