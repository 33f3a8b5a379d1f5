#include "tests/Catch.h"
#include "vdi/core/SlabTable.h"

using namespace vdi;

namespace {

// Blue to green, without any red, with rising opacity.
TransferFunction withoutRed() {
  TransferFunction function;
  function.colors = {{0.0, {0.0, 0.0, 1.0}}, {0.5, {0.0, 0.2, 1.0}}, {1.0, {0.0, 1.0, 0.3}}};
  function.opacities = {{0.0, 0.0}, {1.0, 0.5}};
  return function;
}

}  // namespace

TEST_CASE("slab table: a channel that the transfer function lacks is zero in rising and falling slabs") {
  const TransferTable transfer = bake(withoutRed());
  const SlabTable table = makeSlabTable(transfer, 1.0F);
  const double last = static_cast<double>(transfer.positions - 1);
  for (const double front : {0.0, 0.1, 0.34, 0.5, 0.77, 1.0}) {
    for (const double back : {0.0, 0.101, 0.25, 0.5, 0.83, 1.0}) {
      CAPTURE(front, back);
      const Slab slab = table.between(front * last, back * last);
      CHECK(slab.color.r == 0.0F);
      CHECK(slab.color.b <= 1.0F);
    }
  }
}
