// A server whose process runs out of memory. In each round, a viewer connects and a frame is
// published. Meanwhile, one allocation of the server's or the publisher's threads fails, or all do
// for a while. No thread ends the process, and the next viewer gets the next frame at once.
//
// stream_allocations [growth]: after allocation n, allocation growth * n + 1 fails; 1.0 tries all.
#include <sys/resource.h>
#include <unistd.h>

#include <array>
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
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include "tests/AllocationOperators.h"
#include "tests/io/Samples.h"
#include "vdi/core/InOrder.h"
#include "vdi/stream/Client.h"
#include "vdi/stream/Frame.h"
#include "vdi/stream/Publisher.h"
#include "vdi/stream/Server.h"
#include "vdi/stream/Steering.h"
#include "vdi/stream/Token.h"
#include "vdi/stream/Viewer.h"

namespace {

constexpr std::int64_t endless = std::int64_t{1} << 40;

std::atomic<bool> isArmed = false;
std::atomic<std::int64_t> toGo{0};    // allocations up to the first one that fails
std::atomic<std::int64_t> inTurn{1};  // that many fail, one after the other
std::atomic<bool> hasFailed = false;  // since arm()
std::atomic<id_t> serverThread{0};
std::atomic<id_t> publisherThread{0};
std::atomic<id_t> thisThread{0};  // this program's first thread, while its allocations fail, too
const int niceness = ::getpriority(PRIO_PROCESS, 0);

/// Whether this thread is the server's or the publisher's, or one that helps the publisher. A publisher's
/// threads are nicer than others.
bool isServing() {
  static thread_local const id_t self = static_cast<id_t>(::gettid());
  return self == serverThread || self == publisherThread || self == thisThread ||
         ::getpriority(PRIO_PROCESS, self) > niceness;
}

/// Makes `count` consecutive allocations fail, starting with the n-th.
void arm(std::int64_t n, std::int64_t count) {
  hasFailed = false;
  toGo = n;
  inTurn = count;
  isArmed = true;
}

/// Calls `work` and returns whether an allocation failed. This thread is one of those whose allocations fail.
template <typename Work>
bool failsWithin(std::int64_t n, std::int64_t count, Work work) {
  thisThread = static_cast<id_t>(::gettid());
  arm(n, count);
  try {
    work();
  } catch (const std::bad_alloc&) {
  }
  isArmed = false;
  thisThread = 0;
  return hasFailed;
}

}  // namespace

void* vdi::test::allocate(std::size_t bytes, const void* /*caller*/) noexcept {
  if (isArmed && isServing()) {
    const std::int64_t left = --toGo;
    if (left <= 0 && left > -inTurn) {
      hasFailed = true;
      return nullptr;
    }
  }
  return std::malloc(bytes > 0 ? bytes : 1);
}

namespace {

using namespace std::chrono_literals;
using namespace vdi;

constexpr char token[] = "a-token-of-this-test-0123456789";
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
    options.log = [](const std::string& line) { (void)(line + ", which is too long for a short string"); };
    serverThread = threadMadeBy([&] { server_.emplace(std::move(options)); });
    publisherThread = threadMadeBy([&] { publisher_.emplace(*server_); });
  }
  void publish() {
    Vdi vdi = test::plausibleVdi(40, 30, 8);
    vdi.timeStep = ++step_;
    publisher_->publish(std::make_shared<const Vdi>(std::move(vdi)));
  }
  /// Publishes a VDI that can't be encoded. Returns the publisher's error, which has a long text.
  std::string publishDamaged() {
    Vdi vdi = test::plausibleVdi(40, 30, 8);
    vdi.budget = 1;
    publisher_->publish(std::make_shared<const Vdi>(std::move(vdi)));
    while (publisher_->trouble().empty()) std::this_thread::sleep_for(1ms);
    return publisher_->trouble();
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
  if (hasFailed && inTurn > 1) (void)client->next(20ms);
}

/// Serves viewers while `count` consecutive allocations fail each time. Returns the number of rounds.
int serve(double growth, std::int64_t count) {
  Service service;
  int rounds = 0;
  for (std::int64_t n = 1;; n = static_cast<std::int64_t>(static_cast<double>(n) * growth) + 1) {
    arm(n, count);
    view(service, 2s);
    isArmed = false;
    if (!hasFailed) return rounds;
    ++rounds;
    service.publish();
    expect(getsStep(*service.client(), service.step(), 30s), n, "the next viewer gets no frame");
    expect(service.server().status().frames > 0, n, "the server has no frames");
  }
}

/// A publisher has an error for each VDI that it can't encode, with memory or without.
void failToEncode() {
  bool isLast = false;
  for (std::int64_t n = 1; !isLast; ++n) {
    Service service;
    arm(n, 1);
    const std::string trouble = service.publishDamaged();
    isArmed = false;
    isLast = !hasFailed;
    expect(!isLast || trouble.size() > std::string().capacity(), n, "the error's text is too short");
  }
}

/// The server ends without memory, too.
void end(std::int64_t count) {
  for (std::int64_t n = 1; n <= 20; ++n) {
    auto service = std::make_unique<Service>();
    const std::unique_ptr<stream::Client> client = service->client();
    service->publish();
    expect(getsStep(*client, service->step(), 30s), n, "a viewer gets no frame before the end");
    failsWithin(n, count, [&] { service.reset(); });
  }
}

/// The messages of a viewer that steers. The last one is refused.
std::vector<std::string> saidMessages(const stream::Wish& wish) {
  std::vector<std::string> texts;
  for (const stream::FromViewer& message :
       {stream::FromViewer(stream::Hello{1, token, "another session", 7U}),
        stream::FromViewer(stream::Drive{}), stream::FromViewer(stream::Steer{wish}),
        stream::FromViewer(stream::Show{0}), stream::FromViewer(stream::Ack{1, 0, 5}),
        stream::FromViewer(stream::Pause{}), stream::FromViewer(stream::Resume{})})
    texts.push_back(textOf(message));
  texts.emplace_back(
      R"({"type":"steer","parameters":{"a field that occurs twice":1,"a field that occurs twice":2}})");
  return texts;
}

/// A viewer's whole conversation, without a network; the simulation takes the viewer's wishes.
void converse(const std::vector<std::string>& said, const stream::Controls& controls,
              const stream::FramePtr& frame) {
  stream::Wishes wishes;
  stream::Hub::Options options;
  options.token = token;
  options.mostViewers = 2;
  options.show = [](std::uint32_t) {};
  options.steer = [&](std::uint32_t viewer, const stream::Wish& wish) { wishes.put(viewer, wish); };
  stream::Hub hub(std::move(options));
  hub.setControls(controls);
  hub.append({{0.5, std::nullopt}, {1, 2}});
  hub.publish(frame, stream::Clock::now());
  stream::Viewer viewer(hub, [] {});
  for (const std::string& text : said) {
    viewer.receive(text, stream::Clock::now());
    hub.provide(frame, stream::Clock::now());
    hub.miss({0, "a cause that is too long for a short string"});
    for (bool isMore = true; isMore;) {
      const stream::Viewer::Outgoing outgoing = viewer.next(stream::Clock::now());
      isMore = std::holds_alternative<std::string>(outgoing) ||
               std::holds_alternative<stream::Viewer::Binary>(outgoing);
    }
    const std::optional<stream::SteeringRequest> request = wishes.take(0ms);
    if (!request) continue;
    (void)stream::wishOf(textOf(request->wish));
    (void)stream::logEntryOf(*request, 1, 0.5);
    (void)stream::summaryOf(request->wish);
  }
}

/// Holds conversations in which `count` consecutive allocations fail. Returns their number.
int converseWithoutMemory(std::int64_t count) {
  stream::Controls controls;
  controls.generator = stream::GeneratorControls{{0, 360}, 25, std::array{0.0, 0.5}, {"Viridis"}, 0.5, {}};
  controls.parameters = {{"feed", false, 0.037, 0.0, 0.1}};
  stream::Wish wish;
  wish.camera.emplace();
  wish.resolution = {640, 360};
  wish.range = {0.25, 0.5};
  wish.preset = "Viridis";
  wish.paused = true;
  wish.parameters = {{"feed", 0.05}};
  const std::vector<std::string> said = saidMessages(wish);
  stream::FramePtr frame;
  stream::encodeFrame(
      test::plausibleVdi(40, 30, 8), 1, stream::Clock::now(),
      [&](stream::FramePtr made) { frame = std::move(made); }, [] { return true; });
  int rounds = 0;
  while (failsWithin(rounds + 1, count, [&] { converse(said, controls, frame); })) ++rounds;
  return rounds;
}

/// An encoder's threads end if the one that starts them has no memory.
void encodeWithoutMemory() {
  constexpr std::size_t results = 1000;
  const auto makeWorker = [] { return [](std::size_t index) { return index; }; };
  for (std::int64_t n = 1; n <= 10; ++n)
    failsWithin(n, 1, [&] { inOrder(results, 1, makeWorker, [](std::size_t) {}); });
}

}  // namespace

int main(int argc, char** argv) {
  const double growth = argc > 1 ? std::atof(argv[1]) : 1.0;
  encodeWithoutMemory();
  failToEncode();
  for (const std::int64_t count : {std::int64_t{1}, endless}) {
    const int conversations = converseWithoutMemory(count);
    expect(conversations > 100, conversations, "too few conversations failed");
    const int rounds = serve(growth, count);
    expect(rounds > 10, rounds, "too few allocations failed");
    end(count);
    std::fprintf(stderr, "%d conversations and %d rounds failed\n", conversations, rounds);
  }
  return wrong == 0 ? 0 : 1;
}
