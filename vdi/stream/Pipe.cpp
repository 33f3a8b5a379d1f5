#include "vdi/stream/Pipe.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <thread>
#include <vector>

#include "vdi/core/Descriptor.h"
#include "vdi/core/Error.h"
#include "vdi/stream/Protocol.h"

namespace vdi::stream {

namespace {

constexpr std::size_t bufferBytes = std::size_t{256} << 10;

[[noreturn]] void failByErrno(const char* what) {
  throw Error(ErrorCode::Io, std::string(what) + ": " + std::strerror(errno));
}

/// Returns the part of the buffer that was read; none at the end.
std::span<const std::byte> readSome(int from, std::span<std::byte> buffer) {
  for (;;) {
    const ssize_t count = ::read(from, buffer.data(), buffer.size());
    if (count >= 0) return buffer.first(static_cast<std::size_t>(count));
    if (errno != EINTR) return {};
  }
}

/// Copies bytes until the input ends, the output fails, or `stop` has something to read.
void carry(int from, int to, int stop) {
  std::vector<std::byte> buffer(bufferBytes);
  for (;;) {
    std::array<pollfd, 2> ready{{{from, POLLIN, 0}, {stop, POLLIN, 0}}};
    if (::poll(ready.data(), ready.size(), -1) < 0 && errno != EINTR) return;
    if (ready[1].revents != 0) return;
    if (ready[0].revents == 0) continue;
    const std::span<const std::byte> bytes = readSome(from, buffer);
    if (bytes.empty() || !writeAll(to, bytes)) return;
  }
}

}  // namespace

std::string greeting(const std::string& token) {
  return std::string(subprotocol) + " " + token;
}

std::optional<std::string> tokenInGreeting(std::string_view line) {
  const std::string start = greeting("");
  if (line.ends_with('\r')) line.remove_suffix(1);
  if (!line.starts_with(start) || line.size() == start.size()) return std::nullopt;
  return std::string(line.substr(start.size()));
}

void serveOver(Server& server, const std::string& token, int input, int output) {
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0)
    failByErrno("can't connect to the server");
  const Descriptor socket(ends[0]);
  server.adopt(ends[1]);
  const Descriptor stop(::eventfd(0, EFD_CLOEXEC));
  if (!stop.isOpen()) failByErrno("can't connect to the server");

  const std::string first = greeting(token) + "\n";
  if (!writeAll(output, std::as_bytes(std::span(first)))) return;
  std::thread inwards([&] {
    carry(input, socket.number(), stop.number());
    ::shutdown(socket.number(), SHUT_WR);
  });
  std::vector<std::byte> buffer(bufferBytes);
  std::span<const std::byte> bytes;
  do {
    bytes = readSome(socket.number(), buffer);
  } while (!bytes.empty() && writeAll(output, bytes));
  const std::uint64_t one = 1;
  (void)!::write(stop.number(), &one, sizeof(one));
  ::shutdown(socket.number(), SHUT_RDWR);
  inwards.join();
}

}  // namespace vdi::stream
