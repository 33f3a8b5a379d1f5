// Damaged .vdi files, the same ones in every run: each must be refused with Error{Format}. A file whose
// checksums were recomputed may pass, but must give a VDI that validate() accepts. With
// VDI_FUZZ_SECONDS=600, the last case continues with other files for that time. The test is also
// meant to run under sanitizers.
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#include <xxhash.h>

#include <array>
#include <cstring>

#include "tests/Catch.h"
#include "tests/FuzzTime.h"
#include "tests/io/Samples.h"
#include "vdi/core/Error.h"
#include "vdi/io/ListCodec.h"
#include "vdi/io/VdiFile.h"

using namespace vdi;

namespace {

enum class Outcome { Refused, Sound, Other };

template <typename Decode>
Outcome outcomeOfCall(Decode decode) {
  try {
    validate(decode());
    return Outcome::Sound;
  } catch (const Error& error) {
    return error.code() == ErrorCode::Format ? Outcome::Refused : Outcome::Other;
  } catch (...) {
    return Outcome::Other;
  }
}

/// Other: another exception, an invalid VDI, or a file that only one of the two decoders refuses.
Outcome outcomeOf(std::span<const std::byte> bytes) {
  // A copy of exactly this size lets a sanitizer notice every byte read beyond it.
  const std::vector<std::byte> copy(bytes.begin(), bytes.end());
  const Outcome outcome = outcomeOfCall([&copy] { return io::decode(copy); });
  const Outcome ofThinned = outcomeOfCall([&copy] { return io::decodeThinned(copy, {5, 3}).back(); });
  return ofThinned == outcome ? outcome : Outcome::Other;
}

void put64(std::vector<std::byte>& bytes, std::size_t offset, std::uint64_t value) {
  std::memcpy(bytes.data() + offset, &value, sizeof(value));
}

void put32(std::vector<std::byte>& bytes, std::size_t offset, std::uint32_t value) {
  std::memcpy(bytes.data() + offset, &value, sizeof(value));
}

std::uint32_t get32(const std::vector<std::byte>& bytes, std::size_t offset) {
  std::uint32_t value = 0;
  std::memcpy(&value, bytes.data() + offset, sizeof(value));
  return value;
}

/// Recomputes every checksum of a damaged file that its header and table still locate.
void reseal(std::vector<std::byte>& bytes) {
  const std::size_t chunks = get32(bytes, 40);
  const std::size_t room = (bytes.size() - test::headerBytes) / 16;
  std::size_t at = test::headerBytes + chunks * 16;
  for (std::size_t i = 0; i < chunks && chunks <= room; ++i) {
    const std::size_t packed = get32(bytes, test::headerBytes + i * 16 + 4);
    if (at + packed > bytes.size()) break;
    put64(bytes, test::headerBytes + i * 16 + 8, XXH64(bytes.data() + at, packed, 0));
    at += packed;
  }
  if (get32(bytes, 8) == 3 && at + 16 <= bytes.size())
    put64(bytes, at + 8, XXH64(bytes.data() + at + 16, bytes.size() - at - 16, 0));
  put64(bytes, 224, XXH64(bytes.data() + test::headerBytes, std::min(chunks, room) * 16, 0));
  put64(bytes, 232, XXH64(bytes.data(), 232, 0));
}

void flip(std::vector<std::byte>& bytes, std::size_t bit) {
  bytes[bit / 8] ^= static_cast<std::byte>(1U << (bit % 8));
}

/// One change anywhere, more often in the header, the chunk table and the first lists.
void alter(std::vector<std::byte>& bytes, test::Noise& noise) {
  const auto size = static_cast<std::uint32_t>(bytes.size());
  if (size < 8) return;
  const std::uint32_t from = noise.below(2) == 0 ? noise.below(size) : noise.below(std::min(size, 400U));
  const std::uint32_t length = std::min(1 + noise.below(16), size - from);
  const auto place = bytes.begin() + from;
  switch (noise.below(8)) {
    case 0: {  // an extreme number
      constexpr std::array<std::uint32_t, 6> numbers{0, 1, 0x7fffffff, 0x80000000, 0xffffffff, 0x7f800000};
      put32(bytes, std::min(from / 4 * 4, size - 4), numbers[noise.below(numbers.size())]);
      break;
    }
    case 1:
      bytes.erase(place, place + length);
      break;
    case 2:
      bytes.insert(place, length, static_cast<std::byte>(noise.below(256)));
      break;
    case 3:
      for (std::uint32_t i = 0; i < length; ++i) bytes[from + i] = static_cast<std::byte>(noise.below(256));
      break;
    default:
      flip(bytes, std::size_t{from} * 8 + noise.below(8));
  }
}

}  // namespace

TEST_CASE("a small file with any one bit flipped is refused") {
  const Vdi noisy = test::noisyVdi(6, 5, 4);
  const std::vector<std::byte> sound = io::encode(GENERATE(false, true) ? test::colored(noisy) : noisy);
  REQUIRE(outcomeOf(sound) == Outcome::Sound);
  std::size_t passed = 0;
  for (std::size_t bit = 0; bit < sound.size() * 8; ++bit) {
    std::vector<std::byte> damaged = sound;
    flip(damaged, bit);
    if (outcomeOf(damaged) != Outcome::Refused) ++passed;
  }
  CHECK(passed == 0);
}

TEST_CASE("a small file cut at any length, or with trailing bytes, is refused") {
  const Vdi noisy = test::noisyVdi(6, 5, 4);
  const std::vector<std::byte> sound = io::encode(GENERATE(false, true) ? test::colored(noisy) : noisy);
  std::size_t passed = 0;
  for (std::size_t length = 0; length < sound.size(); ++length) {
    if (outcomeOf(std::span(sound).first(length)) != Outcome::Refused) ++passed;
  }
  std::vector<std::byte> longer = sound;
  for (int i = 0; i < 300; ++i) {
    longer.push_back(static_cast<std::byte>(i));
    if (outcomeOf(longer) != Outcome::Refused) ++passed;
  }
  CHECK(passed == 0);
}

TEST_CASE("a file of several chunks, damaged in many ways, is refused") {
  const std::vector<std::byte> sound = io::encode(test::colored(test::plausibleVdi(130, 100, 8)));
  REQUIRE(outcomeOf(sound) == Outcome::Sound);
  test::Noise noise(11);
  const auto size = static_cast<std::uint32_t>(sound.size());
  std::size_t passed = 0;
  for (int i = 0; i < 600; ++i) {
    std::vector<std::byte> damaged = sound;
    const std::uint32_t from = noise.below(size);
    const std::uint32_t length = std::min(1 + noise.below(64), size - from);
    switch (i % 4) {
      case 0:
        flip(damaged, noise.below(size * 8));
        break;
      case 1:  // another value of a byte, then noise over the following bytes
        damaged[from] ^= static_cast<std::byte>(1 + noise.below(255));
        for (std::uint32_t j = 1; j < length; ++j)
          damaged[from + j] = static_cast<std::byte>(noise.below(256));
        break;
      case 2:
        damaged.erase(damaged.begin() + from, damaged.begin() + from + length);
        break;
      default:
        damaged.resize(from);
        break;
    }
    if (outcomeOf(damaged) != Outcome::Refused) ++passed;
  }
  CHECK(passed == 0);
}

TEST_CASE("flipped bits under valid checksums: refused, or a valid VDI") {
  const Vdi plausible = test::plausibleVdi(12, 9, 4);
  const std::vector<std::byte> sound =
      io::encode(GENERATE(false, true) ? test::colored(test::compact(plausible)) : plausible);
  std::size_t other = 0;
  std::size_t accepted = 0;
  for (std::size_t bit = 0; bit < sound.size() * 8; ++bit) {
    std::vector<std::byte> damaged = sound;
    flip(damaged, bit);
    reseal(damaged);
    const Outcome outcome = outcomeOf(damaged);
    if (outcome == Outcome::Other) ++other;
    if (outcome == Outcome::Sound) ++accepted;
  }
  CHECK(other == 0);
  CHECK(accepted > 0);  // with right checksums, the damage reached the decoder
}

TEST_CASE("noise under valid checksums: refused, or a valid VDI") {
  const Vdi plausible = test::plausibleVdi(100, 90, 6);
  const std::vector<std::byte> sound =
      io::encode(GENERATE(false, true) ? test::colored(test::compact(plausible)) : plausible);
  test::Noise noise(17);
  const auto dataStart = static_cast<std::uint32_t>(test::headerBytes + std::size_t{get32(sound, 40)} * 16);
  const auto size = static_cast<std::uint32_t>(sound.size());
  std::size_t other = 0;
  for (int i = 0; i < 500; ++i) {
    std::vector<std::byte> damaged = sound;
    const std::uint32_t first = i % 3 == 0 ? 0 : dataStart;
    for (std::uint32_t n = 1 + noise.below(8); n > 0; --n) {
      damaged[first + noise.below(size - first)] = static_cast<std::byte>(noise.below(256));
    }
    reseal(damaged);
    if (outcomeOf(damaged) == Outcome::Other) ++other;
  }
  CHECK(other == 0);
}

TEST_CASE("a file that claims more than it holds is refused before allocation") {
  const bool compact = GENERATE(false, true);
  const Vdi noisy = test::noisyVdi(40, 40, 40);
  std::vector<std::byte> claims = io::encode(compact ? test::compact(noisy) : noisy);
  REQUIRE(get32(claims, 40) == 1);  // the chunk count
  const std::uint64_t packed = get32(claims, test::headerBytes + 4);
  REQUIRE(packed > 100000);
  const std::uint64_t maxCount = (packed * 255 - 8 - 4 * 1600) / (compact ? 9 : 24);
  put32(claims, test::headerBytes, static_cast<std::uint32_t>(maxCount));
  put32(claims, 32, static_cast<std::uint32_t>(maxCount));  // the budget
  put64(claims, 48, maxCount);
  reseal(claims);
  // A separate process, because a process's largest size covers its whole life.
  const pid_t child = ::fork();
  if (child == 0) {
    const auto largestKilobytes = [] {
      rusage usage{};
      ::getrusage(RUSAGE_SELF, &usage);
      return usage.ru_maxrss;
    };
    const long before = largestKilobytes();
    const bool refused = outcomeOf(claims) == Outcome::Refused;
    const auto limit = static_cast<long>(maxCount * 8 / 1024 / 4);  // a quarter of the supersegments claimed
    ::_exit(refused && largestKilobytes() - before < limit ? 0 : 1);
  }
  int status = 0;
  REQUIRE(::waitpid(child, &status, 0) == child);
  CHECK(WIFEXITED(status));
  CHECK(WEXITSTATUS(status) == 0);
}

TEST_CASE("a packed chunk's expanded size is known without expanding it") {
  for (const Vdi& vdi :
       {test::plausibleVdi(20, 15, 5), test::noisyVdi(20, 15, 5), test::plausibleVdi(1, 1, 1)}) {
    const auto lists = vdi.listCount();
    io::detail::PackScratch scratch;
    const std::vector<std::byte> packed = io::detail::packLists(test::full(vdi), {}, 0, lists, scratch);
    const std::uint64_t expanded = chunkBytes(lists, vdi.supersegmentCount(), Precision::Full);
    CHECK(io::detail::announcedBytes(packed) == expanded);
    std::size_t same = 0;
    for (std::size_t length = 0; length < packed.size(); ++length) {
      if (io::detail::announcedBytes(std::span(packed).first(length)) == expanded) ++same;
    }
    CHECK(same == 0);
  }
}

TEST_CASE("meaningless bytes are refused") {
  test::Noise noise(23);
  const std::vector<std::byte> sound = io::encode(test::noisyVdi(6, 5, 4));
  std::size_t passed = 0;
  for (std::uint32_t i = 0; i < 2000; ++i) {
    std::vector<std::byte> bytes(noise.below(1000));
    for (std::byte& byte : bytes) byte = static_cast<std::byte>(noise.below(256));
    const std::size_t kept = std::min<std::size_t>(i % test::headerBytes, bytes.size());
    std::copy_n(sound.begin(), kept, bytes.begin());
    if (outcomeOf(bytes) != Outcome::Refused) ++passed;
  }
  CHECK(passed == 0);
}

TEST_CASE("noise in place of packed lists is refused, or fills exactly the requested lists") {
  test::Noise noise(31);
  const Vdi vdi = test::plausibleVdi(20, 15, 5);
  io::detail::PackScratch scratch;
  const std::vector<std::byte> sound = io::detail::packLists(test::full(vdi), {}, 0, 300, scratch);
  std::size_t refused = 0;
  for (int i = 0; i < 3000; ++i) {
    std::vector<std::byte> packed = sound;
    for (std::uint32_t n = 1 + noise.below(4); n > 0; --n) {
      packed[noise.below(static_cast<std::uint32_t>(packed.size()))] =
          static_cast<std::byte>(noise.below(256));
    }
    std::vector<std::uint32_t> ends(300);
    std::vector<Supersegment> segments(test::full(vdi).segments.size());
    try {
      io::detail::unpackLists(packed, 0, ends, std::span(segments));
      CHECK(ends.back() == segments.size());
      CHECK(std::is_sorted(ends.begin(), ends.end()));
    } catch (const Error& error) {
      CHECK(error.code() == ErrorCode::Format);
      ++refused;
    }
  }
  CHECK(refused > 0);
}

TEST_CASE("files altered at random are refused, or valid VDIs") {
  const Vdi small = test::plausibleVdi(12, 9, 4);
  const Vdi large = test::plausibleVdi(100, 90, 6);
  const std::vector<std::vector<std::byte>> sound{
      io::encode(small), io::encode(test::colored(test::compact(small))), io::encode(test::compact(large)),
      io::encode(test::colored(large)), io::encode(test::noisyVdi(6, 5, 4))};
  std::size_t refused = 0;
  std::size_t accepted = 0;
  std::uint64_t seed = test::fuzzSeed();
  for (const test::FuzzTime time(1.0); !time.isOver(); ++seed) {
    test::Noise noise(seed);
    std::vector<std::byte> bytes = sound[noise.below(static_cast<std::uint32_t>(sound.size()))];
    for (std::uint32_t changes = 1 + noise.below(4); changes > 0; --changes) alter(bytes, noise);
    if (noise.below(8) > 0 && bytes.size() >= test::headerBytes) reseal(bytes);
    const Outcome outcome = outcomeOf(bytes);
    INFO(seed);
    REQUIRE(outcome != Outcome::Other);
    ++(outcome == Outcome::Refused ? refused : accepted);
  }
  CHECK(4 * refused > refused + accepted);
  CHECK(20 * accepted > refused + accepted);
}
