// Fields made by a device against those of vdi/synthetic/Fields.h.
#include <cstring>
#include <set>

#include "tests/Catch.h"
#include "tests/Devices.h"
#include "vdi/core/Scene.h"
#include "vdi/synthetic/DeviceField.h"
#include "vdi/synthetic/Fields.h"

using namespace vdi;
using namespace vdi::synthetic;
using test::device;

namespace {

/// Number of the part's values, out of 1000, that differ by more than `tolerance`.
template <typename T>
double differing(const std::string& name, const Lattice& lattice, const Part& part, double top,
                 double tolerance) {
  const Field field = makeField(name, 5);
  const double shift = lattice.joint == Joint::Cells ? 0.5 : 0.0;
  const Block expected = makeBlock(lattice, part, [&](const glm::ivec3& index) {
    return top * field((glm::dvec3(index) + shift) * lattice.spacing);
  });
  const Block made = blockOf(lattice, part, DeviceField(device(), name, 5).makeValues(lattice, part, top));
  CHECK(made.dims == expected.dims);
  CHECK(made.origin == expected.origin);
  const int count = part.dims.x * part.dims.y * part.dims.z;
  int wrong = 0;
  for (int i = 0; i < count; ++i) {
    const auto a = static_cast<double>(static_cast<const T*>(made.data)[i]);
    const auto b = static_cast<double>(static_cast<const T*>(expected.data)[i]);
    wrong += std::abs(a - b) > tolerance ? 1 : 0;
  }
  return 1000.0 * wrong / count;
}

}  // namespace

TEST_CASE("a device makes the fields that are defined for the host") {
  Lattice lattice;
  lattice.size = {70, 61, 52};
  lattice.spacing = glm::dvec3(1.0 / 69.0);
  const Part part{{3, 0, 7}, {67, 61, 45}, 0};
  for (const FieldInfo& info : fields()) {
    INFO(info.name);
    // Shells end at a jump, and points may lie on either side of it.
    const double jumps = info.name == "shells" ? 0.5 : 0.0;
    lattice.joint = Joint::SharedPoints;
    lattice.type = ScalarType::F32;
    CHECK(differing<float>(info.name, lattice, part, 1.0, 2e-4) <= jumps);
    lattice.joint = Joint::Cells;
    lattice.type = ScalarType::U8;
    CHECK(differing<std::uint8_t>(info.name, lattice, part, 255.0, 1.0) <= jumps);
  }
  CHECK(device()->validationMessages() == "");
}

TEST_CASE("a field of a large lattice is made in parts") {
  Lattice lattice;
  lattice.size = {2048, 2048, 6};
  lattice.spacing = glm::dvec3(1.0 / 2047.0);
  lattice.type = ScalarType::U8;
  CHECK(differing<std::uint8_t>("ramp", lattice, {{0, 0, 0}, lattice.size, 0}, 255.0, 1.0) == 0.0);
}

TEST_CASE("copies of a field are side by side and share memory") {
  Lattice one;
  one.size = {12, 8, 10};
  one.spacing = glm::dvec3(1.0 / 12.0);
  one.type = ScalarType::U8;
  one.joint = Joint::Cells;
  Lattice all = one;
  all.size = one.size * glm::ivec3(2, 1, 3);
  const auto parts = [](const Lattice& lattice, const glm::ivec3& blocks) {
    return decompose(lattice.size, blocks, Layout::OnOneRank, Joint::Cells, 1, 1);
  };
  DeviceField field(device(), "mixing", 1);
  const std::vector<Block> copies = field.makeBlocks(one, all, parts(all, {4, 1, 3}), 255.0);
  const std::vector<Block> expected = field.makeBlocks(one, one, parts(one, {2, 1, 1}), 255.0);
  REQUIRE(copies.size() == 12);
  REQUIRE(expected.size() == 2);
  CHECK(localScene(copies).bounds == Box{{0.0, 0.0, 0.0}, {2.0, 8.0 / 12.0, 30.0 / 12.0}});
  std::set<const void*> values;
  for (std::size_t i = 0; i < copies.size(); ++i) {
    values.insert(copies[i].data);
    REQUIRE(copies[i].dims == glm::ivec3(6, 8, 10));
    CHECK(std::memcmp(copies[i].data, expected[i % 2].data, copies[i].byteCount()) == 0);
  }
  CHECK(values.size() == 2);
}

TEST_CASE("an unknown field is an error that lists the known ones") {
  CHECK_THROWS_WITH(DeviceField(device(), "cheese", 1), vdi::test::ContainsSubstring("mixing"));
}
