// Tests steering without a network: which viewer drives, and which requests it may make.
#include <algorithm>
#include <utility>

#include "tests/Catch.h"
#include "vdi/core/Error.h"
#include "vdi/stream/Steering.h"
#include "vdi/stream/Viewer.h"

using namespace vdi;
using namespace vdi::stream;

namespace {

constexpr char token[] = "a-token-of-this-test-0123456789";

Controls controls() {
  Controls result;
  result.generator = GeneratorControls{{640, 360}, 25, std::array{0.0, 0.5}, {"Viridis", "X Ray"}, 0.0, {}};
  result.parameters = {{"feed", false, 0.037, 0.0, 0.1}, {"seeds", true, 3.0, 1.0, 9.0}};
  return result;
}

/// Collects wishes.
struct Taken {
  std::vector<std::pair<std::uint32_t, Wish>> wishes;
};

Hub::Options options(Taken& taken) {
  Hub::Options result;
  result.token = token;
  result.mostViewers = 8;
  result.steer = [&taken](std::uint32_t viewer, const Wish& wish) {
    taken.wishes.emplace_back(viewer, wish);
  };
  return result;
}

/// A viewer that has said hello. `heard` returns the messages since its last call.
class Seat {
 public:
  explicit Seat(Hub& hub) : viewer_(hub, [] {}) { say(Hello{1, token, std::nullopt, std::nullopt}); }
  void say(const FromViewer& message) { viewer_.receive(textOf(message), Clock::now()); }
  std::vector<FromServer> heard() {
    std::vector<FromServer> all;
    while (true) {
      const Viewer::Outgoing outgoing = viewer_.next(Clock::now());
      const auto* const text = std::get_if<std::string>(&outgoing);
      if (text == nullptr) return all;
      all.push_back(serverMessage(*text));
    }
  }
  /// The last message of that type among those not yet heard.
  template <typename Message>
  std::optional<Message> last() {
    std::optional<Message> found;
    for (const FromServer& message : heard()) {
      if (const auto* const one = std::get_if<Message>(&message)) found = *one;
    }
    return found;
  }
  std::string denial() {
    const std::optional<Denied> denied = last<Denied>();
    return denied ? denied->cause : "";
  }

 private:
  Viewer viewer_;
};

Wish feed(double value) {
  Wish wish;
  wish.parameters["feed"] = value;
  return wish;
}

}  // namespace

TEST_CASE("one viewer drives, and the others see who") {
  Taken taken;
  Hub hub(options(taken));
  hub.setControls(controls());
  auto first = std::make_unique<Seat>(hub);
  Seat second(hub);
  CHECK(first->last<Steering>() == Steering{1, std::nullopt, controls()});
  CHECK(second.last<Steering>() == Steering{2, std::nullopt, controls()});

  second.say(Steer{feed(0.02)});
  CHECK(second.denial() == "this viewer doesn't drive");
  first->say(Drive{});
  CHECK(first->last<Steering>()->driver == 1U);
  CHECK(second.last<Steering>()->driver == 1U);
  second.say(Drive{});
  CHECK(second.denial() == "viewer 1 drives");
  second.say(Release{});
  second.say(Steer{feed(0.02)});
  CHECK(second.denial() == "this viewer doesn't drive");
  CHECK(taken.wishes.empty());
  first->say(Steer{feed(0.02)});
  CHECK(taken.wishes == std::vector{std::pair{1U, feed(0.02)}});

  first->say(Release{});
  CHECK(second.last<Steering>()->driver == std::nullopt);
  second.say(Drive{});
  CHECK(first->last<Steering>()->driver == 2U);
  second.say(Release{});
  first->say(Drive{});
  // A simulation that a driver has paused continues when the driver leaves.
  Wish pause;
  pause.paused = true;
  first->say(Steer{pause});
  (void)second.heard();
  first.reset();
  CHECK(second.last<Steering>()->driver == std::nullopt);
  pause.paused = false;
  CHECK(taken.wishes.back() == std::pair{1U, pause});
}

TEST_CASE("viewers hear what is in force") {
  Taken taken;
  Hub hub(options(taken));
  Seat seat(hub);
  CHECK(seat.last<Steering>()->controls == Controls{});
  hub.setControls(controls());
  CHECK(seat.last<Steering>()->controls == controls());
  hub.setControls(controls());
  CHECK_FALSE(seat.last<Steering>());
}

TEST_CASE("nobody steers where that isn't allowed") {
  Hub::Options closed;
  closed.token = token;
  closed.mostViewers = 8;
  Hub hub(closed);
  Seat seat(hub);
  const std::vector<FromServer> heard = seat.heard();
  CHECK_FALSE(std::get<Welcome>(heard.front()).steer);
  CHECK(std::ranges::none_of(heard, [](const FromServer& m) { return std::holds_alternative<Steering>(m); }));
  for (const FromViewer& message : {FromViewer(Drive{}), FromViewer(Steer{feed(0.01)})}) {
    seat.say(message);
    CHECK(seat.denial() == "steering isn't allowed here");
  }
}

TEST_CASE("wishes are held against what there is") {
  const Controls all = controls();
  const auto objection = [&](auto change) {
    Wish wish;
    change(wish);
    return objectionTo(wish, all);
  };
  CHECK(objection([](Wish& wish) {
          wish.camera.emplace();
          wish.preset = "X Ray";
          wish.range = {1.0, 2.0};
          wish.parameters = {{"feed", 0.1}, {"seeds", 9.0}};
        }) == "");
  CHECK(objection([](Wish& wish) { wish.preset = "Plaid"; }) == "no colour map has that name");
  CHECK(objection([](Wish& wish) { wish.parameters["kill"] = 0.0; }) ==
        "the simulation has no parameter \"kill\"");
  CHECK(objection([](Wish& wish) { wish.parameters["feed"] = 0.11; }) == "\"feed\" must be from 0 to 0.1");
  CHECK(objection([](Wish& wish) { wish.parameters["feed"] = -1e-9; }) == "\"feed\" must be from 0 to 0.1");
  CHECK(objection([](Wish& wish) { wish.parameters["seeds"] = 2.5; }) == "\"seeds\" must be a whole number");
  Wish view;
  view.supersegments = 9;
  CHECK(objectionTo(view, Controls{}) == "the VDIs aren't made where they are served");
  Wish sampled;
  sampled.samplingRate = 2.0;
  CHECK(changesVdi(sampled));
  CHECK(objectionTo(sampled, all) == "");
  CHECK(objectionTo(sampled, Controls{}) == "the VDIs aren't made where they are served");
  Controls uncoloured = all;
  uncoloured.generator->range.reset();
  Wish range;
  range.range = {0.0, 1.0};
  CHECK(objectionTo(range, uncoloured) == "the VDIs have no colour map");
}

TEST_CASE("what wasn't taken is merged, and the later wish wins") {
  Wishes wishes;
  CHECK_FALSE(wishes.take(std::chrono::milliseconds(0)));
  Wish first = feed(0.01);
  first.period = 5;
  first.paused = true;
  Wish second = feed(0.02);
  second.parameters["kill"] = 0.5;
  second.paused = false;
  wishes.put(1, first);
  wishes.put(2, second);
  const std::optional<SteeringRequest> request = wishes.take(std::chrono::milliseconds(0));
  REQUIRE(request);
  CHECK(request->viewer == 2);
  second.period = 5;
  CHECK(request->wish == second);
  CHECK_FALSE(wishes.take(std::chrono::milliseconds(0)));
  CHECK(
      logEntryOf(*request, 12, 0.5) ==
      R"({"step":12,"time":0.5,"viewer":2,"steer":{"period":5,"paused":false,"parameters":{"feed":0.02,"kill":0.5}}})");
  CHECK(summaryOf(request->wish) == "feed = 0.02, kill = 0.5, a VDI every 5 steps, continue");
  Wish sampled;
  sampled.samplingRate = 0.5;
  CHECK(wishOf(textOf(sampled)) == sampled);
  CHECK(summaryOf(sampled) == "sampling rate 0.5");
  Wish automatic;
  automatic.samplingRate = 0.0;
  merge(sampled, automatic);
  CHECK(summaryOf(sampled) == "automatic sampling rate");
}
