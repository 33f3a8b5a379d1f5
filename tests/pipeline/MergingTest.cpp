// Merging, compositing and budgets on the device compared with the reference.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <memory>
#include <vector>

#include "tests/pipeline/AgainstReference.h"
#include "tests/pipeline/HostLists.h"
#include "vdi/comm/Communicator.h"
#include "vdi/core/Flatten.h"
#include "vdi/pipeline/Compositor.h"
#include "vdi/pipeline/RayCaster.h"
#include "vdi/pipeline/VdiGenerator.h"
#include "vdi/reference/Compaction.h"
#include "vdi/reference/Reference.h"

using namespace vdi;
using synthetic::Joint;
using synthetic::Layout;
using test::algorithms;
using test::device;
using test::deviceAsGpu;
using test::largestDifference;
using test::listsThatDiffer;
using test::oneCode;
using test::withLayers;

TEST_CASE("merging and compositing on the device equal the reference", "[pictures]") {
  const auto decomposed = test::decompose("turbulence", {26, 22, 24}, {3, 3, 3}, Layout::Random,
                                          Joint::SharedPoints, ScalarType::F32, 0, 1);
  const TransferFunction function = test::threeHues(0.8);
  const Algorithm algorithm = GENERATE(from_range(std::begin(algorithms), std::end(algorithms)));
  INFO(toString(algorithm));
  GenerateSettings settings = test::smallSettings(40, 30, 6);
  settings.algorithm = algorithm;
  const Scene scene = localScene(decomposed.all);
  const reference::RayInputs inputs(scene, test::oblique(), function, settings);
  std::vector<SupersegmentLists> subLists;
  for (std::size_t rank = 0; rank < 3; ++rank) {
    std::vector<Block> mine;
    for (std::size_t i = rank; i < decomposed.all.size(); i += 3) mine.push_back(decomposed.all[i]);
    subLists.push_back(reference::generate(inputs, mine, true));
  }
  const SupersegmentLists expected = reference::composite(subLists, settings, inputs.lattice.step);
  detail::Compositor compositor(device());
  const SupersegmentLists result =
      test::composite(device(), compositor, subLists, {6, 6, inputs.lattice.step, algorithm, {}});
  CHECK(listsThatDiffer(result, expected) <= expected.listCount() / 50);
  // Device and host flatten interleaved lists to the picture of the composited ones.
  detail::DeviceLists merged;
  const test::HostSubLists parts(device(), subLists);
  compositor.interleave(parts.parts(), {}, merged);
  gpu::Buffer colors;
  gpu::Buffer depths;
  compositor.flatten(merged, {}, colors, depths);
  compositor.finish();
  gpu::Buffer seen(device(), result.listCount() * 20, gpu::MemoryKind::Readback);
  gpu::Commands commands(device());
  commands.begin();
  commands.copy(colors, 0, seen, 0, result.listCount() * 16);
  commands.copy(depths, 0, seen, result.listCount() * 16, result.listCount() * 4);
  commands.submitAndWait();
  for (std::size_t i = 0; i < result.listCount(); ++i) {
    CHECK(result.countOf(i) <= 6);
    glm::vec4 sum(0.0F);
    for (const Supersegment& s : result.list(i))
      sum += (1.0F - sum.a) * glm::vec4(s.red, s.green, s.blue, s.opacity);
    const glm::vec4 flat = seen.mappedAs<glm::vec4>()[i];
    for (int c = 0; c < 4; ++c) CHECK(std::abs(sum[c] - flat[c]) < 0.5F / 255.0F);
    const float front = result.countOf(i) > 0 ? result.list(i).front().front : Image::noDepth;
    const float depth = seen.mappedAs<float>()[result.listCount() * 4 + i];
    CHECK((depth == front || std::abs(depth - front) < 1e-5F));
  }
  // Codes in, codes out, compared with the reference for the codes' values.
  const DepthCode code = depthCodeFor(inputs.lattice);
  std::vector<CompactLists> subCodes;
  std::vector<SupersegmentLists> subValues;
  for (const SupersegmentLists& sub : subLists) {
    subCodes.push_back(reference::compacted(sub, code));
    subValues.push_back(expanded(subCodes.back(), code));
  }
  const SupersegmentLists ofCodes = reference::composite(subValues, settings, inputs.lattice.step);
  const CompactLists codes = test::composite(
      device(), compositor, subCodes, {6, 6, inputs.lattice.step, algorithm, {Precision::Compact, code}});
  CHECK(listsThatDiffer(expanded(codes, code), expanded(reference::compacted(ofCodes, code), code),
                        oneCode) <= expected.listCount() / 25);
  CHECK(device()->validationMessages() == "");
}

TEST_CASE("ranks that agree on one tolerance: each one's lists are those of the reference", "[pictures]") {
  // Many small blocks assigned at random: lists with many runs, some with more than the counted lists around
  // them.
  const auto blocks = GENERATE(glm::ivec3(3, 3, 3), glm::ivec3(9, 8, 9));
  const std::uint32_t supersegments = GENERATE(3U, 8U, 200U);
  INFO(blocks.x << " blocks across, " << supersegments << " supersegments");
  const auto decomposed = test::decompose("turbulence", {40, 36, 40}, blocks, Layout::Random,
                                          Joint::SharedPoints, ScalarType::F32, 0, 1);
  const TransferFunction function = test::threeHues(0.8);
  GenerateSettings settings = test::smallSettings(61, 43, supersegments);
  settings.samplesPerVoxel = supersegments == 200 ? 8.0 : 1.0;
  settings.precision = Precision::Full;
  const Scene scene = localScene(decomposed.all);
  const reference::RayInputs inputs(scene, test::oblique(), function, settings);
  constexpr std::size_t ranks = 3;
  std::vector<std::vector<Block>> blocksOf(ranks);
  const std::vector<Block> all = withLayers(decomposed.all);
  for (std::size_t i = 0; i < all.size(); ++i) blocksOf[i * 7 % ranks].push_back(all[i]);
  const std::vector<SupersegmentLists> expected = reference::generateTogether(inputs, blocksOf);

  // Each rank's ray caster, and the sum as ranks would compute it.
  const bool asGpu = GENERATE(false, true);
  if (asGpu && supersegments != 8) return;  // compiling takes too long
  const auto own = asGpu ? deviceAsGpu() : device();
  std::vector<std::unique_ptr<detail::RayCaster>> casters;
  std::vector<detail::RayCaster::Cast> casts;
  std::vector<std::uint8_t> sum;
  const detail::RayCaster::Inputs request{scene,    inputs.view, inputs.lattice, inputs.table,
                                          settings, true,        false,          {}};
  for (std::size_t r = 0; r < ranks; ++r) {
    casters.push_back(std::make_unique<detail::RayCaster>(own, 0));
    casters.back()->volume().setBlocks(blocksOf[r], scene);
    casts.push_back(casters.back()->begin(request));
    const std::uint64_t bytes = detail::RayCaster::levelBytes(casts.back());
    detail::HostAccess memory(own, HostMemory::anonymous(bytes));
    casters.back()->countLevels(casts.back(), memory, 0);
    sum.resize(bytes, 0);
    for (std::size_t i = 0; i < bytes; ++i) {
      sum[i] = static_cast<std::uint8_t>(
          std::min(sum[i] + std::to_integer<int>(memory.memory()->bytes()[i]), 255));
    }
  }
  detail::HostAccess memory(own, HostMemory::anonymous(sum.size()));
  std::memcpy(memory.memory()->bytes().data(), sum.data(), sum.size());
  const detail::RayCaster::LevelSum stretch{&memory, 0, 0, sum.size()};
  std::size_t supersegmentsInAll = 0;
  std::vector<std::vector<std::uint32_t>> weights;
  for (std::size_t r = 0; r < ranks; ++r) {
    casters[r]->takeLevelSum(casts[r], std::span(&stretch, 1));
    detail::DeviceLists lists;
    casters[r]->startBand(casts[r], 0, 43, lists);
    casters[r]->finishBand();
    weights.push_back(casters[r]->agreedWeights(casts[r]));
    const SupersegmentLists made = test::download<Supersegment>(own, lists);
    // The filters of GPUs have 8 bits, which shows in lists of many short supersegments.
    const std::size_t share = own->isCpu() || supersegments < 200 ? 40 : 5;
    CHECK(listsThatDiffer(made, expected[r]) <= made.listCount() / share);
    supersegmentsInAll += made.segments.size();
  }
  CHECK(weights[1] == weights[0]);  // otherwise ranks would disagree on the owners of lists
  CHECK(weights[2] == weights[0]);
  std::uint64_t weight = 0;
  for (const std::uint32_t w : weights[0]) weight += w;
  CHECK(static_cast<double>(weight) > 0.5 * static_cast<double>(supersegmentsInAll));
  CHECK(own->validationMessages() == "");
}

TEST_CASE("a total budget: as in the reference, the wanted total, unequal lists", "[pictures]") {
  const double fill = GENERATE(1.0, 0.5);
  INFO("fill " << fill);
  const auto decomposed = test::decompose("turbulence", {40, 40, 40}, {2, 2, 2}, Layout::Random,
                                          Joint::SharedPoints, ScalarType::F32, 0, 1);
  const TransferFunction function = test::threeHues(0.8);
  GenerateSettings settings = test::smallSettings(61, 43, 5);
  settings.precision = Precision::Full;
  VdiGenerator generator(device(), comm::Communicator::serial());
  generator.setBlocks(decomposed.mine);
  const auto equal = generator.generate(test::oblique(), function, settings);
  settings.budget = Budget::Total;
  settings.fill = fill;
  const auto vdi = generator.generate(test::oblique(), function, settings);
  CHECK_NOTHROW(validate(*vdi));
  const reference::RayInputs inputs(generator.scene(), test::oblique(), function, settings);
  const SupersegmentLists expected = reference::generate(inputs, withLayers(decomposed.mine), false);
  CHECK(listsThatDiffer(vdi->expandedLists(), expected) <= expected.listCount() / 50);
  CHECK(largestDifference(flatten(*vdi), reference::renderVolume(inputs, withLayers(decomposed.mine))) <
        1.0F);
  const double share =
      static_cast<double>(vdi->supersegmentCount()) / static_cast<double>(equal->supersegmentCount());
  CHECK(share == Approx(fill).epsilon(0.05));
  std::size_t longest = 0;
  for (std::size_t i = 0; i < expected.listCount(); ++i) longest = std::max(longest, expected.list(i).size());
  CHECK(static_cast<double>(longest) > 5 * fill);
  CHECK(longest <= 10);

  // Composites three ranks' lists.
  settings.budget = Budget::List;
  settings.fill = 1.0;
  const reference::RayInputs equalInputs(generator.scene(), test::oblique(), function, settings);
  std::vector<SupersegmentLists> subLists;
  for (std::size_t rank = 0; rank < 3; ++rank) {
    std::vector<Block> mine;
    for (std::size_t i = rank; i < decomposed.all.size(); i += 3) mine.push_back(decomposed.all[i]);
    subLists.push_back(reference::generate(equalInputs, mine, true));
  }
  settings.budget = Budget::Total;
  settings.fill = fill;
  const SupersegmentLists composited = reference::composite(subLists, settings, inputs.lattice.step);
  detail::Compositor compositor(device());
  detail::Compositor::Options request{
      5, maxPerList(5, Budget::Total), inputs.lattice.step, Algorithm::Merge, {}};
  detail::DeviceLists merged;
  const test::HostSubLists parts(device(), subLists);
  compositor.interleave(parts.parts(), {}, merged);
  request.level = compositor.histogram(merged, request).levelFor(fill);
  CHECK(listsThatDiffer(test::composite(device(), compositor, subLists, request), composited) <=
        composited.listCount() / 50);
}
