#include "vdi/io/ListCodec.h"

#include <lz4.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cstring>

#include "vdi/core/BitCast.h"
#include "vdi/core/Error.h"

namespace vdi::io::detail {

namespace {

/// The columns of a chunk; each has one number per supersegment.
constexpr std::size_t columns = 6;
using Words = std::array<std::uint32_t, columns>;

/// Maps small differences of either sign to small numbers.
std::uint32_t fold(std::uint32_t difference) {
  return (difference << 1) ^ (0U - (difference >> 31));
}
std::uint32_t unfold(std::uint32_t folded) {
  return (folded >> 1) ^ (0U - (folded & 1U));
}

/// The context of a prediction: the supersegment at the same position in the previous list, and the depth
/// where this one begins if it follows the previous one without a gap.
template <typename Coding>
struct Context {
  typename Coding::Fields reference{};
  std::uint32_t previous = 0;
};

/// Encoding 0. Fields are the bit patterns of floats. Prediction is integer arithmetic on them: floating
/// point would make the file depend on the host program's rounding mode.
struct FullCoding {
  using Segment = Supersegment;
  static constexpr std::array<std::size_t, columns> bytes{4, 4, 4, 4, 4, 4};

  struct Fields {
    std::uint32_t front = 0;
    std::uint32_t back = 0;
    std::uint32_t opacity = 0;
    std::array<std::uint32_t, 3> color{};
  };

  static Fields fieldsOf(const Segment& s) {
    return {
        bit_cast<std::uint32_t>(s.front),
        bit_cast<std::uint32_t>(s.back),
        bit_cast<std::uint32_t>(s.opacity),
        {bit_cast<std::uint32_t>(s.red), bit_cast<std::uint32_t>(s.green), bit_cast<std::uint32_t>(s.blue)}};
  }

  static Segment segmentOf(const Fields& f) {
    return {bit_cast<float>(f.front),    bit_cast<float>(f.back),     bit_cast<float>(f.color[0]),
            bit_cast<float>(f.color[1]), bit_cast<float>(f.color[2]), bit_cast<float>(f.opacity)};
  }

  /// Premultiplied colours grow with opacity. A float's bit pattern is close to its logarithm, so a factor
  /// becomes a difference.
  static std::uint32_t predictColor(const Context<FullCoding>& context, std::uint32_t opacity,
                                    std::size_t channel) {
    const std::uint32_t color = context.reference.color[channel];
    return color == 0 ? 0 : color + (opacity - context.reference.opacity);
  }

  static Words residualsOf(const Fields& f, const Context<FullCoding>& context) {
    return {fold(f.front - context.previous),
            f.back - f.front,  // never negative
            fold(f.opacity - context.reference.opacity),
            fold(f.color[0] - predictColor(context, f.opacity, 0)),
            fold(f.color[1] - predictColor(context, f.opacity, 1)),
            fold(f.color[2] - predictColor(context, f.opacity, 2))};
  }

  static Fields restore(const Words& residuals, const Context<FullCoding>& context) {
    Fields f;
    f.front = context.previous + unfold(residuals[0]);
    f.back = f.front + residuals[1];
    f.opacity = context.reference.opacity + unfold(residuals[2]);
    for (std::size_t c = 0; c < 3; ++c)
      f.color[c] = predictColor(context, f.opacity, c) + unfold(residuals[3 + c]);
    return f;
  }
};

/// Encoding 1. Fields are the codes of a CompactSupersegment. Colours are straight, so they do not depend on
/// opacity; their residuals are differences modulo 256.
struct CompactCoding {
  using Segment = CompactSupersegment;
  /// Codes of 14 or 12 bits take two bytes; LZ4 removes nearly all of the padding.
  static constexpr std::array<std::size_t, columns> bytes{2, 2, 2, 1, 1, 1};

  struct Fields {
    std::uint32_t front = 0;
    std::uint32_t back = 0;
    std::uint32_t opticalDepth = 0;
    std::array<std::uint32_t, 3> color{};
  };

  static Fields fieldsOf(const Segment& s) {
    return {s.front(), s.back(), s.opticalDepth(), {s.color(0), s.color(1), s.color(2)}};
  }

  static Segment segmentOf(const Fields& f) {
    return Segment::pack(f.front & 0x3fffU, f.back & 0x3fffU, f.color[0] & 0xffU, f.color[1] & 0xffU,
                         f.color[2] & 0xffU, f.opticalDepth & 0xfffU);
  }

  /// Folds a difference as a signed byte.
  static std::uint32_t foldByte(std::uint32_t difference) {
    return fold((difference & 0xffU) < 128 ? difference & 0xffU : difference | ~0xffU) & 0xffU;
  }

  static Words residualsOf(const Fields& f, const Context<CompactCoding>& context) {
    return {fold(f.front - context.previous),
            f.back - f.front,
            fold(f.opticalDepth - context.reference.opticalDepth),
            foldByte(f.color[0] - context.reference.color[0]),
            foldByte(f.color[1] - context.reference.color[1]),
            foldByte(f.color[2] - context.reference.color[2])};
  }

  static Fields restore(const Words& residuals, const Context<CompactCoding>& context) {
    Fields f;
    f.front = (context.previous + unfold(residuals[0])) & 0x3fffU;
    f.back = (f.front + residuals[1]) & 0x3fffU;
    f.opticalDepth = (context.reference.opticalDepth + unfold(residuals[2])) & 0xfffU;
    for (std::size_t c = 0; c < 3; ++c)
      f.color[c] = (context.reference.color[c] + unfold(residuals[3 + c])) & 0xffU;
    return f;
  }
};

template <typename Segment>
struct CodingFor;
template <>
struct CodingFor<Supersegment> {
  using Type = FullCoding;
};
template <>
struct CodingFor<CompactSupersegment> {
  using Type = CompactCoding;
};
template <typename Segment>
using CodingOf = typename CodingFor<Segment>::Type;

constexpr std::size_t sumOf(const std::array<std::size_t, columns>& bytes) {
  std::size_t sum = 0;
  for (const std::size_t each : bytes) sum += each;
  return sum;
}
#define VDI_CHECK_CODING(Segment) \
  static_assert(sumOf(CodingOf<Segment>::bytes) == EncodingOf<Segment>::chunkBytes);
VDI_EACH_ENCODING(VDI_CHECK_CODING)
#undef VDI_CHECK_CODING

/// Bytes of the depth code at the start of a chunk.
template <typename Segment>
constexpr std::size_t codeBytes = EncodingOf<Segment>::hasDepthCode ? sizeof(DepthCode) : 0;

/// Visits the supersegments of a chunk in order, with the index in the chunk of the one that predicts each.
class Traversal {
 public:
  static constexpr std::size_t none = ~std::size_t{0};

  void beginList(std::size_t count) {
    before_ = {list_.first, list_.second};
    list_ = {next_, count};
    place_ = 0;
  }
  struct Step {
    std::size_t reference;  // none for the chunk's first
    bool firstOfList;
  };
  Step step() {
    const Step result{reference(), place_ == 0};
    ++next_;
    ++place_;
    return result;
  }

 private:
  std::size_t reference() const {
    const auto [first, count] = before_;
    if (count > 0) return first + std::min(place_, count - 1);
    return next_ > 0 ? next_ - 1 : none;
  }
  std::pair<std::size_t, std::size_t> before_{0, 0};  // first index and count of the previous list
  std::pair<std::size_t, std::size_t> list_{0, 0};
  std::size_t place_ = 0;
  std::size_t next_ = 0;
};

template <typename Coding>
Context<Coding> contextOf(const Traversal::Step& step, std::span<const typename Coding::Segment> segments,
                          std::size_t index) {
  Context<Coding> context;
  if (step.reference != Traversal::none) context.reference = Coding::fieldsOf(segments[step.reference]);
  context.previous = step.firstOfList ? context.reference.front : Coding::fieldsOf(segments[index - 1]).back;
  return context;
}

/// Columns of numbers of `bytes` bytes: byte b of number i, in a column of n, is at planes[b * n + i]. Bytes
/// of equal significance lie together, and the upper ones are mostly zero.
void putWord(std::byte* planes, std::size_t count, std::size_t i, std::uint32_t word, std::size_t bytes) {
  for (std::size_t b = 0; b < bytes; ++b) planes[b * count + i] = static_cast<std::byte>(word >> (8 * b));
}
std::uint32_t getWord(const std::byte* planes, std::size_t count, std::size_t i, std::size_t bytes) {
  std::uint32_t word = 0;
  for (std::size_t b = 0; b < bytes; ++b)
    word |= static_cast<std::uint32_t>(planes[b * count + i]) << (8 * b);
  return word;
}

[[noreturn]] void fail(const char* what) {
  throw Error(ErrorCode::Format, what);
}

}  // namespace

bool canExpandTo(std::uint64_t packedBytes, std::uint64_t bytes) {
  if (bytes > LZ4_MAX_INPUT_SIZE) return false;
  // A byte of an LZ4 block expands to at most 255 bytes; incompressible data grows by 1/255.
  const auto bound = static_cast<std::uint64_t>(LZ4_compressBound(static_cast<int>(bytes)));
  return bytes <= packedBytes * 255 && packedBytes <= bound;
}

std::optional<std::uint64_t> announcedBytes(std::span<const std::byte> packed) {
  // A block has sequences of a token, literals, and a match's offset and length; the last one ends after its
  // literals. LZ4's "Block Format Description" has the details.
  constexpr std::size_t more = 15;  // in a 4-bit length: bytes follow, up to the first that is not 255
  constexpr std::size_t offsetBytes = 2;
  constexpr std::size_t shortestMatch = 4;
  std::uint64_t total = 0;
  std::size_t at = 0;
  const auto lengthOf = [&](std::size_t bits) {  // leaves `at` beyond the end if the block is cut short
    std::uint64_t length = bits;
    std::size_t byte = bits == more ? 255 : 0;
    while (byte == 255) {
      byte = at < packed.size() ? std::to_integer<std::size_t>(packed[at]) : 0;
      length += byte;
      ++at;
    }
    return length;
  };
  while (at < packed.size()) {
    const auto token = std::to_integer<std::size_t>(packed[at++]);
    const std::uint64_t literals = lengthOf(token >> 4U);
    if (at > packed.size() || literals > packed.size() - at) return std::nullopt;
    at += literals;
    total += literals;
    if (at == packed.size()) return total;
    at += offsetBytes;
    total += lengthOf(token & more) + shortestMatch;
  }
  return std::nullopt;
}

template <typename Segment>
std::vector<std::byte> packLists(const ListsOf<Segment>& lists, const DepthCode& code, std::size_t first,
                                 std::size_t last, PackScratch& scratch) {
  using Coding = CodingOf<Segment>;
  const std::size_t listCount = last - first;
  const std::size_t begin = lists.offsets[first];
  const std::size_t count = lists.offsets[last] - begin;
  const std::span<const Segment> segments = std::span(lists.segments).subspan(begin, count);
  const std::uint64_t size = chunkBytes(listCount, count, EncodingOf<Segment>::precision);
  if (size > LZ4_MAX_INPUT_SIZE) throw Error(ErrorCode::Io, "too many supersegments in one chunk of lists");

  HostVector<std::byte>& plain = scratch.plain;
  plain.resize(size);  // all of which is written below
  std::byte* const lengths = plain.data() + codeBytes<Segment>;
  std::byte* const columnData = lengths + listCount * sizeof(std::uint32_t);
  std::memcpy(plain.data(), &code, codeBytes<Segment>);
  Traversal traversal;
  std::size_t index = 0;
  for (std::size_t i = 0; i < listCount; ++i) {
    const std::uint32_t length = lists.countOf(first + i);
    putWord(lengths, listCount, i, length, sizeof(length));
    traversal.beginList(length);
    for (std::uint32_t j = 0; j < length; ++j, ++index) {
      const Words residuals = Coding::residualsOf(Coding::fieldsOf(segments[index]),
                                                  contextOf<Coding>(traversal.step(), segments, index));
      std::byte* column = columnData;
      for (std::size_t c = 0; c < columns; ++c) {
        putWord(column, count, index, residuals[c], Coding::bytes[c]);
        column += count * Coding::bytes[c];
      }
    }
  }

  HostVector<std::byte>& packed = scratch.packed;
  packed.resize(static_cast<std::size_t>(LZ4_compressBound(static_cast<int>(size))));
  const int packedSize = LZ4_compress_default(reinterpret_cast<const char*>(plain.data()),
                                              reinterpret_cast<char*>(packed.data()), static_cast<int>(size),
                                              static_cast<int>(packed.size()));
  assert(packedSize > 0);  // the buffer fits any result
  return {packed.begin(), packed.begin() + packedSize};
}

template <typename Segment>
DepthCode unpackLists(std::span<const std::byte> packed, std::uint32_t before, std::span<std::uint32_t> ends,
                      std::span<Segment> segments) {
  using Coding = CodingOf<Segment>;
  const std::size_t count = segments.size();
  const std::uint64_t size = chunkBytes(ends.size(), count, EncodingOf<Segment>::precision);
  assert(canExpandTo(packed.size(), size));
  std::vector<std::byte> plain(size);
  const int got =
      LZ4_decompress_safe(reinterpret_cast<const char*>(packed.data()), reinterpret_cast<char*>(plain.data()),
                          static_cast<int>(packed.size()), static_cast<int>(size));
  if (got < 0 || static_cast<std::uint64_t>(got) != size)
    fail("a chunk doesn't decompress to the size that it should have");

  const std::byte* const lengths = plain.data() + codeBytes<Segment>;
  const std::byte* const columnData = lengths + ends.size() * sizeof(std::uint32_t);
  DepthCode code;
  std::memcpy(&code, plain.data(), codeBytes<Segment>);
  Traversal traversal;
  std::size_t index = 0;
  for (std::size_t i = 0; i < ends.size(); ++i) {
    const std::uint32_t length = getWord(lengths, ends.size(), i, sizeof(length));
    if (length > count - index) fail("it has more supersegments than announced");
    traversal.beginList(length);
    for (std::uint32_t j = 0; j < length; ++j, ++index) {
      Words residuals;
      const std::byte* column = columnData;
      for (std::size_t c = 0; c < columns; ++c) {
        residuals[c] = getWord(column, count, index, Coding::bytes[c]);
        column += count * Coding::bytes[c];
      }
      segments[index] =
          Coding::segmentOf(Coding::restore(residuals, contextOf<Coding>(traversal.step(), segments, index)));
    }
    ends[i] = before + static_cast<std::uint32_t>(index);
  }
  if (index != count) fail("it has fewer supersegments than announced");
  return code;
}

#define VDI_LIST_CODEC(Segment)                                                                       \
  template std::vector<std::byte> packLists(const ListsOf<Segment>&, const DepthCode&, std::size_t,   \
                                            std::size_t, PackScratch&);                               \
  template DepthCode unpackLists(std::span<const std::byte>, std::uint32_t, std::span<std::uint32_t>, \
                                 std::span<Segment>);
VDI_EACH_ENCODING(VDI_LIST_CODEC)
#undef VDI_LIST_CODEC

}  // namespace vdi::io::detail
