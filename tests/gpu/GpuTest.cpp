// Device choice, prefix sums and the kd-tree, each against something plain.
#include <catch2/catch.hpp>
#include <cstring>
#include <numeric>
#include <random>
#include <vector>

#include "vdi/core/Error.h"
#include "vdi/gpu/Commands.h"
#include "vdi/gpu/Device.h"
#include "vdi/gpu/KdTree.h"
#include "vdi/gpu/Memory.h"
#include "vdi/gpu/ScanPass.h"

using namespace vdi;
using namespace vdi::gpu;

namespace {

std::shared_ptr<Device> device() {
  DeviceRequest request = requestFromEnvironment(0);
  request.validation = true;
  static const std::shared_ptr<Device> instance = Device::create(request);
  return instance;
}

shared::Brick brick(const glm::vec3& lo, const glm::vec3& hi) {
  shared::Brick b{};
  b.lo = lo;
  b.hi = hi;
  return b;
}

/// The leaf that a point falls into: index of its brick, -1 for none.
int find(const KdTree& tree, const glm::vec3& p) {
  std::uint32_t node = 0;
  for (;;) {
    const shared::KdNode& here = tree.nodes[node];
    if (here.axis == 3) break;
    node = here.first + (p[static_cast<int>(here.axis)] < here.split ? 0 : 1);
  }
  const shared::KdNode& leaf = tree.nodes[node];
  if (leaf.count == 0) return -1;
  const shared::Brick& b = tree.bricks[leaf.first];
  const bool inside = glm::all(glm::greaterThanEqual(p, b.lo)) && glm::all(glm::lessThan(p, b.hi));
  return inside ? static_cast<int>(b.piece) : -1;
}

}  // namespace

TEST_CASE("a device that isn't there is an error that lists those that are") {
  DeviceRequest request;
  request.selector = "no such device";
  try {
    Device::create(request);
    FAIL("nothing was thrown");
  } catch (const Error& error) {
    CHECK(error.code() == ErrorCode::DeviceUnavailable);
    CHECK_THAT(error.what(), Catch::Contains(device()->name()));
  }
  request.selector = device()->name().substr(0, 4);
  CHECK(Device::create(request)->name() == device()->name());
  CHECK_THAT(Device::describeAll(), Catch::Contains("usable"));
}

TEST_CASE("more memory than the device has is refused with the figures") {
  CHECK_THROWS_WITH(Buffer(device(), 1ULL << 50, MemoryKind::DeviceLocal), Catch::Contains("MiB"));
  const std::uint64_t held = device()->allocatedBytes();
  {
    const Buffer buffer(device(), 1 << 20, MemoryKind::Upload);
    CHECK(device()->allocatedBytes() >= held + (1 << 20));
    CHECK(buffer.mapped().size() == 1 << 20);
  }
  CHECK(device()->allocatedBytes() == held);
}

TEST_CASE("prefix sums equal the host's at awkward sizes") {
  std::mt19937 generator(3);
  ScanPass scan(device());
  Commands commands(device());
  for (const std::uint32_t count : {1U, 2U, 2047U, 2048U, 2049U, 100'000U, 4'200'000U}) {
    INFO(count);
    const Buffer values(device(), (count + 1ULL) * 4, MemoryKind::Upload);
    const Buffer prefix(device(), (count + 1ULL) * 4, MemoryKind::Readback);
    const auto in = values.mappedAs<std::uint32_t>();
    for (std::uint32_t i = 0; i < count; ++i) in[i] = generator() % 50;
    commands.begin();
    scan.record(commands, values, prefix, count);
    commands.submitAndWait();
    CHECK_NOTHROW(scan.demandNoOverflow());
    const auto out = prefix.mappedAs<std::uint32_t>();
    std::uint32_t expected = 0;
    std::uint32_t wrong = 0;
    for (std::uint32_t i = 0; i <= count; ++i) {
      wrong += out[i] != expected ? 1 : 0;
      if (i < count) expected += in[i];
    }
    CHECK(wrong == 0);
  }
  CHECK(device()->validationMessages() == "");
}

TEST_CASE("a prefix sum beyond 32 bits is noticed") {
  constexpr std::uint32_t count = 3000;
  ScanPass scan(device());
  Commands commands(device());
  const Buffer values(device(), (count + 1ULL) * 4, MemoryKind::Upload);
  const Buffer prefix(device(), (count + 1ULL) * 4, MemoryKind::Readback);
  for (std::uint32_t& value : values.mappedAs<std::uint32_t>()) value = (1U << 21) - 1;
  commands.begin();
  scan.record(commands, values, prefix, count);
  commands.submitAndWait();
  CHECK_THROWS_AS(scan.demandNoOverflow(), Error);
}

TEST_CASE("the kd-tree finds the brick of every point") {
  std::mt19937 generator(9);
  std::uniform_real_distribution<float> uniform(0.0F, 10.0F);
  std::vector<shared::Brick> bricks;
  for (int z = 0; z < 10; ++z) {
    for (int y = 0; y < 10; ++y) {
      for (int x = 0; x < 10; ++x) {
        if ((x * 7 + y * 3 + z) % 3 == 0) continue;  // holes
        bricks.push_back(brick({x, y, z}, {x + 1, y + 1, z + 1}));
        bricks.back().piece = static_cast<std::uint32_t>((z * 10 + y) * 10 + x);
      }
    }
  }
  const KdTree tree = buildKdTree(bricks);
  CHECK(tree.bricks.size() == bricks.size());  // a grid needs no cuts
  for (int i = 0; i < 5000; ++i) {
    const glm::vec3 p{uniform(generator), uniform(generator), uniform(generator)};
    const glm::ivec3 at(p);
    const bool hole = (at.x * 7 + at.y * 3 + at.z) % 3 == 0;
    CHECK(find(tree, p) == (hole ? -1 : (at.z * 10 + at.y) * 10 + at.x));
  }
  CHECK(buildKdTree({}).nodes.empty());
}

TEST_CASE("boxes that no plane separates uncut are cut; boxes that overlap are refused") {
  // A pinwheel: every plane through a face cuts some box.
  std::vector<shared::Brick> pinwheel{brick({0, 0, 0}, {2, 1, 1}), brick({2, 0, 0}, {3, 2, 1}),
                                      brick({1, 2, 0}, {3, 3, 1}), brick({0, 1, 0}, {1, 3, 1}),
                                      brick({1, 1, 0}, {2, 2, 1})};
  for (std::size_t i = 0; i < pinwheel.size(); ++i) pinwheel[i].piece = static_cast<std::uint32_t>(i);
  const KdTree tree = buildKdTree(pinwheel);
  CHECK(tree.bricks.size() > 5);
  for (std::size_t i = 0; i < pinwheel.size(); ++i) {
    CHECK(find(tree, 0.5F * (pinwheel[i].lo + pinwheel[i].hi)) == static_cast<int>(i));
  }
  CHECK_THROWS_AS(buildKdTree({brick({0, 0, 0}, {2, 2, 2}), brick({1, 1, 1}, {3, 3, 3})}), Error);
}

TEST_CASE("host memory that starts and ends anywhere is imported without a copy, where the device can") {
  if (device()->limits().hostPointerAlignment == 0) {
    WARN("this device can't import host memory");
    return;
  }
  std::vector<std::uint32_t> values(100000);
  std::iota(values.begin(), values.end(), 7U);
  for (const auto& [first, count] : {std::pair<std::size_t, std::size_t>(0, 100000), {3, 5}, {1025, 50000}}) {
    const auto imported = importHostMemory(device(), values.data() + first, count * sizeof(std::uint32_t));
    REQUIRE(imported);
    CHECK(imported->offset < device()->limits().hostPointerAlignment);
    const Buffer back(device(), count * sizeof(std::uint32_t), MemoryKind::Readback);
    Commands commands(device());
    commands.begin();
    commands.copy(imported->buffer, imported->offset, back, 0, back.size());
    commands.submitAndWait();
    CHECK(std::equal(values.begin() + static_cast<std::ptrdiff_t>(first),
                     values.begin() + static_cast<std::ptrdiff_t>(first + count),
                     back.mappedAs<std::uint32_t>().begin()));
  }
  CHECK(device()->validationMessages() == "");
}
