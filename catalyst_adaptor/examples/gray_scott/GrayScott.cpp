// The program: simulates, and hands V to the adaptor every k-th step.
#include <mpi.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include <vdi_catalyst.h>

#include "Simulation.h"

namespace {

constexpr double largestRate = 0.1;

struct Options {
  gray_scott::Parameters parameters;
  int steps = 600;
  int every = 200;
  std::vector<std::string> scripts;
};

/// The blocks of this rank as the adaptor takes them: cell data with one layer of ghost cells all around. At
/// the faces of the domain, periodic neighbours aren't neighbours in space. The halo exists there,
/// too, so the program announces the ghost layer, which merely lies outside.
std::vector<vdi_catalyst_block> describe(const gray_scott::Simulation& simulation, int size) {
  std::vector<vdi_catalyst_block> blocks;
  const int n = simulation.cellsPerBlock();
  const double spacing = 1.0 / size;
  for (const gray_scott::Block& block : simulation.blocks()) {
    vdi_catalyst_block description{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      description.cells[axis] = n + 2;
      description.ghost_lo[axis] = 1;
      description.ghost_hi[axis] = 1;
      description.spacing[axis] = spacing;
      description.origin[axis] = (block.at[axis] * n - 1) * spacing;
    }
    blocks.push_back(description);
  }
  return blocks;
}

/// Takes F and k from viewers, if a script lets them change these.
void takeRates(vdi_catalyst* catalyst, const gray_scott::Parameters& given,
               gray_scott::Simulation& simulation) {
  const double feed = vdi_catalyst_parameter_f64(catalyst, "feed", given.feed, 0.0, largestRate);
  const double kill = vdi_catalyst_parameter_f64(catalyst, "kill", given.kill, 0.0, largestRate);
  simulation.setRates(feed, kill);
}

int simulate(const Options& options) {
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  gray_scott::Simulation simulation(MPI_COMM_WORLD, options.parameters);
  std::vector<const char*> scripts;
  for (const std::string& script : options.scripts) scripts.push_back(script.c_str());
  vdi_catalyst* catalyst = nullptr;
  int worst = 0;
  if (!scripts.empty()) {
    worst = vdi_catalyst_initialize(MPI_Comm_c2f(MPI_COMM_WORLD), static_cast<int>(scripts.size()),
                                    scripts.data(), &catalyst);
  }
  double simulated = 0.0;
  double visualised = 0.0;
  auto seconds = [last = std::chrono::steady_clock::now()]() mutable {
    const auto now = std::chrono::steady_clock::now();
    const double elapsed = std::chrono::duration<double>(now - last).count();
    last = now;
    return elapsed;
  };
  const std::vector<vdi_catalyst_block> blocks = describe(simulation, options.parameters.size);
  for (int step = 1; step <= options.steps; ++step) {
    takeRates(catalyst, options.parameters, simulation);
    simulation.step();
    if (catalyst == nullptr || step % options.every != 0) continue;
    simulated += seconds();
    std::vector<const void*> data;
    for (const gray_scott::Block& block : simulation.blocks()) data.push_back(block.v.data());
    int code = vdi_catalyst_set_blocks(catalyst, static_cast<int>(blocks.size()), blocks.data());
    if (code == VDI_CATALYST_OK) {
      code = vdi_catalyst_set_array(catalyst, "V", VDI_CATALYST_F32, VDI_CATALYST_CELLS, data.data());
    }
    if (code == VDI_CATALYST_OK)
      code = vdi_catalyst_execute(catalyst, step, step * options.parameters.timeStep);
    worst = worst > code ? worst : code;
    visualised += seconds();
    if (rank == 0) {
      std::printf("gray_scott: step %d of %d, simulated %.1f s, visualised %.1f s%s\n", step, options.steps,
                  simulated, visualised, code == VDI_CATALYST_OK ? "" : ", this step's visualisation failed");
      std::fflush(stdout);
    }
  }
  if (catalyst != nullptr) vdi_catalyst_finalize(catalyst);
  return worst;
}

}  // namespace

int main(int argc, char** argv) {
  MPI_Init(&argc, &argv);
  int result = 0;
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  Options options;
  CLI::App app("Gray-Scott reaction-diffusion on blocks scattered over MPI ranks, visualised in situ");
  app.add_option("--size", options.parameters.size, "cells per axis")->capture_default_str();
  app.add_option("--blocks", options.parameters.blocks, "blocks per axis; divides the size")
      ->capture_default_str();
  app.add_option("--steps", options.steps, "steps to simulate")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  app.add_option("--every", options.every, "steps between two visualisations")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  app.add_option("--script", options.scripts, "Catalyst Python script; may be repeated");
  try {
    app.parse(argc, argv);
    result = simulate(options) == VDI_CATALYST_OK ? 0 : 3;
  } catch (const CLI::ParseError& error) {
    result = rank == 0 ? app.exit(error) : static_cast<int>(error.get_exit_code());
  } catch (const std::exception& error) {
    // The simulation throws for its arguments, which are equal on all ranks.
    if (rank == 0) std::fprintf(stderr, "gray_scott: %s\n", error.what());
    result = 2;
  }
  MPI_Finalize();
  return result;
}
