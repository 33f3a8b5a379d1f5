// The measurements of `vdi bench`.
#pragma once

#include <cstdio>
#include <memory>
#include <vector>

#include "bench/Row.h"
#include "bench/Suites.h"
#include "vdi/comm/Communicator.h"
#include "vdi/gpu/Device.h"

namespace vdi::bench {

/// Measures all data sets in all configurations, and writes a line to `table` as soon as each is
/// known. Collective: every rank runs the same stages, the root collects the figures, and the
/// others get no rows. Throws Error.
std::vector<BenchRow> runBench(const BenchOptions& options, const comm::Communicator& world,
                               const std::shared_ptr<gpu::Device>& device, std::FILE* table);

}  // namespace vdi::bench
