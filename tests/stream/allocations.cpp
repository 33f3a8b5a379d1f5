// A server whose process runs out of memory. In each round, one allocation of the server's or the publisher's
// threads fails while a viewer connects and a frame is published. No thread ends the process, and the next
// viewer gets the next frame.
//
// stream_allocations [growth]: after allocation n, allocation growth * n + 1 fails; 1.0 tries all.
#include <sys/resource.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <new>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "tests/io/Samples.h"
#include "vdi/core/Error.h"
#include "vdi/stream/Client.h"
#include "vdi/stream/Publisher.h"
#include "vdi/stream/Server.h"
#include "vdi/stream/Token.h"

namespace {

std::atomic<std::int64_t> toGo{0};  // the allocation that fails; 0: none does
std::atomic<bool> hasFailed = false;
std::atomic<id_t> serverThread{0};
std::atomic<id_t> endingThread{0};  // the thread that destroys the server

/// Whether this thread is the server's or the publisher's, or one that helps the publisher. A publisher's
/// threads have a niceness.
bool isServing() {
  static thread_local const id_t self = static_cast<id_t>(::gettid());
  return self == serverThread || self == endingThread || ::getpriority(PRIO_PROCESS, self) > 0;
}

void* allocated(std::size_t bytes) {
  if (toGo > 0 && isServing() && --toGo == 0) {
    hasFailed = true;
    return nullptr;
  }
  return std::malloc(bytes > 0 ? bytes : 1);
}

void* allocatedOrThrown(std::size_t bytes) {
  void* memory = allocated(bytes);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

}  // namespace

void* operator new(std::size_t bytes) {
  return allocatedOrThrown(bytes);
}
void* operator new[](std::size_t bytes) {
  return allocatedOrThrown(bytes);
}
void* operator new(std::size_t bytes, const std::nothrow_t&) noexcept {
  return allocated(bytes);
}
void* operator new[](std::size_t bytes, const std::nothrow_t&) noexcept {
  return allocated(bytes);
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete[](void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}
void operator delete[](void* memory, std::size_t) noexcept {
  std::free(memory);
}

namespace {

using namespace std::chrono_literals;
using namespace vdi;

int wrong = 0;

void expect(bool holds, std::int64_t allocation, const char* what) {
  if (holds) return;
  ++wrong;
  std::fprintf(stderr, "FAILED  allocation %lld: %s\n", static_cast<long long>(allocation), what);
}

/// The thread that exists after `make` and didn't before.
template <typename Make>
id_t threadMadeBy(Make make) {
  const auto threads = [] {
    std::set<id_t> all;
    for (const auto& entry : std::filesystem::directory_iterator("/proc/self/task"))
      all.insert(static_cast<id_t>(std::stoul(entry.path().filename())));
    return all;
  };
  const std::set<id_t> before = threads();
  make();
  for (const id_t thread : threads()) {
    if (before.count(thread) == 0) return thread;
  }
  return 0;
}

class Service {
 public:
  Service() {
    stream::ServerOptions options;
    options.token = stream::randomToken();
    options.page = "<p>page</p>";
    options.steer = [](std::uint32_t, const stream::Wish&) {};
    serverThread = threadMadeBy([&] { server_.emplace(std::move(options)); });
    publisher_.emplace(*server_);
  }
  void publish() {
    Vdi vdi = test::plausibleVdi(40, 30, 8);
    vdi.timeStep = ++step_;
    publisher_->publish(std::make_shared<const Vdi>(std::move(vdi)));
  }
  std::unique_ptr<stream::Client> client() const {
    stream::ClientOptions options;
    options.url = stream::parseUrl(server_->link());
    return std::make_unique<stream::Client>(std::move(options));
  }
  std::uint64_t step() const { return step_; }
  const stream::Server& server() const { return *server_; }

 private:
  std::optional<stream::Server> server_;
  std::optional<stream::Publisher> publisher_;
  std::uint64_t step_ = 0;
};

/// Whether the client gets all levels of that step in time.
bool getsStep(stream::Client& client, std::uint64_t step, std::chrono::milliseconds patience) {
  const auto until = std::chrono::steady_clock::now() + patience;
  while (std::chrono::steady_clock::now() < until) {
    const std::optional<stream::Received> received = client.next(50ms);
    if (received && received->level.step == step && received->level.level + 1 == received->level.levels)
      return true;
  }
  return false;
}

/// A viewer that connects, gets a frame and leaves.
void view(Service& service, std::chrono::milliseconds patience) {
  const std::unique_ptr<stream::Client> client = service.client();
  service.publish();
  const auto until = std::chrono::steady_clock::now() + patience;
  while (!hasFailed && std::chrono::steady_clock::now() < until) {
    const std::optional<stream::Received> received = client->next(20ms);
    if (received && received->level.step == service.step()) break;
  }
}

}  // namespace

int main(int argc, char** argv) {
  const double growth = argc > 1 ? std::atof(argv[1]) : 1.0;
  int failures = 0;
  Service service;
  for (std::int64_t n = 1;; n = static_cast<std::int64_t>(static_cast<double>(n) * growth) + 1) {
    hasFailed = false;
    toGo = n;
    view(service, 2s);
    toGo = 0;
    if (!hasFailed) break;
    ++failures;
    service.publish();
    expect(getsStep(*service.client(), service.step(), 30s), n, "the next viewer gets no frame");
    expect(service.server().status().frames > 0, n, "the server has no frames");
  }
  // The server ends without memory, too.
  for (std::int64_t n = 1; n <= 20; ++n) {
    auto ending = std::make_unique<Service>();
    const std::unique_ptr<stream::Client> client = ending->client();
    ending->publish();
    expect(getsStep(*client, ending->step(), 30s), n, "a viewer gets no frame before the end");
    endingThread = static_cast<id_t>(::gettid());
    toGo = n;
    ending.reset();
    toGo = 0;
    endingThread = 0;
  }
  expect(failures > 10, failures, "too few allocations failed");
  std::fprintf(stderr, "%d allocations failed\n", failures);
  return wrong == 0 ? 0 : 1;
}
