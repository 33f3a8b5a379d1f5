// Device choice, prefix sums, merging and the kd-tree, each compared with a plain computation.
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <numeric>
#include <random>
#include <thread>
#include <vector>

#include "tests/Catch.h"
#include "tests/Devices.h"
#include "tests/FuzzTime.h"
#include "tests/TemporaryFolder.h"
#include "vdi/core/Error.h"
#include "vdi/gpu/Commands.h"
#include "vdi/gpu/Device.h"
#include "vdi/gpu/KdTree.h"
#include "vdi/gpu/Memory.h"
#include "vdi/gpu/PipelineCacheFile.h"
#include "vdi/gpu/ReducePass.h"
#include "vdi/gpu/ScanPass.h"
#include "vdi/gpu/VolumePages.h"
#include "vdi/gpu/VulkanDevice.h"

using namespace vdi;
using namespace vdi::gpu;
using test::device;

namespace {

shared::Brick brick(const glm::vec3& lo, const glm::vec3& hi) {
  shared::Brick b{};
  b.lo = lo;
  b.hi = hi;
  return b;
}

/// The index of the brick in the leaf that contains a point, -1 for none.
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

TEST_CASE("a missing device is an error that lists the present ones") {
  DeviceRequest request;
  request.selector = "no such device";
  try {
    Device::create(request);
    FAIL("nothing was thrown");
  } catch (const Error& error) {
    CHECK(error.code() == ErrorCode::DeviceUnavailable);
    CHECK_THAT(error.what(), vdi::test::ContainsSubstring(device()->name()));
  }
  request.selector = device()->name().substr(0, 4);
  CHECK(Device::create(request)->name() == device()->name());
  CHECK_THAT(Device::describeAll(), vdi::test::ContainsSubstring("usable"));
}

TEST_CASE("more memory than the device has is refused with the figures") {
  CHECK_THROWS_WITH(Buffer(device(), 1ULL << 50, MemoryKind::DeviceLocal),
                    vdi::test::ContainsSubstring("MiB"));
  const std::uint64_t held = device()->allocatedBytes();
  {
    const Buffer buffer(device(), 1 << 20, MemoryKind::Upload);
    CHECK(device()->allocatedBytes() >= held + (1 << 20));
    CHECK(buffer.mapped().size() == 1 << 20);
  }
  CHECK(device()->allocatedBytes() == held);
}

TEST_CASE("a texture limit below the device's is respected") {
  DeviceRequest request = requestFromEnvironment(0);
  request.maxImageDimension3D = 24;
  const auto small = Device::create(request);
  CHECK(small->limits().maxImageDimension3D == 24);
  CHECK_THROWS_AS(SampledImage(small, {25, 1, 1}, VK_FORMAT_R8_UNORM), Error);
}

TEST_CASE("tall and flat volumes fit a texture that is no larger than they are") {
  for (const glm::uvec3 dims :
       {glm::uvec3(512, 512, 1030), glm::uvec3(1024, 16, 1100), glm::uvec3(16, 1024, 1100)}) {
    std::vector<VolumePiece> pieces(1);
    pieces[0].dims = dims;
    pieces[0].format = VK_FORMAT_R32_SFLOAT;
    const std::vector<PageShape> pages = placeInPages(*device(), pieces);
    REQUIRE(pages.size() == 1);
    CHECK(pages[0].extent == dims);
  }
}

TEST_CASE("validation messages name the faulty object") {
  DeviceRequest request = requestFromEnvironment(0);
  request.validation = true;
  const auto own = Device::create(request);
  const Buffer buffer(own, 64, MemoryKind::Readback);
  CHECK(own->validationMessages() == "");
  const VkBufferViewCreateInfo wrong{VK_STRUCTURE_TYPE_BUFFER_VIEW_CREATE_INFO,
                                     nullptr,
                                     0,
                                     buffer.handle(),
                                     VK_FORMAT_R32_UINT,
                                     0,
                                     VK_WHOLE_SIZE};  // from a buffer without texels
  VkBufferView view = VK_NULL_HANDLE;
  if (vkCreateBufferView(own->vulkan().handle(), &wrong, nullptr, &view) == VK_SUCCESS)
    vkDestroyBufferView(own->vulkan().handle(), view, nullptr);
  CHECK(own->validationMessageCount() > 0);
  CHECK_THAT(own->validationMessages(), vdi::test::ContainsSubstring("readback buffer of 64 bytes"));
}

TEST_CASE("a device compiles a shader once for each specialisation, whichever thread asks") {
  const auto own = Device::create(requestFromEnvironment(0));
  const auto handleOf = [&](std::uint32_t compact) {
    ComputePipelineInfo special = infoOf<shared::ReduceConstants>("store");
    special.specialization = {0, 0, compact, 0};
    return ComputePipeline(own, special).handle();  // outlives its user
  };
  std::array<VkPipeline, 4> handles{};
  std::vector<std::thread> threads;
  for (VkPipeline& handle : handles) threads.emplace_back([&handleOf, &handle] { handle = handleOf(0); });
  for (std::thread& thread : threads) thread.join();
  for (const VkPipeline handle : handles) CHECK(handle == handles[0]);
  CHECK(handleOf(1) != handles[0]);
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
    for (std::uint32_t i = 0; i < count; ++i) in[i] = static_cast<std::uint32_t>(generator() % 50);
    commands.begin();
    scan.record(commands, values, prefix, count);
    commands.submitAndWait();
    CHECK_NOTHROW(scan.requireNoOverflow());
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

TEST_CASE("commands may be destroyed once waited for, whichever thread made them") {
  const auto work = [](std::uint32_t word, bool& right) {
    const Buffer from(device(), 4096, MemoryKind::Upload);
    const Buffer to(device(), 4096, MemoryKind::Readback);
    const Buffer filled(device(), 4096, MemoryKind::Readback);
    from.mappedAs<std::uint32_t>()[7] = word;
    for (int i = 0; i < 300; ++i) {
      Commands copies(device(), QueueKind::Transfer);
      copies.begin();
      copies.copy(from, 0, to, 0, 4096);
      copies.submit();
      Commands commands(device());
      commands.begin();
      commands.waitFor(copies);
      commands.fill(filled, word);
      commands.submitAndWait();
    }
    right = to.mappedAs<std::uint32_t>()[7] == word && filled.mappedAs<std::uint32_t>()[1023] == word;
  };
  std::array<bool, 3> right{};
  {
    std::vector<std::jthread> threads;
    for (std::size_t i = 0; i < right.size(); ++i) {
      threads.emplace_back(work, static_cast<std::uint32_t>(i + 1), std::ref(right[i]));
    }
  }
  CHECK(right == std::array<bool, 3>{true, true, true});
  CHECK(device()->validationMessages() == "");
}

TEST_CASE("a prefix sum beyond 32 bits is detected") {
  constexpr std::uint32_t count = 3000;
  ScanPass scan(device());
  Commands commands(device());
  const Buffer values(device(), (count + 1ULL) * 4, MemoryKind::Upload);
  const Buffer prefix(device(), (count + 1ULL) * 4, MemoryKind::Readback);
  for (std::uint32_t& value : values.mappedAs<std::uint32_t>()) value = (1U << 21) - 1;
  commands.begin();
  scan.record(commands, values, prefix, count);
  commands.submitAndWait();
  CHECK_THROWS_AS(scan.requireNoOverflow(), Error);
}

namespace {

/// Pre-segments of many lists, as the write step leaves them: none, few, many, and more than fit a subgroup;
/// some all equal, some with gaps, some with cuts at gaps. Lengths are up to `unit`.
struct PreSegments {
  static constexpr std::uint32_t maxCount = 12;  // N_S
  std::vector<shared::StoredPreSegment> preSegments;
  std::vector<std::uint32_t> offsets{0};
  std::vector<std::uint32_t> written;
  std::vector<std::uint32_t> left;
  std::vector<std::uint32_t> leftOffsets{0};

  explicit PreSegments(std::uint32_t lists, float unit = 1.0F) {
    std::mt19937 generator(11);
    const auto below = [&](std::uint32_t end) { return static_cast<std::uint32_t>(generator() % end); };
    const auto random = [&] { return static_cast<float>(below(1000) + 1) / 1024.0F; };
    for (std::uint32_t list = 0; list < lists; ++list) {
      const std::uint32_t count = list % 5 == 0 ? 0 : list % 97 == 1 ? 400 + below(300) : below(38);
      const bool alike = list % 7 == 2;
      const bool gaps = list % 3 == 1;
      const bool cuts = gaps && list % 2 == 0;
      float at = 1.0F;
      float before = 1.0F;
      std::uint32_t runs = 1;
      for (std::uint32_t i = 0; i < count; ++i) {
        const bool gap = gaps && i > 0 && generator() % 4 == 0;
        if (gap) at += random();
        runs += gap && cuts ? 1 : 0;
        const float back = at + (alike ? 0.5F : random());
        const float depth = alike ? 0.25F : 0.5F * random();
        const glm::vec3 color = alike ? glm::vec3(0.125F) : 0.3F * glm::vec3(random(), random(), random());
        preSegments.push_back(
            {{unit * at, unit * back}, before, 0.0F, {color, gap && cuts ? -depth : depth}});
        before *= std::exp2(-depth);
        at = back;
      }
      written.push_back(count);
      left.push_back(std::min(count, std::max(maxCount, runs)));
      offsets.push_back(offsets.back() + count);
      leftOffsets.push_back(leftOffsets.back() + left.back());
    }
  }
};

template <typename T>
Buffer uploaded(const std::vector<T>& values) {
  Buffer buffer(device(), std::span(values).size_bytes(), MemoryKind::Upload);
  std::memcpy(buffer.mapped().data(), values.data(), std::span(values).size_bytes());
  return buffer;
}

std::vector<shared::Segment> reduced(const PreSegments& lists, ReducePass::Subgroups subgroups,
                                     float unit = 1.0F) {
  const Buffer preSegments = uploaded(lists.preSegments);
  const Buffer offsets = uploaded(lists.offsets);
  const Buffer written = uploaded(lists.written);
  const Buffer left = uploaded(lists.left);
  const Buffer leftOffsets = uploaded(lists.leftOffsets);
  const Buffer segments(device(), lists.leftOffsets.back() * sizeof(shared::Segment), MemoryKind::Readback);
  const Buffer guard = uploaded(std::vector<std::uint32_t>{1});  // there is room
  shared::ReduceConstants constants{};
  constants.preSegments = preSegments.address();
  constants.preSegmentOffsets = offsets.address();
  constants.written = written.address();
  constants.left = left.address();
  constants.offsets = leftOffsets.address();
  constants.segments = segments.address();
  constants.guard = guard.address();
  constants.step = 0.125F * unit;
  constants.listCount = static_cast<std::uint32_t>(lists.written.size());
  ReducePass pass(device(), subgroups);
  Commands commands(device());
  commands.begin();
  pass.record(commands, constants, {PreSegments::maxCount, false});
  commands.submitAndWait();
  const auto result = segments.mappedAs<shared::Segment>();
  return {result.begin(), result.end()};
}

}  // namespace

TEST_CASE("lengths whose products exceed a float's range merge as short ones do") {
  constexpr float unit = 0x1p70F;
  const PreSegments lists(400);
  const PreSegments longLists(400, unit);
  for (const auto subgroups : {ReducePass::Subgroups::No, ReducePass::Subgroups::Yes}) {
    if (subgroups == ReducePass::Subgroups::Yes && device()->limits().subgroupSize == 0) continue;
    const std::vector<shared::Segment> expected = reduced(lists, subgroups);
    const std::vector<shared::Segment> found = reduced(longLists, subgroups, unit);
    REQUIRE(found.size() == expected.size());
    std::uint32_t wrong = 0;
    for (std::size_t i = 0; i < found.size(); ++i) {
      wrong += found[i].front == unit * expected[i].front && found[i].back == unit * expected[i].back &&
                       found[i].opacity == expected[i].opacity
                   ? 0
                   : 1;
    }
    CHECK(wrong == 0);
  }
}

TEST_CASE("subgroups merge pre-segments as single invocations do") {
  if (device()->limits().subgroupSize == 0) {
    WARN("this device can't have subgroups");
    return;
  }
  const PreSegments lists(3000);
  const std::vector<shared::Segment> alone = reduced(lists, ReducePass::Subgroups::No);
  const std::vector<shared::Segment> subgroups = reduced(lists, ReducePass::Subgroups::Yes);
  REQUIRE(alone.size() == subgroups.size());
  std::uint32_t wrong = 0;
  for (std::size_t i = 0; i < alone.size(); ++i) {
    const auto near = [](float a, float b) { return std::abs(a - b) <= 1e-5F * std::abs(b); };
    wrong += near(alone[i].front, subgroups[i].front) && near(alone[i].back, subgroups[i].back) &&
                     near(alone[i].red, subgroups[i].red) && near(alone[i].opacity, subgroups[i].opacity)
                 ? 0
                 : 1;
  }
  CHECK(wrong == 0);
  // Each list keeps its first depth and its transmittance, and has no material behind its last depth.
  std::uint32_t off = 0;
  for (std::size_t list = 0; list < lists.written.size(); ++list) {
    if (lists.written[list] == 0) continue;
    float depth = 0.0F;
    float depthLeft = 0.0F;
    for (std::uint32_t i = lists.offsets[list]; i < lists.offsets[list + 1]; ++i)
      depth += std::abs(lists.preSegments[i].light.a);
    for (std::uint32_t i = lists.leftOffsets[list]; i < lists.leftOffsets[list + 1]; ++i)
      depthLeft -= std::log2(1.0F - subgroups[i].opacity);
    const bool sound =
        subgroups[lists.leftOffsets[list]].front == lists.preSegments[lists.offsets[list]].span.x &&
        subgroups[lists.leftOffsets[list + 1] - 1].back <=
            lists.preSegments[lists.offsets[list + 1] - 1].span.y &&
        std::abs(depth - depthLeft) < 0.02F * depth + 1e-3F;
    off += sound || depth > 15.0F ? 0 : 1;
  }
  CHECK(off == 0);
  CHECK(device()->validationMessages() == "");
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
  // A pinwheel: every plane through a face cuts a box.
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

namespace {

/// Cache data in a driver's format, for the key's device.
std::vector<std::byte> cacheData(const PipelineCacheKey& key, std::size_t size) {
  VkPipelineCacheHeaderVersionOne header{
      sizeof header, VK_PIPELINE_CACHE_HEADER_VERSION_ONE, key.vendor, key.device, {}};
  std::copy(key.cacheUuid.begin(), key.cacheUuid.end(), header.pipelineCacheUUID);
  std::vector<std::byte> data(sizeof header + size, std::byte{7});
  std::memcpy(data.data(), &header, sizeof header);
  return data;
}

/// The only file of a cache in a folder below this one.
std::filesystem::path onlyFile(const test::TemporaryFolder& folder) {
  return *std::filesystem::directory_iterator(folder.path() / "deep" / "er");
}

}  // namespace

TEST_CASE("compiled shaders come back from their file, and only those of the same driver and device") {
  const test::TemporaryFolder folder;
  PipelineCacheKey key{1, 2, 3, {4}, {5}};
  const PipelineCacheFile file((folder.path() / "deep" / "er").string(), key);
  CHECK(file.read().empty());
  const std::vector<std::byte> data = cacheData(key, 1000);
  file.write(data);
  CHECK(file.read() == data);
  const std::vector<std::byte> longer = cacheData(key, 2000);
  file.write(longer);
  CHECK(file.read() == longer);
  file.write(cacheData(key, 0));  // a header alone isn't kept
  CHECK(file.read() == longer);
  const std::array others{PipelineCacheKey{9, 2, 3, {4}, {5}}, PipelineCacheKey{1, 9, 3, {4}, {5}},
                          PipelineCacheKey{1, 2, 9, {4}, {5}}, PipelineCacheKey{1, 2, 3, {9}, {5}},
                          PipelineCacheKey{1, 2, 3, {4}, {9}}};
  for (const PipelineCacheKey& other : others)
    CHECK(PipelineCacheFile((folder.path() / "deep" / "er").string(), other).read().empty());
  // Another device's data under this name, as after a mistake of the user's.
  PipelineCacheFile(folder.path().string(), others[3]).write(cacheData(others[3], 10));
  std::filesystem::path foreign;
  for (const auto& entry : std::filesystem::directory_iterator(folder.path())) {
    if (entry.is_regular_file()) foreign = entry.path();
  }
  std::filesystem::copy_file(foreign, onlyFile(folder), std::filesystem::copy_options::overwrite_existing);
  CHECK(file.read().empty());
}

TEST_CASE("a folder that can't be written, or none, only means that nothing is kept") {
  const test::TemporaryFolder folder;
  const PipelineCacheKey key{1, 2, 3, {4}, {5}};
  std::ofstream(folder.path() / "file") << "no folder";
  for (const std::string& place :
       {std::string(), (folder.path() / "file").string(), std::string("/proc/none")}) {
    const PipelineCacheFile file(place, key);
    file.write(cacheData(key, 100));
    CHECK(file.read().empty());
  }
  std::filesystem::create_directories(folder.path() / "deep" / "er");
  const PipelineCacheFile file((folder.path() / "deep" / "er").string(), key);
  file.write(cacheData(key, 100));
  std::filesystem::remove(onlyFile(folder));
  std::filesystem::create_directory(folder.path() / "deep" / "er" / "x");
  CHECK(file.read().empty());
}

TEST_CASE("damaged files of compiled shaders are ignored") {
  const test::TemporaryFolder folder;
  const PipelineCacheKey key{1, 2, 3, {4}, {5}};
  const PipelineCacheFile file((folder.path() / "deep" / "er").string(), key);
  file.write(cacheData(key, 500));
  const std::filesystem::path path = onlyFile(folder);
  std::vector<char> good(std::filesystem::file_size(path));
  std::ifstream(path, std::ios::binary).read(good.data(), static_cast<std::streamsize>(good.size()));
  std::mt19937 random(3);
  const test::FuzzTime time(0.5);
  do {
    std::vector<char> bad = good;
    const std::size_t at = random() % bad.size();
    if (random() % 3 == 0) {
      bad.resize(at);
    } else {
      bad[at] = static_cast<char>(bad[at] ^ static_cast<char>(1U << (random() % 8)));
    }
    std::ofstream(path, std::ios::binary).write(bad.data(), static_cast<std::streamsize>(bad.size()));
    REQUIRE(file.read().empty());
  } while (!time.isOver());
}

TEST_CASE("processes that write compiled shaders at once leave one's whole") {
  const test::TemporaryFolder folder;
  const PipelineCacheKey key{1, 2, 3, {4}, {5}};
  const PipelineCacheFile file((folder.path() / "deep" / "er").string(), key);
  file.write(cacheData(key, 100));
  std::vector<std::thread> writers;
  for (std::size_t i = 0; i < 4; ++i) {
    writers.emplace_back([&, i] {
      for (int round = 0; round < 20; ++round) file.write(cacheData(key, 10000 * (i + 1)));
    });
  }
  int torn = 0;
  for (int round = 0; round < 100; ++round) torn += file.read().empty() ? 1 : 0;
  for (std::thread& writer : writers) writer.join();
  CHECK(torn == 0);
  CHECK(std::filesystem::directory_entry(onlyFile(folder)).is_regular_file());
  CHECK(std::distance(std::filesystem::directory_iterator(folder.path() / "deep" / "er"), {}) == 1);
}
