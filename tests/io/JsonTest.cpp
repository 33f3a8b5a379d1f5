// JSON with source positions: refusals name the position, and a hostile document costs little.
#include <sys/stat.h>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>

#include "tests/Catch.h"
#include "tests/TemporaryFolder.h"
#include "vdi/core/Error.h"
#include "vdi/io/Json.h"

using namespace vdi;
using io::parseJson;

namespace {

void refusedJson(const std::string& text, const std::string& part) {
  INFO(text.substr(0, 200));
  CHECK_THROWS_WITH(parseJson(text, "x.json"), test::ContainsSubstring(part));
}

}  // namespace

TEST_CASE("values of a document") {
  const auto value = parseJson("\n{\"a\": [1, -2.5, 3e2],\n \"b\": {\"c\": true, \"d\": \"x\"}}\n", "x.json");
  CHECK(value.at("a").numbers(3) == std::vector<double>{1.0, -2.5, 300.0});
  CHECK(value.at("b").at("c").flag());
  CHECK(value.at("b").at("d").text() == "x");
  CHECK_FALSE(value.find("z"));
  CHECK(value.at("a").items()[0].whole(0, 5) == 1);
}

TEST_CASE("whole numbers are exact, also beyond 2^53") {
  const std::string text =
      "[9007199254740993, 9223372036854775807, 9223372036854775808, 18446744073709551615, "
      "18446744073709551616, -1, 1.0]";
  const auto items = parseJson(text, "x.json").items();
  constexpr auto most = std::numeric_limits<std::uint64_t>::max();
  CHECK(items[0].count(most) == 9007199254740993U);
  CHECK(items[1].count(most) == most / 2);
  CHECK(items[2].count(most) == most / 2 + 1);
  CHECK(items[3].count(most) == most);
  CHECK(items[3].number() == std::ldexp(1.0, 64));
  CHECK_THROWS_WITH(items[3].count(most - 1),
                    "/3: must be a whole number from 0 to 18446744073709551614 (x.json, line 1)");
  CHECK_THROWS_AS(items[3].whole(0, std::numeric_limits<std::int64_t>::max()), Error);
  for (std::size_t i = 4; i < items.size(); ++i) CHECK_THROWS_AS(items[i].count(most), Error);
}

TEST_CASE("a mistake has the pointer and the line of its value") {
  const auto value = parseJson("{\"a\":\n5\n,\"b/c\": {\"~d\":\n[1,\n\"x\"\n]},\n\"e\": 7\n}", "x.json");
  CHECK_THROWS_WITH(value.at("a").text(), "/a: must be a string (x.json, line 2)");
  CHECK_THROWS_WITH(value.at("b/c").at("~d").numbers(2), "/b~1c/~0d/1: must be a number (x.json, line 5)");
  CHECK_THROWS_WITH(value.at("e").flag(), "/e: must be true or false (x.json, line 7)");
  CHECK_THROWS_WITH(value.at("b/c").at("z"), "/b~1c: the field 'z' is missing (x.json, line 3)");
  CHECK_THROWS_WITH(value.requireObject({"a", "b/c"}),
                    "/e: no such field; the fields are a, b/c (x.json, line 7)");
  CHECK_THROWS_WITH(value.at("a").whole(6, 9), test::ContainsSubstring("from 6 to 9"));
  CHECK_THROWS_WITH(parseJson("{\"a\": 1.5}", "x.json").at("a").whole(0, 9),
                    test::ContainsSubstring("whole"));
  CHECK_THROWS_WITH(parseJson("{\"a\": 1e300}", "x.json").at("a").number(0.0, 1.0),
                    test::ContainsSubstring("to 1"));
}

TEST_CASE("what isn't JSON is refused with its line") {
  refusedJson("", "not valid JSON: it ends too early (x.json, line 1)");
  refusedJson("{\"a\": [1, 2", "not valid JSON: it ends too early");
  refusedJson("{\"a\": 1,\n\"b\": }", "not valid JSON: '}' isn't expected after '\"b\": ' (x.json, line 2)");
  refusedJson("}", "'}' isn't expected at the start of the line");
  refusedJson("{\"a\": NaN}", "not valid JSON: 'N' isn't expected after '{\"a\": '");
  refusedJson("{\"a\": 1e999}", "not valid JSON: a number is too large");
  refusedJson("{\"a\": 1} x", "not valid JSON: 'x' isn't expected after '{\"a\": 1} '");
  refusedJson("{\"a\": \"b\nc\"}", "not valid JSON: a line ends within a string or a word");
  refusedJson("{\"a\": \"\x1b\"}", "not valid JSON: it has the control character U+001B");
  refusedJson("{\"a\": 1,\n\n\"b\": {\"a\": 2},\n\"a\": 3}", "the field 'a' occurs twice (x.json, line 4)");
  refusedJson(std::string("{\"a\": \"") + '\xff' + "\"}", "not valid JSON: it isn't UTF-8");
  try {
    parseJson("{\"a\": \"" + std::string(100000, 'x'), "x.json");
    FAIL("a text without an end");
  } catch (const Error& error) {
    constexpr std::size_t line = 400;
    CHECK(std::string(error.what()).size() < line);
    CHECK(error.code() == ErrorCode::Format);
  }
}

TEST_CASE("a document beyond the limits is refused") {
  refusedJson(std::string(10000, '['), "values are nested more than 16 deep");
  std::string deep;
  for (int i = 0; i < 10000; ++i) deep += "{\"a\":";
  refusedJson(deep, "values are nested more than 16 deep");
  std::string many = "[0";
  for (int i = 0; i < 200000; ++i) many += ",1";
  refusedJson(many + "]", "more than 100000 values");
  refusedJson(std::string(std::size_t{2} << 20, ' '), "the document has more than");
}

TEST_CASE("files that aren't read") {
  const test::TemporaryFolder temporary;
  const std::filesystem::path& folder = temporary.path();
  const std::string pipe = (folder / "pipe").string();
  REQUIRE(::mkfifo(pipe.c_str(), 0600) == 0);
  CHECK_THROWS_AS(io::readJsonText(pipe), Error);  // and doesn't wait for a writer
  CHECK_THROWS_AS(io::readJsonText(folder.string()), Error);
  CHECK_THROWS_AS(io::readJsonText((folder / "none").string()), Error);
  const std::string large = (folder / "large").string();
  std::ofstream(large).close();
  std::filesystem::resize_file(large, std::uintmax_t{1} << 30);  // has no blocks
  CHECK_THROWS_WITH(io::readJsonText(large), test::ContainsSubstring("the file has 1073741824 bytes"));
}
