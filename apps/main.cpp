// vdi: Volumetric Depth Images without ParaView.
#include <fmt/format.h>
#include <mpi.h>

#include <cstdio>

#include "apps/Commands.h"
#include "vdi/core/Error.h"

namespace {

constexpr int failed = 1;
constexpr int badUsage = 2;

int runTool(int argc, char** argv) {
  const vdi::comm::Communicator world = vdi::comm::Communicator::world();
  CLI::App app(
      "Volumetric Depth Images: small, view-dependent pictures with depth that can be seen from new "
      "viewpoints");
  app.require_subcommand(1);
  app.footer(
      "VDI_DEVICE chooses the Vulkan device (index or part of its name); VDI_VALIDATION=1 turns validation "
      "on.");
  vdi::apps::addGenerate(app, world);
  vdi::apps::addRender(app);
  vdi::apps::addCompare(app);
  vdi::apps::addInfo(app);
  vdi::apps::addBench(app);
  try {
    app.parse(argc, argv);
    return 0;
  } catch (const CLI::ParseError& error) {
    const bool help = error.get_exit_code() == 0;
    if (world.rank() == 0) app.exit(error);
    return help ? 0 : badUsage;
  } catch (const vdi::Error& error) {
    // All ranks fail together; the one with the cause speaks.
    if (error.code() != vdi::ErrorCode::RemoteRank) fmt::print(stderr, "vdi: {}\n", error.what());
    return error.code() == vdi::ErrorCode::InvalidArgument ? badUsage : failed;
  } catch (const std::exception& error) {
    fmt::print(stderr, "vdi: {}\n", error.what());
    return failed;
  }
}

}  // namespace

int main(int argc, char** argv) {
  MPI_Init(&argc, &argv);
  const int result = runTool(argc, argv);
  MPI_Finalize();
  return result;
}
