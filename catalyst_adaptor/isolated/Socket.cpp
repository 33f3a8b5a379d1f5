#include "catalyst_adaptor/isolated/Socket.h"

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <random>
#include <stdexcept>
#include <utility>

namespace vdi::catalyst {

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t mostDescriptors = 4;

/// An abstract address, which needs no folder and leaves nothing behind.
std::pair<sockaddr_un, socklen_t> addressOf(const std::string& name) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::size_t length = std::min(name.size(), sizeof address.sun_path - 1);
  std::memcpy(address.sun_path + 1, name.data(), length);
  return {address, static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + length)};
}

int newSocket() {
  return ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
}

const sockaddr* generic(const sockaddr_un& address) {
  return reinterpret_cast<const sockaddr*>(&address);
}

/// Waits until the descriptor has something to read, or its other end is gone.
bool waitFor(int descriptor, std::chrono::milliseconds patience) {
  const auto end = Clock::now() + patience;
  pollfd events{descriptor, POLLIN, 0};
  for (;;) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(end - Clock::now()).count();
    const int limit = patience.count() < 0 ? -1 : static_cast<int>(std::max<std::int64_t>(left, 0));
    const int ready = poll(&events, 1, limit);
    if (ready > 0) return true;
    if (ready == 0 || errno != EINTR) return false;
  }
}

bool isOfThisUser(int descriptor) {
  ucred other{};
  socklen_t size = sizeof other;
  return getsockopt(descriptor, SOL_SOCKET, SO_PEERCRED, &other, &size) == 0 && other.uid == geteuid();
}

}  // namespace

std::string newSocketName() {
  std::random_device random;
  std::array<char, 64> name{};
  std::snprintf(name.data(), name.size(), "pv-vdi-%08x%08x%08x", random(), random(), random());
  return name.data();
}

Socket Socket::listener(const std::string& name) {
  Descriptor descriptor(newSocket());
  const auto [address, size] = addressOf(name);
  constexpr int waiting = 8;
  if (!descriptor.isOpen() || bind(descriptor.number(), generic(address), size) != 0 ||
      listen(descriptor.number(), waiting) != 0)
    throw std::runtime_error(std::string("no socket for the process that makes frames: ") +
                             std::strerror(errno));
  return Socket(std::move(descriptor));
}

Socket Socket::connectTo(const std::string& name) {
  Descriptor descriptor(newSocket());
  const auto [address, size] = addressOf(name);
  if (!descriptor.isOpen() || ::connect(descriptor.number(), generic(address), size) != 0 ||
      !isOfThisUser(descriptor.number()))
    return {};
  return Socket(std::move(descriptor));
}

Socket Socket::accept(std::chrono::milliseconds patience) const {
  if (!waitFor(number(), patience)) return {};
  Descriptor descriptor(accept4(number(), nullptr, nullptr, SOCK_CLOEXEC));
  if (!descriptor.isOpen() || !isOfThisUser(descriptor.number())) return {};
  return Socket(std::move(descriptor));
}

bool Socket::send(std::span<const std::byte> message, std::span<const int> descriptors) const {
  if (!isOpen() || message.size() > longest || descriptors.size() > mostDescriptors) return false;
  iovec part{const_cast<std::byte*>(message.data()), message.size()};
  alignas(cmsghdr) std::array<std::byte, CMSG_SPACE(mostDescriptors * sizeof(int))> control{};
  msghdr header{};
  header.msg_iov = &part;
  header.msg_iovlen = 1;
  if (!descriptors.empty()) {
    header.msg_control = control.data();
    header.msg_controllen = CMSG_SPACE(descriptors.size_bytes());
    cmsghdr* rights = CMSG_FIRSTHDR(&header);
    rights->cmsg_level = SOL_SOCKET;
    rights->cmsg_type = SCM_RIGHTS;
    rights->cmsg_len = CMSG_LEN(descriptors.size_bytes());
    std::memcpy(CMSG_DATA(rights), descriptors.data(), descriptors.size_bytes());
  }
  ssize_t sent = -1;
  do {
    sent = sendmsg(number(), &header, MSG_NOSIGNAL | MSG_DONTWAIT);
  } while (sent < 0 && errno == EINTR);
  return sent == static_cast<ssize_t>(message.size());
}

Socket::Received Socket::receive(std::chrono::milliseconds patience) const {
  Received received;
  if (!isOpen()) {
    received.result = Result::Gone;
    return received;
  }
  if (!waitFor(number(), patience)) return received;
  received.message.resize(longest);
  iovec part{received.message.data(), received.message.size()};
  alignas(cmsghdr) std::array<std::byte, CMSG_SPACE(mostDescriptors * sizeof(int))> control{};
  msghdr header{};
  header.msg_iov = &part;
  header.msg_iovlen = 1;
  header.msg_control = control.data();
  header.msg_controllen = control.size();
  ssize_t count = -1;
  do {
    count = recvmsg(number(), &header, MSG_CMSG_CLOEXEC | MSG_DONTWAIT);
  } while (count < 0 && errno == EINTR);
  if (count < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) return received;
  if (count <= 0) {
    received.result = Result::Gone;
    return received;
  }
  received.result = Result::Message;
  received.message.resize(static_cast<std::size_t>(count));
  for (cmsghdr* rights = CMSG_FIRSTHDR(&header); rights != nullptr; rights = CMSG_NXTHDR(&header, rights)) {
    if (rights->cmsg_level != SOL_SOCKET || rights->cmsg_type != SCM_RIGHTS) continue;
    const std::size_t bytes = rights->cmsg_len - CMSG_LEN(0);
    for (std::size_t at = 0; at + sizeof(int) <= bytes; at += sizeof(int)) {
      int number = -1;
      std::memcpy(&number, CMSG_DATA(rights) + at, sizeof number);
      received.descriptors.emplace_back(number);
    }
  }
  return received;
}

pid_t Socket::peer() const {
  ucred other{};
  socklen_t size = sizeof other;
  return isOpen() && getsockopt(number(), SOL_SOCKET, SO_PEERCRED, &other, &size) == 0 ? other.pid : 0;
}

}  // namespace vdi::catalyst
