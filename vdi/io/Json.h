// A strict reader for JSON that people write. It reports each mistake with its place. Unlike those
// of nlohmann's objects and lists, its destructors allocate nothing: if an allocation failed there,
// the process would end.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace vdi::io {

/// The limits of a document, so that a hostile one exhausts neither memory nor stack.
struct JsonLimits {
  std::size_t bytes = std::size_t{1} << 20;
  std::size_t depth = 16;       // nesting of values
  std::size_t values = 100000;  // values of any kind
};

struct JsonNode;

/// A value in a document, which it keeps alive. Functions that return the value's content throw Error{Format}
/// if it has another type. The error has the value's JSON pointer, and the document's name and the line as
/// context.
class JsonValue {
 public:
  bool isArray() const;
  bool isText() const;
  bool isFlag() const;
  bool isNull() const;

  /// The value of a field; nullopt if this object lacks it.
  std::optional<JsonValue> find(std::string_view name) const;
  /// As find, and nullopt for null, too.
  std::optional<JsonValue> findUnlessNull(std::string_view name) const;
  /// The value of a field; throws if this object lacks it.
  JsonValue at(std::string_view name) const;
  /// Throws unless this is an object whose fields are all among `known`.
  void requireObject(const std::vector<std::string>& known) const;

  double number() const;  // finite
  double number(double least, double most) const;
  std::int64_t whole(std::int64_t least, std::int64_t most) const;
  std::uint64_t count(std::uint64_t most) const;  // a whole number from 0 to `most`
  bool flag() const;
  const std::string& text() const;
  std::vector<JsonValue> items() const;
  std::vector<std::pair<std::string, JsonValue>> members() const;  // names and values of an object's fields
  std::vector<double> numbers(std::size_t count) const;

  [[noreturn]] void fail(const std::string& what) const;

 private:
  friend JsonValue parseJson(std::string_view text, const std::string& name, const JsonLimits& limits);
  JsonValue(std::shared_ptr<const JsonNode> node, std::shared_ptr<const std::string> document,
            std::string pointer);
  JsonValue child(const JsonNode& node, const std::string& step) const;

  std::shared_ptr<const JsonNode> node_;
  std::shared_ptr<const std::string> document_;  // the document's name
  std::string pointer_;
};

/// Parses a document. Messages use its `name`. Throws Error{Format} with the line for text that isn't JSON, a
/// field that an object has twice, and a document beyond the limits.
JsonValue parseJson(std::string_view text, const std::string& name, const JsonLimits& limits = {});

/// The text of a file. Throws Error{Io} unless it is a regular file that can be read. Throws Error{Format} if
/// it is larger than the limit, without reading it.
std::string readJsonText(const std::string& path, const JsonLimits& limits = {});

}  // namespace vdi::io
