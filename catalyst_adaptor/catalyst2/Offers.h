// The arrays that the ranks' grids have in common: vdi_catalyst.h takes each array from all ranks or from
// none.
#pragma once

#include <mpi.h>

#include <cstdint>
#include <map>
#include <set>
#include <string>

#include "catalyst_adaptor/catalyst2/Grid.h"

namespace vdi::catalyst {

struct Offers {
  /// The arrays that all ranks with blocks have, each with the type that one of them gives it.
  std::map<Grid::Key, std::int32_t> common;
  /// The names of all other arrays of any rank.
  std::set<std::string> leftOut;
};

/// Collective.
Offers compareOffers(MPI_Comm comm, const Grid& grid);

}  // namespace vdi::catalyst
