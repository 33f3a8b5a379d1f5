// The .vdi file: round trips, the byte map of docs/format.md, and clear refusals.
#include <xxhash.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "tests/Catch.h"
#include "tests/TemporaryFolder.h"
#include "tests/Thrown.h"
#include "tests/io/Samples.h"
#include "vdi/core/Thinning.h"
#include "vdi/io/Files.h"
#include "vdi/io/ListCodec.h"
#include "vdi/io/VdiDecoder.h"
#include "vdi/io/VdiFile.h"

using namespace vdi;
namespace fs = std::filesystem;

namespace {

/// Equal to the bit: operator== treats 0 and -0 as equal.
bool sameBits(const Vdi& a, const Vdi& b) {
  if (a.precision() == Precision::Compact) return a == b;
  const auto& own = test::full(a).segments;
  if (own.empty()) return a == b;  // memcmp takes no null pointers
  return a == b &&
         std::memcmp(own.data(), test::full(b).segments.data(), own.size() * sizeof(Supersegment)) == 0;
}

/// A value at an offset of the byte map.
template <typename T>
T at(std::span<const std::byte> bytes, std::size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof(T));
  return value;
}
template <typename T>
void put(std::vector<std::byte>& bytes, std::size_t offset, T value) {
  std::memcpy(bytes.data() + offset, &value, sizeof(T));
}

/// Recomputes both outer checksums.
void seal(std::vector<std::byte>& bytes) {
  const auto chunks = at<std::uint32_t>(bytes, 40);
  const std::size_t table = std::min<std::size_t>(chunks * 16ULL, bytes.size() - test::headerBytes);
  put<std::uint64_t>(bytes, 224, XXH64(bytes.data() + test::headerBytes, table, 0));
  put<std::uint64_t>(bytes, 232, XXH64(bytes.data(), 232, 0));
}

/// The refusal of a file changed in one place, with valid checksums of header and table.
template <typename T>
std::string refusal(std::vector<std::byte> bytes, std::size_t offset, T value) {
  put(bytes, offset, value);
  seal(bytes);
  const Error error = test::errorOf([&] { io::decode(bytes); });
  CHECK(error.code() == ErrorCode::Format);
  return error.what();
}

std::vector<std::byte> fromHex(const std::string& hex) {
  std::vector<std::byte> bytes;
  for (std::size_t i = 0; i + 1 < hex.size(); i += 2) {
    bytes.push_back(static_cast<std::byte>(std::stoi(hex.substr(i, 2), nullptr, 16)));
  }
  return bytes;
}

using vdi::test::ContainsSubstring;

}  // namespace

TEST_CASE("a VDI survives encoding and decoding to the bit") {
  SECTION("sizes around a chunk of lists") {
    const auto [width, height] =
        GENERATE(table<int, int>({{1, 1}, {1, 7}, {64, 64}, {4095, 1}, {1, 4097}, {97, 101}, {128, 64}}));
    const auto budget = GENERATE(1U, 2U, 25U);
    const Vdi vdi = test::noisyVdi(width, height, budget, static_cast<std::uint64_t>(width) + budget);
    CHECK(sameBits(io::decode(io::encode(vdi)), vdi));
  }
  SECTION("compact") {
    const auto [width, height] = GENERATE(table<int, int>({{1, 1}, {1, 7}, {64, 64}, {97, 101}}));
    const Vdi vdi = test::compact(test::noisyVdi(width, height, 25));
    CHECK_NOTHROW(validate(vdi));
    CHECK(sameBits(io::decode(io::encode(vdi)), vdi));
    CHECK(sameBits(io::decode(io::encode(test::compact(test::plausibleVdi(160, 90, 25)))),
                   test::compact(test::plausibleVdi(160, 90, 25))));
  }
  SECTION("long lists") {
    const Vdi vdi = test::noisyVdi(5, 5, 1024);
    CHECK(sameBits(io::decode(io::encode(vdi)), vdi));
  }
  SECTION("what a generator makes") {
    const Vdi vdi = test::plausibleVdi(160, 90, 25);
    CHECK(sameBits(io::decode(io::encode(vdi)), vdi));
  }
  SECTION("nothing in it, of nothing") {
    Vdi vdi = test::emptyVdi(33, 22, 5);
    vdi.bounds = Box();
    vdi.sampleStep = 0.0;
    CHECK(sameBits(io::decode(io::encode(vdi)), vdi));
  }
  SECTION("parallel projection") {
    Vdi vdi = test::noisyVdi(3, 2, 4);
    vdi.camera.parallelProjection = true;
    CHECK(sameBits(io::decode(io::encode(vdi)), vdi));
  }
  SECTION("with a margin") {
    Vdi vdi = test::noisyVdi(9, 7, 4);
    vdi.margin = GENERATE(glm::ivec2(4, 3), glm::ivec2(0, 1));
    CHECK(sameBits(io::decode(io::encode(vdi)), vdi));
    CHECK(io::decodeInfo(io::encode(vdi)).header.pictureSize() == glm::ivec2(9, 7) - 2 * vdi.margin);
  }
  SECTION("the ends of the floats") {
    using Limits = std::numeric_limits<float>;
    Vdi vdi = test::emptyVdi(2, 2, 3);
    test::full(vdi).segments = {{0.0F, Limits::denorm_min(), -0.0F, Limits::max(), Limits::lowest(), 1.0F},
                                {Limits::denorm_min(), Limits::min(), Limits::min(), -Limits::denorm_min(),
                                 0.0F, Limits::denorm_min()},
                                {0.0F, Limits::max(), 0.0F, -1.0F, 1e-30F, 0.5F},
                                {-0.0F, 1e-20F, 0.0F, 0.0F, 0.0F, 1e-20F}};
    test::full(vdi).offsets = {0, 2, 2, 3, 4};
    CHECK(sameBits(io::decode(io::encode(vdi)), vdi));
  }
}

TEST_CASE("a file is decoded from pieces of any size") {
  const bool compact = GENERATE(false, true);
  const Vdi vdi = compact ? test::compact(test::noisyVdi(150, 140, 7)) : test::noisyVdi(150, 140, 7);
  const std::vector<std::byte> bytes = io::encode(vdi);
  const auto decodedFrom = [&](std::span<const std::byte> all, std::uint64_t announced, std::size_t most) {
    test::Noise noise(most);
    io::VdiDecoder decoder(announced);
    while (!all.empty()) {
      const std::size_t size = std::min<std::size_t>(
          all.size(), most == 1 ? 1 : noise.below(static_cast<std::uint32_t>(most + 1)));
      decoder.add(all.first(size));
      all = all.subspan(size);
    }
    return decoder.finish();
  };
  for (const std::size_t most : {1, 100, 5000, 200000, 100000000})
    CHECK(decodedFrom(bytes, bytes.size(), most) == vdi);
  const auto fault = [&](std::span<const std::byte> all, std::uint64_t announced) {
    return test::errorOf([&] { decodedFrom(all, announced, 5000); });
  };
  const std::span<const std::byte> all(bytes);
  CHECK(fault(all.first(bytes.size() - 1), bytes.size()).code() == ErrorCode::Format);
  CHECK(fault(all.first(100), bytes.size()).code() == ErrorCode::Format);
  CHECK(fault({}, bytes.size()).code() == ErrorCode::Format);
  CHECK(fault({}, 0).code() == ErrorCode::Format);
  CHECK(fault(all, bytes.size() - 1).code() == ErrorCode::Format);
  std::vector<std::byte> altered = bytes;
  altered[2 * bytes.size() / 3] ^= std::byte{1};
  CHECK_THAT(fault(altered, bytes.size()).what(), ContainsSubstring("checksum"));
}

TEST_CASE("a file is thinned without its other lists") {
  const auto [width, height] =
      GENERATE(table<int, int>({{1, 1}, {1, 7}, {97, 101}, {4097, 3}, {128, 64}, {1000, 1}}));
  const bool isCompact = GENERATE(false, true);
  Vdi vdi = test::colored(test::noisyVdi(width, height, 7));
  if (isCompact) vdi = test::compact(vdi);
  if (width > 2 && height > 2) vdi.margin = {1, 1};
  const std::vector<std::byte> bytes = io::encode(vdi);
  const std::vector<int> factors{1, 2, 3, 5, 200};
  const std::vector<Vdi> decoded = io::decodeThinned(bytes, factors);
  REQUIRE(decoded.size() == factors.size());
  for (std::size_t i = 0; i < factors.size(); ++i) {
    INFO(width << " x " << height << ", one in " << factors[i]);
    CHECK(sameBits(decoded[i], thinned(vdi, factors[i])));
  }
}

TEST_CASE("equal VDIs give equal bytes") {
  CHECK(io::encode(test::noisyVdi(70, 60, 9)) == io::encode(test::noisyVdi(70, 60, 9)));
}

TEST_CASE("header and chunk table lie as docs/format.md says") {
  Vdi vdi = test::noisyVdi(100, 90, 6);
  vdi.camera.parallelProjection = true;
  const std::vector<std::byte> bytes = io::encode(vdi);
  CHECK(std::memcmp(bytes.data(), "VDI-FILE", 8) == 0);
  CHECK(at<std::uint32_t>(bytes, 8) == 1);
  CHECK(at<std::uint32_t>(bytes, 12) == test::headerBytes);
  CHECK(at<std::uint32_t>(bytes, 16) == 0);
  CHECK(at<std::uint32_t>(bytes, 20) == 1);
  CHECK(at<std::uint32_t>(bytes, 24) == 100);
  CHECK(at<std::uint32_t>(bytes, 28) == 90);
  CHECK(at<std::uint32_t>(bytes, 32) == 6);
  CHECK(at<std::uint32_t>(bytes, 36) == 4096);
  CHECK(at<std::uint32_t>(bytes, 40) == 3);
  CHECK(at<std::uint32_t>(bytes, 44) == 0);
  CHECK(at<std::uint64_t>(bytes, 48) == test::full(vdi).segments.size());
  CHECK(at<std::uint64_t>(bytes, 56) == bytes.size() - test::headerBytes - 48);
  CHECK(at<std::uint64_t>(bytes, 64) == vdi.timeStep);
  CHECK(at<double>(bytes, 72) == vdi.time);
  CHECK(at<double>(bytes, 80) == vdi.sampleStep);
  CHECK(at<glm::dvec3>(bytes, 88) == vdi.bounds.lo);
  CHECK(at<glm::dvec3>(bytes, 112) == vdi.bounds.hi);
  CHECK(at<glm::dvec3>(bytes, 136) == vdi.camera.position);
  CHECK(at<glm::dvec3>(bytes, 160) == vdi.camera.focalPoint);
  CHECK(at<glm::dvec3>(bytes, 184) == vdi.camera.viewUp);
  CHECK(at<double>(bytes, 208) == vdi.camera.viewAngle);
  CHECK(at<double>(bytes, 216) == vdi.camera.parallelScale);
  CHECK(at<std::uint64_t>(bytes, 224) == XXH64(bytes.data() + test::headerBytes, 48, 0));
  CHECK(at<std::uint64_t>(bytes, 232) == XXH64(bytes.data(), 232, 0));
  std::size_t offset = test::headerBytes + 48;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t last = std::min<std::size_t>((i + 1) * 4096, 9000);
    CHECK(at<std::uint32_t>(bytes, test::headerBytes + 16 * i) ==
          test::full(vdi).offsets[last] - test::full(vdi).offsets[i * 4096]);
    const auto packed = at<std::uint32_t>(bytes, test::headerBytes + 16 * i + 4);
    CHECK(at<std::uint64_t>(bytes, test::headerBytes + 16 * i + 8) ==
          XXH64(bytes.data() + offset, packed, 0));
    offset += packed;
  }
  CHECK(offset == bytes.size());
}

TEST_CASE("a margin makes version 2, and only a margin does") {
  Vdi vdi = test::noisyVdi(9, 7, 4);
  CHECK(at<std::uint32_t>(io::encode(vdi), 8) == 1);
  vdi.margin = {3, 2};
  const std::vector<std::byte> bytes = io::encode(vdi);
  CHECK(at<std::uint32_t>(bytes, 8) == 2);
  CHECK(at<std::uint16_t>(bytes, 44) == 3);
  CHECK(at<std::uint16_t>(bytes, 46) == 2);
  CHECK(io::decodeInfo(bytes).version == 2);
  CHECK_THAT(refusal(bytes, 44, std::uint16_t{5}), ContainsSubstring("margin"));
  CHECK_THAT(refusal(bytes, 46, std::uint16_t{4}), ContainsSubstring("margin"));
  CHECK_THAT(refusal(bytes, 8, 1U), ContainsSubstring("flags"));
}

TEST_CASE("metadata make version 3 and lie behind the chunks as JSON, as docs/format.md says") {
  Vdi vdi = test::colored(test::noisyVdi(9, 7, 4));
  if (GENERATE(false, true)) vdi.margin = {3, 2};
  const std::vector<std::byte> bytes = io::encode(vdi);
  CHECK(at<std::uint32_t>(bytes, 8) == 3);
  CHECK(at<std::uint32_t>(bytes, 12) == test::headerBytes);
  CHECK(at<std::uint16_t>(bytes, 44) == vdi.margin.x);
  const std::size_t place =
      test::headerBytes + 16 * at<std::uint32_t>(bytes, 40) + at<std::uint64_t>(bytes, 56);
  CHECK(std::memcmp(bytes.data() + place, "JSON", 4) == 0);
  const auto count = at<std::uint32_t>(bytes, place + 4);
  REQUIRE(place + 16 + count == bytes.size());
  CHECK(at<std::uint64_t>(bytes, place + 8) == XXH64(bytes.data() + place + 16, count, 0));
  const std::string text(reinterpret_cast<const char*>(bytes.data()) + place + 16, count);
  CHECK(
      text ==
      "{\"array\":{\"association\":\"cells\",\"component\":-1,\"components\":3,\"name\":\"vitesse "
      "\u00e9lev\u00e9e \\\"|v|\\\"\"},\"range\":[-1.5e-300,0.3333333333333333],\"time\":1234.5,"
      "\"timeStep\":1099511627783,\"transferFunction\":{\"colors\":[[-1e+300,0.0,0.1,1.0],[0.25,0.5,0.5,0.5],"
      "[0.25,1.0,0.0,0.0]],\"opacities\":[[-2.0,0.0],[2.3333333333333335,1.0]],\"unitDistance\":0.1}}");
  CHECK(sameBits(io::decode(bytes), vdi));
  CHECK(io::decodeInfo(bytes).version == 3);
  CHECK(io::decodeInfo(bytes).header.coloring == vdi.coloring);
  // The same VDI without metadata, which older programs read.
  vdi.coloring.reset();
  CHECK(at<std::uint32_t>(io::encode(vdi), 8) == (vdi.margin.x > 0 ? 2 : 1));
}

TEST_CASE(
    "metadata that aren't sound are refused, their checksum being right, and unknown fields are skipped") {
  const std::vector<std::byte> sound = io::encode(test::colored(test::noisyVdi(4, 4, 3)));
  const std::size_t place =
      test::headerBytes + 16 * at<std::uint32_t>(sound, 40) + at<std::uint64_t>(sound, 56);
  const auto with = [&](const std::string& text) {
    std::vector<std::byte> bytes(sound.begin(), sound.begin() + static_cast<std::ptrdiff_t>(place));
    bytes.resize(place + 16 + text.size());
    std::memcpy(bytes.data() + place, "JSON", 4);
    put(bytes, place + 4, static_cast<std::uint32_t>(text.size()));
    put<std::uint64_t>(bytes, place + 8, XXH64(text.data(), text.size(), 0));
    std::memcpy(bytes.data() + place + 16, text.data(), text.size());
    return bytes;
  };
  const std::string array = R"("array":{"name":"V","association":"points","components":2,"component":1})";
  const std::string function =
      R"("transferFunction":{"colors":[[0,0,0,1]],"opacities":[[0,0],[1,1]],"unitDistance":2})";
  const Vdi plain = io::decode(with("{" + array + "," + function + R"(,"range":[0,1],"later":[{}]})"));
  CHECK(plain.coloring->array == ScalarArray{.name = "V", .cells = false, .components = 2, .component = 1});
  CHECK(io::decode(with("{" + array + "," + function + "}")).coloring->range == ScalarRange());
  const auto refused = [&](const std::string& text, const std::string& what) {
    INFO(text);
    const Error error = test::errorOf([&] { io::decode(with(text)); });
    CHECK(error.code() == ErrorCode::Format);
    CHECK_THAT(error.what(), ContainsSubstring(what));
    CHECK(test::errorOf([&] { io::decodeInfo(with(text)); }).code() == ErrorCode::Format);
  };
  const auto changed = [&](const std::string& from, const std::string& to) {
    std::string text = "{" + array + "," + function + R"(,"range":[0,1]})";
    const std::size_t found = text.find(from);
    REQUIRE(found != std::string::npos);
    return text.replace(found, from.size(), to);
  };
  refused("", "it ends too early");
  refused("{", "it ends too early");
  refused("[]", "not a JSON object");
  refused("{" + array + "}", "'transferFunction' is missing");
  refused(std::string(10000, '['), "it ends too early");
  refused(changed("\"V\"", "7"), "'name'");
  refused(changed("points", "edges"), "association");
  refused(changed("\"component\":1", "\"component\":2"), "component 2 of 2");
  refused(changed("\"components\":2", "\"components\":1e99"), "components");
  refused(changed("\"components\":2", "\"components\":18446744073709551615"), "component");
  refused(changed("[0,1]}", "[1,0]}"), "range");
  refused(changed("[0,1]}", "[1e999,0]}"), "metadata");
  refused(changed("[[0,0,0,1]]", "[]"), "no nodes");
  refused(changed("[[0,0,0,1]]", "[[0,0,0]]"), "colors");
  refused(changed("[[0,0,0,1]]", "[[0,0,0,2]]"), "isn't in [0, 1]");
  refused(changed("[[0,0],[1,1]]", "[[1,0],[0,1]]"), "ascend");
  refused(changed("\"unitDistance\":2", "\"unitDistance\":0"), "unit distance");
  refused("{" + array + "," + function + "}" + std::string(1U << 20, ' '), "can't be metadata");
  CHECK_THAT(refusal(sound, place, 'j'), ContainsSubstring("aren't JSON"));
  CHECK_THAT(refusal(sound, place + 4, 1U), ContainsSubstring("the metadata have"));
  CHECK_THAT(refusal(sound, place + 8, std::uint64_t{1}), ContainsSubstring("metadata's checksum"));
  CHECK_THAT(refusal(sound, 8, 1U), ContainsSubstring("header gives"));
  // encode refuses the VDIs that decode would refuse.
  Vdi vdi = test::colored(test::noisyVdi(4, 4, 3));
  vdi.coloring->function.unitDistance = 0.0;
  CHECK(test::errorOf([&] { io::encode(vdi); }).code() == ErrorCode::Format);
  vdi = test::colored(vdi);
  vdi.coloring->array.name = std::string(1U << 20, 'a');
  CHECK(test::errorOf([&] { io::encode(vdi); }).code() == ErrorCode::Format);
  vdi.coloring->array.name = "\xff";
  CHECK(io::decode(io::encode(vdi)).coloring->array.name == "\uFFFD");
}

TEST_CASE("a file written by the first version 1 can be read") {
  const std::vector<std::byte> bytes = fromHex(
      "5644492d46494c4501000000f00000000000000000000000030000000200000003000000001000000100000000000000"
      "0800000000000000c700000000000000070000000001000000000000004a9340000000000000803f000000000000f0bf"
      "0000000000000000000000000000f03f0000000000000040000000000000084000000000000010400000000000000040"
      "000000000000f83f0000000000000a40000000000000e03f000000000000e03f000000000000e03f0000000000000000"
      "000000000000f03f000000000000c03f0000000000803a40000000000000e83f5bb7ef88486a4c6fe75569a21d8e7581"
      "08000000c70000007cffd7f62513ad907d000201010103000100f429a41c2c5f6ff6fc00b2f72b0df81d060073402011"
      "bcaaa4007e00000005050000d33bde11002f8b08a87c8d7d2c26fe6563515341f4a104134900f12cc0806ac6277fe80c"
      "159e7817dcfaf419f0ee25609f0c2f6b790204000001000030e1f3716284630ed845f480b4389b2ddf7fb390261da914"
      "7d01022000f0319ca515be0caa1f63e010b90862a3003036f0784e1c58d7bc7e010400000201044c346abaa496030804"
      "8b50ca3eeb7644cfb6e5d9b213ae407ef5f8fe040106fe");
  CHECK(sameBits(io::decode(bytes), test::noisyVdi(3, 2, 3)));
}

TEST_CASE("later versions, encodings and flags are named in the refusal") {
  const std::vector<std::byte> sound = io::encode(test::noisyVdi(4, 4, 3));
  CHECK_THAT(refusal(sound, 8, 0U), ContainsSubstring("version 0"));
  CHECK_THAT(refusal(sound, 8, 4U), ContainsSubstring("version 4"));
  CHECK_THAT(refusal(sound, 8, 3U), ContainsSubstring("metadata"));
  CHECK_THAT(refusal(sound, 12, 256U), ContainsSubstring("header"));
  CHECK_THAT(refusal(sound, 16, 7U), ContainsSubstring("encoding 7"));
  CHECK_THAT(refusal(sound, 20, 2U), ContainsSubstring("flags"));
  CHECK_THAT(refusal(sound, 44, 1U), ContainsSubstring("flags"));
  CHECK_THAT(refusal(sound, 0, 'v'), ContainsSubstring("VDI-FILE"));
}

TEST_CASE("an impossible header or table with valid checksums is refused") {
  const std::vector<std::byte> sound = io::encode(test::noisyVdi(4, 4, 3));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  refusal(sound, 24, 0U);
  refusal(sound, 24, 5U);  // more lists than counts
  refusal(sound, 28, 32769U);
  refusal(sound, 32, 0U);
  refusal(sound, 32, 1U);  // a budget below the lists' size
  refusal(sound, 36, 0U);
  refusal(sound, 40, 2U);
  refusal(sound, 48, at<std::uint64_t>(sound, 48) + 1);
  refusal(sound, 56, at<std::uint64_t>(sound, 56) + 1);
  refusal(sound, 72, nan);
  refusal(sound, 80, -1.0);
  refusal(sound, 88, nan);
  refusal(sound, 208, 180.0);  // a view angle of 180 degrees
  refusal(sound, 240, at<std::uint32_t>(sound, 240) + 1);
  refusal(sound, 244, at<std::uint32_t>(sound, 244) - 1);
}

TEST_CASE("headers that ask for more memory than the file can justify are refused") {
  std::vector<std::byte> bytes = io::encode(test::emptyVdi(4, 4, 3));
  const auto claim = [&](std::uint32_t side, std::uint32_t listsPerChunk, std::uint32_t supersegments) {
    std::vector<std::byte> forged = bytes;
    put(forged, 24, side);
    put(forged, 28, side);
    put(forged, 36, listsPerChunk);
    put<std::uint64_t>(forged, 48, supersegments);
    put(forged, 240, supersegments);
    seal(forged);
    return std::string(test::errorOf([&] { io::decode(forged); }).what());
  };
  CHECK_THAT(claim(32768, 1U << 30, 0), ContainsSubstring("can't hold"));
  CHECK_THAT(claim(16384, 1U << 28, 0), ContainsSubstring("can't hold"));
  CHECK_THAT(claim(64, 4096, 3 * 4096), ContainsSubstring("can't hold"));
  CHECK_THAT(claim(4, 4096, ~0U), ContainsSubstring("can't hold"));
  CHECK_THAT(claim(32768, 1, 0), ContainsSubstring("chunks"));
}

TEST_CASE("info is known without the lists") {
  const test::TemporaryFolder folder;
  const fs::path path = folder.path() / "v.vdi";
  const Vdi vdi = test::noisyVdi(70, 60, 9);
  io::writeVdi(path, vdi);
  Vdi expected = vdi;
  expected.lists = SupersegmentLists();
  std::vector<std::byte> bytes = io::InputFile(path).readAll();
  const auto requireGood = [&](const io::VdiFileInfo& info) {
    CHECK(info.version == 1);
    CHECK(info.header == expected);
    CHECK(info.supersegmentCount == test::full(vdi).segments.size());
    CHECK(info.storedBytes == bytes.size());
    CHECK(info.expandedBytes == test::full(vdi).segments.size() * 24 + test::full(vdi).offsets.size() * 4);
  };
  requireGood(io::readVdiInfo(path));
  requireGood(io::decodeInfo(bytes));
  Vdi other = vdi;  // differs in one list
  std::get<SupersegmentLists>(other.lists).segments.back().opacity *= 0.5F;
  CHECK(io::readVdiInfo(path).checksum == io::decodeInfo(bytes).checksum);
  CHECK(io::decodeInfo(io::encode(other)).checksum != io::decodeInfo(bytes).checksum);
  bytes.back() ^= std::byte{1};  // within a list
  io::writeAtomically(path, bytes);
  requireGood(io::readVdiInfo(path));
  CHECK(test::errorOf([&] { io::readVdi(path); }).code() == ErrorCode::Format);
  bytes.pop_back();
  io::writeAtomically(path, bytes);
  CHECK(test::errorOf([&] { io::readVdiInfo(path); }).code() == ErrorCode::Format);
}

TEST_CASE("VDIs that decode would refuse are not written") {
  const test::TemporaryFolder folder;
  const fs::path path = folder.path() / "v.vdi";
  const Vdi sound = test::noisyVdi(8, 8, 4);
  io::writeVdi(path, sound);
  const auto refused = [&](const std::function<void(Vdi&)>& spoil) {
    Vdi vdi = sound;
    spoil(vdi);
    const Error error = test::errorOf([&] { io::writeVdi(path, vdi); });
    CHECK(error.code() == ErrorCode::Format);
    CHECK(error.context() == path.string());
  };
  refused([](Vdi& vdi) { vdi.width = 7; });
  refused([](Vdi& vdi) { vdi.margin.x = 4; });
  refused([](Vdi& vdi) { test::full(vdi).offsets.back() += 1; });
  refused([](Vdi& vdi) { vdi.budget = 1; });
  refused([](Vdi& vdi) { test::full(vdi).segments[3].opacity = 0.0F; });
  refused([](Vdi& vdi) { test::full(vdi).segments[3].red = std::numeric_limits<float>::infinity(); });
  refused([](Vdi& vdi) { vdi.camera.position = vdi.camera.focalPoint; });
  refused([](Vdi& vdi) { vdi.time = std::numeric_limits<double>::infinity(); });
  CHECK(io::readVdi(path) == sound);
  CHECK(folder.fileCount() == 1);
}

TEST_CASE("files: written, read, and refused with their path") {
  const test::TemporaryFolder folder;
  const fs::path path = folder.path() / "v.vdi";
  const Vdi vdi = test::plausibleVdi(80, 45, 12);
  io::writeVdi(path, vdi);
  CHECK(io::readVdi(path) == vdi);
  const Error missing = test::errorOf([&] { io::readVdi(folder.path() / "none.vdi"); });
  CHECK(missing.code() == ErrorCode::Io);
  CHECK_THAT(missing.what(), ContainsSubstring("none.vdi"));
  io::writeAtomically(path, {});
  const Error empty = test::errorOf([&] { io::readVdi(path); });
  CHECK(empty.code() == ErrorCode::Format);
  CHECK(empty.context() == path.string());
  CHECK(test::errorOf([&] { io::readVdiInfo(path); }).code() == ErrorCode::Format);
}

TEST_CASE("unpackLists refuses anything but the requested lists and supersegments") {
  const Vdi vdi = test::noisyVdi(10, 10, 5);
  io::detail::PackScratch scratch;
  const std::vector<std::byte> packed = io::detail::packLists(test::full(vdi), {}, 20, 60, scratch);
  const std::size_t count = test::full(vdi).offsets[60] - test::full(vdi).offsets[20];
  const auto unpack = [&](std::size_t lists, std::size_t segments) {
    SupersegmentLists back;
    back.offsets.resize(lists + 1);
    back.segments.resize(segments);
    io::detail::unpackLists(packed, 0, std::span(back.offsets).subspan(1), std::span(back.segments));
    return back;
  };
  const SupersegmentLists back = unpack(40, count);
  for (std::size_t i = 0; i < 40; ++i) {
    const auto expected = test::full(vdi).list(20 + i);
    const auto got = back.list(i);
    CHECK(std::equal(expected.begin(), expected.end(), got.begin(), got.end()));
  }
  CHECK(test::errorOf([&] { unpack(41, count); }).code() == ErrorCode::Format);
  CHECK(test::errorOf([&] { unpack(40, count + 1); }).code() == ErrorCode::Format);
  // As many bytes, divided differently: six counts in place of a supersegment, and the reverse.
  CHECK(test::errorOf([&] { unpack(46, count - 1); }).code() == ErrorCode::Format);
  CHECK(test::errorOf([&] { unpack(34, count + 1); }).code() == ErrorCode::Format);
}

TEST_CASE("compact lists take 2/5 of the size of full ones, and invalid ones are refused") {
  const Vdi vdi = test::plausibleVdi(480, 270, 25);
  const Vdi compact = test::compact(vdi);
  const std::vector<std::byte> bytes = io::encode(compact);
  CHECK(bytes.size() * 5 < io::encode(vdi).size() * 2);
  const io::VdiFileInfo info = io::decodeInfo(bytes);
  CHECK(info.header.precision() == Precision::Compact);
  CHECK(info.expandedBytes == compact.supersegmentCount() * 8 + compact.offsets().size() * 4);
  const auto refused = [&](auto change) {
    Vdi broken = compact;
    change(broken);
    CHECK(test::errorOf([&] { io::encode(broken); }).code() == ErrorCode::Format);
  };
  refused([](Vdi& v) { v.depthCode.step = 0.0F; });
  refused([](Vdi& v) { v.depthCode.first = std::numeric_limits<float>::quiet_NaN(); });
  refused([](Vdi& v) {
    std::get<CompactLists>(v.lists).segments[5].depths = 7;
  });  // ends at its begin, or before
}

TEST_CASE("a VDI such as a generator makes is stored in less than 5/8 of its memory") {
  const Vdi vdi = test::plausibleVdi(480, 270, 25);
  const std::vector<std::byte> bytes = io::encode(vdi);
  const io::VdiFileInfo info = io::decodeInfo(bytes);
  const double ratio = static_cast<double>(info.expandedBytes) / static_cast<double>(info.storedBytes);
  CAPTURE(info.expandedBytes, info.storedBytes);
  CHECK(ratio > 1.6);
  const Vdi nothing = test::emptyVdi(480, 270, 25);
  CHECK(io::encode(nothing).size() < 20000);
}
