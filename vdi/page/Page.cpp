#include "vdi/page/Page.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <cassert>
#include <cstdint>
#include <new>
#include <string_view>

#include "PageTemplate.h"
#include "vdi/core/Error.h"
#include "vdi/core/Estimate.h"
#include "vdi/core/Markup.h"
#include "vdi/core/Parallel.h"
#include "vdi/io/Files.h"
#include "vdi/io/VdiFile.h"
#include "vdi/page/PlainChunks.h"

namespace vdi::page {

namespace {

/// Compresses bytes to raw deflate data.
class Deflater {
 public:
  Deflater() {
    constexpr int rawWindow = -15;
    constexpr int memoryLevel = 9;
    if (deflateInit2(&stream_, level, Z_DEFLATED, rawWindow, memoryLevel, Z_DEFAULT_STRATEGY) != Z_OK)
      throw std::bad_alloc();
  }
  ~Deflater() { deflateEnd(&stream_); }
  Deflater(const Deflater&) = delete;
  Deflater& operator=(const Deflater&) = delete;

  /// Compresses a part of a stream. The results, one after the other, make up the compressed stream.
  std::vector<std::byte> part(std::span<const std::byte> bytes, bool isLast) {
    std::vector<std::byte> packed(deflateBound(&stream_, bytes.size()) + syncBytes);
    stream_.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(bytes.data()));  // zlib only reads it
    stream_.avail_in = static_cast<uInt>(bytes.size());
    stream_.next_out = reinterpret_cast<Bytef*>(packed.data());
    stream_.avail_out = static_cast<uInt>(packed.size());
    [[maybe_unused]] const int state = deflate(&stream_, isLast ? Z_FINISH : Z_SYNC_FLUSH);
    assert(state == (isLast ? Z_STREAM_END : Z_OK) && stream_.avail_in == 0);
    packed.resize(packed.size() - stream_.avail_out);
    return packed;
  }

 private:
  static constexpr int level = 6;  // level 9 saves a hundredth in eight times the time
  static constexpr std::size_t syncBytes = 16;
  z_stream stream_{};
};

/// Compresses parts of a fixed size, so that all cores work and the result doesn't depend on their number.
std::vector<std::byte> deflated(std::span<const std::byte> bytes) {
  constexpr std::size_t partBytes = std::size_t{1} << 20U;
  std::vector<std::vector<std::byte>> parts(
      std::max<std::size_t>((bytes.size() + partBytes - 1) / partBytes, 1));
  inParallel(parts.size(), 1, [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i) {
      const std::size_t begin = i * partBytes;
      const auto part = bytes.subspan(begin, std::min(partBytes, bytes.size() - begin));
      parts[i] = Deflater().part(part, i + 1 == parts.size());
    }
  });
  std::vector<std::byte> packed;
  for (const std::vector<std::byte>& part : parts) packed.insert(packed.end(), part.begin(), part.end());
  return packed;
}

std::string base64(std::span<const std::byte> bytes) {
  constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t word = 0;
    for (std::size_t b = 0; b < 3; ++b)
      word = word << 8U | (b < count ? std::to_integer<std::uint32_t>(bytes[i + b]) : 0U);
    for (std::size_t d = 0; d < 4; ++d) text += d <= count ? digits[(word >> (18 - 6 * d)) & 63U] : '=';
  }
  return text;
}

/// The page before and after the frames.
struct Shell {
  std::string before;
  std::string after;
};

/// `connect`: the value of connect-src in the page's Content-Security-Policy.
Shell shellOf(const std::string& title, std::string_view connect) {
  constexpr std::string_view titlePlace = "@TITLE@";
  constexpr std::string_view dataPlace = "@DATA@";
  std::string page(pageTemplate);
  const std::size_t data = page.find(dataPlace);
  Shell shell{page.substr(0, data), page.substr(data + dataPlace.size())};
  constexpr std::string_view connectPlace = "@CONNECT@";
  shell.before.replace(shell.before.find(connectPlace), connectPlace.size(), connect);
  const std::string text = escaped(title);
  for (std::size_t at = shell.before.find(titlePlace); at != std::string::npos;
       at = shell.before.find(titlePlace, at + text.size())) {
    shell.before.replace(at, titlePlace.size(), text);
  }
  return shell;
}

std::string elementOf(const PageFrame& frame) {
  constexpr std::size_t longestText = (std::size_t{1} << 29U) - 64;  // of a string in Chromium
  const std::vector<std::byte> file = frame.file();
  const io::VdiFileInfo info = io::decodeInfo(file);
  requireFitsPages(
      static_cast<std::uint64_t>(info.header.width) * static_cast<std::uint64_t>(info.header.height),
      info.supersegmentCount, info.header.precision());
  const std::vector<std::byte> plain = withPlainChunks(file);
  const std::vector<std::byte> packed = deflated(plain);
  if (packed.size() / 3 * 4 + 4 > longestText)
    throw Error(ErrorCode::Io, "the VDI is too large for a page", frame.name);
  return fmt::format(
      "<script class=\"vdi-frame\" type=\"application/octet-stream\" data-name=\"{}\" "
      "data-size=\"{}\">{}</script>\n",
      escaped(frame.name), plain.size(), base64(packed));
}

/// Writes texts to an OutputFile, one after the other.
class Writer {
 public:
  explicit Writer(const std::filesystem::path& path) : file_(path) {}
  void write(const std::string& text) {
    file_.write(offset_, std::as_bytes(std::span(text)));
    offset_ += text.size();
  }
  void commit() { file_.commit(); }

 private:
  io::OutputFile file_;
  std::uint64_t offset_ = 0;
};

}  // namespace

std::vector<PageFrame> framesOf(std::span<const std::filesystem::path> files) {
  std::vector<PageFrame> frames;
  frames.reserve(files.size());
  for (const std::filesystem::path& path : files) {
    frames.push_back({path.filename().string(), [path] { return io::InputFile(path).readAll(); }});
  }
  return frames;
}

void writePage(const std::filesystem::path& path, const std::string& title,
               std::span<const PageFrame> frames) {
  if (frames.empty()) throw Error(ErrorCode::InvalidArgument, "a page needs at least one VDI");
  const Shell shell = shellOf(title, "'none'");
  Writer writer(path);
  writer.write(shell.before);
  for (const PageFrame& frame : frames) {
    try {
      writer.write(elementOf(frame));
    } catch (const Error& error) {
      if (error.code() != ErrorCode::Format && error.code() != ErrorCode::OutOfMemory) throw;
      throw Error(error.code(), error.what(), frame.name);
    }
  }
  writer.write(shell.after);
  writer.commit();
}

std::string emptyPage(const std::string& title) {
  const Shell shell = shellOf(title, "'self'");
  return shell.before + shell.after;
}

}  // namespace vdi::page
