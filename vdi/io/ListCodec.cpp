#include "vdi/io/ListCodec.h"

#include <lz4.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>

#include "vdi/core/Error.h"

namespace vdi::io::detail {

namespace {

/// The bit patterns of a supersegment's floats. Prediction is integer arithmetic on them: floating point
/// would make the file depend on the rounding mode that the host program runs in.
struct Words {
  std::uint32_t front = 0;
  std::uint32_t back = 0;
  std::uint32_t opacity = 0;
  std::array<std::uint32_t, 3> color{};
};

Words wordsOf(const Supersegment& s) {
  return {std::bit_cast<std::uint32_t>(s.front),
          std::bit_cast<std::uint32_t>(s.back),
          std::bit_cast<std::uint32_t>(s.opacity),
          {std::bit_cast<std::uint32_t>(s.red), std::bit_cast<std::uint32_t>(s.green),
           std::bit_cast<std::uint32_t>(s.blue)}};
}

Supersegment segmentOf(const Words& w) {
  return {std::bit_cast<float>(w.front),    std::bit_cast<float>(w.back),
          std::bit_cast<float>(w.color[0]), std::bit_cast<float>(w.color[1]),
          std::bit_cast<float>(w.color[2]), std::bit_cast<float>(w.opacity)};
}

/// What a supersegment is predicted from.
struct Context {
  Words reference;         // the one at the same place of the list before
  std::uint32_t previous;  // where this one begins if it follows the last one without a gap
};

/// Premultiplied colours grow with opacity; the bit pattern of a float is close to its logarithm, so a factor
/// is a difference.
std::uint32_t predictColor(const Context& context, std::uint32_t opacity, std::size_t channel) {
  const std::uint32_t color = context.reference.color[channel];
  return color == 0 ? 0 : color + (opacity - context.reference.opacity);
}

/// Small differences of either sign become small numbers.
std::uint32_t fold(std::uint32_t difference) {
  return (difference << 1) ^ (0U - (difference >> 31));
}
std::uint32_t unfold(std::uint32_t folded) {
  return (folded >> 1) ^ (0U - (folded & 1U));
}

/// The order of the columns in the file.
constexpr std::size_t columns = 6;
using Residuals = std::array<std::uint32_t, columns>;

Residuals residualsOf(const Words& w, const Context& context) {
  return {fold(w.front - context.previous),
          w.back - w.front,  // never negative
          fold(w.opacity - context.reference.opacity),
          fold(w.color[0] - predictColor(context, w.opacity, 0)),
          fold(w.color[1] - predictColor(context, w.opacity, 1)),
          fold(w.color[2] - predictColor(context, w.opacity, 2))};
}

Words restore(const Residuals& residuals, const Context& context) {
  Words w;
  w.front = context.previous + unfold(residuals[0]);
  w.back = w.front + residuals[1];
  w.opacity = context.reference.opacity + unfold(residuals[2]);
  for (std::size_t c = 0; c < 3; ++c) {
    w.color[c] = predictColor(context, w.opacity, c) + unfold(residuals[3 + c]);
  }
  return w;
}

/// Walks the supersegments of a chunk in order: which one each is predicted from, by index in the chunk.
class Walk {
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
  std::pair<std::size_t, std::size_t> before_{0, 0};  // first index and count of the list before
  std::pair<std::size_t, std::size_t> list_{0, 0};
  std::size_t place_ = 0;
  std::size_t next_ = 0;
};

Context contextOf(const Walk::Step& step, std::span<const Supersegment> segments, std::size_t index) {
  Context context{};
  if (step.reference != Walk::none) context.reference = wordsOf(segments[step.reference]);
  context.previous =
      step.firstOfList ? context.reference.front : std::bit_cast<std::uint32_t>(segments[index - 1].back);
  return context;
}

/// Columns of 32-bit words, byte b of word i of a column of n at planes[b * n + i]: bytes of one significance
/// lie together, and the upper ones are mostly zero.
void putWord(std::byte* planes, std::size_t count, std::size_t i, std::uint32_t word) {
  for (std::size_t b = 0; b < 4; ++b) planes[b * count + i] = static_cast<std::byte>(word >> (8 * b));
}
std::uint32_t getWord(const std::byte* planes, std::size_t count, std::size_t i) {
  std::uint32_t word = 0;
  for (std::size_t b = 0; b < 4; ++b) {
    word |= static_cast<std::uint32_t>(planes[b * count + i]) << (8 * b);
  }
  return word;
}

[[noreturn]] void fail(const char* what) {
  throw Error(ErrorCode::Format, what);
}

}  // namespace

bool canExpandTo(std::uint64_t packedBytes, std::uint64_t bytes) {
  if (bytes > LZ4_MAX_INPUT_SIZE) return false;
  // A byte of an LZ4 block stands for 255 bytes at most; what doesn't compress grows by 1/255.
  const auto bound = static_cast<std::uint64_t>(LZ4_compressBound(static_cast<int>(bytes)));
  return bytes <= packedBytes * 255 && packedBytes <= bound;
}

std::vector<std::byte> packLists(const SupersegmentLists& lists, std::size_t first, std::size_t last) {
  const std::size_t listCount = last - first;
  const std::size_t begin = lists.offsets[first];
  const std::size_t count = lists.offsets[last] - begin;
  const std::span<const Supersegment> segments = std::span(lists.segments).subspan(begin, count);
  const std::uint64_t size = expandedBytes(listCount, count);
  if (size > LZ4_MAX_INPUT_SIZE) throw Error(ErrorCode::Io, "too many supersegments in one chunk of lists");

  std::vector<std::byte> plain(size);
  std::byte* const columnData = plain.data() + listCount * sizeof(std::uint32_t);
  Walk walk;
  std::size_t index = 0;
  for (std::size_t i = 0; i < listCount; ++i) {
    const std::uint32_t length = lists.countOf(first + i);
    putWord(plain.data(), listCount, i, length);
    walk.beginList(length);
    for (std::uint32_t j = 0; j < length; ++j, ++index) {
      const Residuals residuals =
          residualsOf(wordsOf(segments[index]), contextOf(walk.step(), segments, index));
      for (std::size_t c = 0; c < columns; ++c)
        putWord(columnData + c * count * 4, count, index, residuals[c]);
    }
  }

  std::vector<std::byte> packed(static_cast<std::size_t>(LZ4_compressBound(static_cast<int>(size))));
  const int packedSize = LZ4_compress_default(reinterpret_cast<const char*>(plain.data()),
                                              reinterpret_cast<char*>(packed.data()), static_cast<int>(size),
                                              static_cast<int>(packed.size()));
  assert(packedSize > 0);  // the buffer holds any result
  packed.resize(static_cast<std::size_t>(packedSize));
  return packed;
}

void unpackLists(std::span<const std::byte> packed, std::uint32_t before, std::span<std::uint32_t> ends,
                 std::span<Supersegment> segments) {
  const std::size_t count = segments.size();
  const std::uint64_t size = expandedBytes(ends.size(), count);
  assert(canExpandTo(packed.size(), size));
  std::vector<std::byte> plain(size);
  const int got =
      LZ4_decompress_safe(reinterpret_cast<const char*>(packed.data()), reinterpret_cast<char*>(plain.data()),
                          static_cast<int>(packed.size()), static_cast<int>(size));
  if (got < 0 || static_cast<std::uint64_t>(got) != size) fail("it doesn't decompress to its size");

  const std::byte* const columnData = plain.data() + ends.size() * sizeof(std::uint32_t);
  Walk walk;
  std::size_t index = 0;
  for (std::size_t i = 0; i < ends.size(); ++i) {
    const std::uint32_t length = getWord(plain.data(), ends.size(), i);
    if (length > count - index) fail("it has more supersegments than announced");
    walk.beginList(length);
    for (std::uint32_t j = 0; j < length; ++j, ++index) {
      Residuals residuals;
      for (std::size_t c = 0; c < columns; ++c) {
        residuals[c] = getWord(columnData + c * count * 4, count, index);
      }
      segments[index] = segmentOf(restore(residuals, contextOf(walk.step(), segments, index)));
    }
    ends[i] = before + static_cast<std::uint32_t>(index);
  }
  if (index != count) fail("it has fewer supersegments than announced");
}

}  // namespace vdi::io::detail
