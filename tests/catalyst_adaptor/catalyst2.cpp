// A simulation that hands its grids over to Catalyst 2, or the same ones to the adaptor itself.
//
//     catalyst2 native|catalyst mesh|multimesh|amrmesh RUN [arguments of a script]
//     catalyst2 bad RUN
//     catalyst2 lost RUN
//
// RUN is a JSON text or the name of a script. The arrays have different orders in memory: interleaved cells,
// points within a halo, and cells of vectors whose components lie apart. `bad` hands over faulty nodes, most
// of them on one rank only, and then a sound mesh. `lost` hands over meshes to a run whose processes die.
// VDI_TEST_CUDA (cuda.h): through Catalyst, all values and marks of ghost cells lie in CUDA's memory. Exit
// status 0 if all calls returned the expected codes.
#include <mpi.h>

#include <algorithm>
#include <array>
#include <catalyst.hpp>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include "catalyst_adaptor/vdi_catalyst.h"
#include "tests/catalyst_adaptor/cuda.h"

namespace {

using conduit_cpp::Node;

constexpr int fineCells = 24;  // along each axis of the unit cube
constexpr int halo = 1;
constexpr std::array<const char*, 3> axes{"i", "j", "k"};

int wrong = 0;
int rank = 0;
int ranks = 0;

void expect(const std::string& what, int wanted, int got) {
  if (wanted == got) return;
  std::fprintf(stderr, "rank %d: %s is %d, not %d\n", rank, what.c_str(), got, wanted);
  ++wrong;
}

/// A block of a channel. `first` is in units of `spacing`, and `cells` include the ghost layers.
struct Piece {
  std::array<int, 3> first;
  std::array<int, 3> cells;
  std::array<int, 3> ghostLow;
  std::array<int, 3> ghostHigh;
  double spacing;
  int level;

  std::vector<double> interleaved;  // for each cell another value and V
  std::vector<float> padded;        // points in a halo
  std::array<std::vector<float>, 3> planes;
  std::vector<double> plainCells;
  std::vector<float> plainPoints;
  std::vector<float> plainVectors;
  std::vector<std::uint8_t> ghosts;
};

struct Layout {
  std::string name;
  std::vector<Piece> pieces;
};

Layout layoutOf(const std::string& name) {
  Layout layout{name, {}};
  const auto add = [&](std::array<int, 3> first, std::array<int, 3> cells, double spacing, int level) {
    layout.pieces.push_back({first, cells, {}, {}, spacing, level, {}, {}, {}, {}, {}, {}, {}});
    return &layout.pieces.back();
  };
  const double fine = 1.0 / fineCells;
  if (name == "mesh") {  // one slab per rank
    const int first = rank * fineCells / ranks;
    add({first, 0, 0}, {(rank + 1) * fineCells / ranks - first, fineCells, fineCells}, fine, 0);
  } else if (name == "multimesh") {  // bricks with ghost layers inside the cube; the third rank has none
    for (int i = 0; i < 8; ++i) {
      if (i % std::min(ranks, 2) != rank) continue;
      Piece& piece = *add({}, {}, fine, 0);
      for (int axis = 0; axis < 3; ++axis) {
        const auto at = static_cast<std::size_t>(axis);
        const bool upper = ((i >> axis) & 1) != 0;
        piece.cells[at] = fineCells / 2 + 1;
        piece.first[at] = upper ? fineCells / 2 - 1 : 0;
        piece.ghostLow[at] = upper ? 1 : 0;
        piece.ghostHigh[at] = upper ? 0 : 1;
      }
    }
  } else {  // two coarse halves and a finer block within, each on another rank
    const int half = fineCells / 4;
    if (0 % ranks == rank) add({0, 0, 0}, {half, 2 * half, 2 * half}, 2 * fine, 0);
    if (1 % ranks == rank) add({half, 0, 0}, {half, 2 * half, 2 * half}, 2 * fine, 0);
    if (2 % ranks == rank) add({8, 8, 8}, {8, 8, 8}, fine, 1);
  }
  return layout;
}

/// A hump that moves along y.
double humpAt(double x, double y, double z, int step) {
  const double dy = y - 0.4 - 0.05 * step;
  return 1.0 / (1.0 + 12.0 * ((x - 0.5) * (x - 0.5) + dy * dy + (z - 0.45) * (z - 0.45)));
}

/// Calls visit(i, x, y, z, value) for each cell (more = 0) or point (more = 1).
template <typename Visit>
void forEach(const Piece& piece, int more, int step, Visit visit) {
  const double middle = more == 0 ? 0.5 : 0.0;
  std::size_t i = 0;
  for (int z = 0; z < piece.cells[2] + more; ++z) {
    for (int y = 0; y < piece.cells[1] + more; ++y) {
      for (int x = 0; x < piece.cells[0] + more; ++x, ++i) {
        const auto place = [&](int axis, int at) {
          return (piece.first[static_cast<std::size_t>(axis)] + at + middle) * piece.spacing;
        };
        visit(i, x, y, z, humpAt(place(0, x), place(1, y), place(2, z), step));
      }
    }
  }
}

std::size_t countOf(const Piece& piece, int more) {
  return static_cast<std::size_t>(piece.cells[0] + more) * static_cast<std::size_t>(piece.cells[1] + more) *
         static_cast<std::size_t>(piece.cells[2] + more);
}

std::size_t inHalo(const Piece& piece, int x, int y, int z) {
  const auto width = static_cast<std::size_t>(piece.cells[0] + 1 + 2 * halo);
  const auto height = static_cast<std::size_t>(piece.cells[1] + 1 + 2 * halo);
  return (static_cast<std::size_t>(z + halo) * height + static_cast<std::size_t>(y + halo)) * width +
         static_cast<std::size_t>(x + halo);
}

void simulate(Piece& piece, int step) {
  const std::size_t cells = countOf(piece, 0);
  const std::size_t points = countOf(piece, 1);
  piece.interleaved.resize(2 * cells);
  piece.plainCells.resize(cells);
  piece.plainPoints.resize(points);
  piece.plainVectors.resize(3 * cells);
  piece.padded.resize(countOf(piece, 1 + 2 * halo));
  piece.ghosts.resize(cells);
  for (auto& plane : piece.planes) plane.resize(cells);
  std::fill(piece.padded.begin(), piece.padded.end(), 1e30F);  // never to be read
  forEach(piece, 0, step, [&](std::size_t i, int x, int y, int z, double value) {
    piece.interleaved[2 * i] = -1e30;
    piece.interleaved[2 * i + 1] = piece.plainCells[i] = value;
    for (std::size_t c = 0; c < 3; ++c)
      piece.planes[c][i] = piece.plainVectors[3 * i + c] =
          static_cast<float>(value) * 0.25F * static_cast<float>(c + 1);
    const std::array<int, 3> at{x, y, z};
    bool isGhost = false;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      isGhost =
          isGhost || at[axis] < piece.ghostLow[axis] || at[axis] >= piece.cells[axis] - piece.ghostHigh[axis];
    }
    piece.ghosts[i] = isGhost ? 1 : 0;
  });
  forEach(piece, 1, step, [&](std::size_t i, int x, int y, int z, double value) {
    piece.padded[inHalo(piece, x, y, z)] = piece.plainPoints[i] = static_cast<float>(value);
  });
}

// --- The adaptor itself.

void runNative(Layout& layout, const std::string& run, int steps) {
  vdi_catalyst* catalyst = nullptr;
  expect("initialize", 0, vdi_catalyst_initialize_json(MPI_Comm_c2f(MPI_COMM_WORLD), run.c_str(), &catalyst));
  std::vector<vdi_catalyst_block> blocks;
  std::vector<const void*> data;
  const bool isMesh = layout.name == "mesh";
  const bool isMulti = layout.name == "multimesh";
  std::vector<vdi_catalyst_strides> strides;
  for (Piece& piece : layout.pieces) {
    simulate(piece, 0);
    vdi_catalyst_block& block = blocks.emplace_back();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      block.cells[axis] = piece.cells[axis];
      block.ghost_lo[axis] = piece.ghostLow[axis];
      block.ghost_hi[axis] = piece.ghostHigh[axis];
      block.origin[axis] = piece.first[axis] * piece.spacing;
      block.spacing[axis] = piece.spacing;
    }
    data.push_back(isMesh    ? static_cast<const void*>(piece.plainCells.data())
                   : isMulti ? static_cast<const void*>(piece.plainPoints.data())
                             : static_cast<const void*>(piece.plainVectors.data()));
    const std::int64_t value = 3 * sizeof(float);
    strides.push_back(
        {{value, value * piece.cells[0], value * piece.cells[0] * piece.cells[1]}, sizeof(float)});
  }
  const auto count = static_cast<std::int32_t>(blocks.size());
  expect("set_blocks", 0, vdi_catalyst_set_blocks(catalyst, count, blocks.data()));
  const int type = isMesh ? VDI_CATALYST_F64 : VDI_CATALYST_F32;
  const int where = isMulti ? VDI_CATALYST_POINTS : VDI_CATALYST_CELLS;
  expect("set_array", 0,
         isMesh || isMulti
             ? vdi_catalyst_set_array(catalyst, "V", type, where, data.data())
             : vdi_catalyst_set_array_strided(catalyst, "V", type, where, 3, data.data(), strides.data()));
  for (int step = 0; step < steps; ++step) {
    for (Piece& piece : layout.pieces) simulate(piece, step);
    expect("execute", 0, vdi_catalyst_execute(catalyst, step, 0.5 * step));
  }
  expect("finalize", 0, vdi_catalyst_finalize(catalyst));
}

// --- Catalyst 2.

void* stream = nullptr;                 // of CUDA; null: values lie on the host
std::map<const void*, char*> onDevice;  // by the memory on the host

/// Where the step's values are: on the host, or on their way to CUDA's memory.
template <typename Number>
Number* placeOf(std::vector<Number>& values) {
  if (stream == nullptr) return values.data();
  const std::size_t bytes = values.size() * sizeof(Number);
  char*& place = onDevice[values.data()];
  if (place == nullptr) place = cuda_allocate(bytes);
  cuda_write(stream, place, values.data(), bytes);
  return reinterpret_cast<Number*>(place);
}

int status(catalyst_status code) {
  return static_cast<int>(code);
}

void describeValues(const Layout& layout, Piece& piece, Node& field) {
  const auto cells = static_cast<conduit_index_t>(countOf(piece, 0));
  field["topology"].set(std::string("topo"));
  field["association"].set(std::string(layout.name == "multimesh" ? "vertex" : "element"));
  if (layout.name == "mesh") {
    field["values"].set_external(placeOf(piece.interleaved), cells, sizeof(double), 2 * sizeof(double));
  } else if (layout.name == "multimesh") {
    field["values"].set_external(placeOf(piece.padded), static_cast<conduit_index_t>(piece.padded.size()));
    const std::int64_t width = piece.cells[0] + 1 + 2 * halo;
    field["offsets"].set(std::vector<std::int64_t>{halo, halo, halo});
    field["strides"].set(std::vector<std::int64_t>{1, width, width * (piece.cells[1] + 1 + 2 * halo)});
  } else {
    for (std::size_t c = 0; c < 3; ++c)
      field["values"][std::string(1, static_cast<char>('u' + c))].set_external(placeOf(piece.planes[c]),
                                                                               cells);
  }
}

void describe(const Layout& layout, std::size_t number, Piece& piece, Node& mesh) {
  mesh["coordsets/coords/type"].set(std::string("uniform"));
  constexpr std::array<const char*, 3> names{"x", "y", "z"};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::string name = names[axis];
    mesh[std::string("coordsets/coords/dims/") + axes[axis]].set(piece.cells[axis] + 1);
    mesh["coordsets/coords/origin/" + name].set(piece.first[axis] * piece.spacing);
    mesh["coordsets/coords/spacing/d" + name].set(piece.spacing);
  }
  mesh["topologies/topo/type"].set(std::string("uniform"));
  mesh["topologies/topo/coordset"].set(std::string("coords"));
  Node field = mesh["fields/V"];
  describeValues(layout, piece, field);
  if (layout.name == "multimesh") {
    Node marks = mesh[number % 2 == 0 ? "fields/ascent_ghosts" : "fields/vtkGhostType"];
    marks["association"].set(std::string("element"));
    marks["topology"].set(std::string("topo"));
    marks["values"].set_external(placeOf(piece.ghosts), static_cast<conduit_index_t>(piece.ghosts.size()));
  } else if (layout.name == "amrmesh") {
    mesh["state/level"].set(piece.level);
    mesh["state/domain_id"].set(rank);
  }
}

/// A rank's step in the form that ParaView's implementation defines.
Node stepNode(Layout& layout, int step) {
  Node node;
  node["catalyst/state/timestep"].set(step);
  node["catalyst/state/time"].set(0.5 * step);
  if (stream != nullptr) node["catalyst/vdi/stream"].set(reinterpret_cast<std::uint64_t>(stream));
  Node channel = node["catalyst/channels/grid"];
  channel["type"].set(layout.name);
  Node data = channel["data"];
  for (std::size_t i = 0; i < layout.pieces.size(); ++i) {
    simulate(layout.pieces[i], step);
    if (layout.name == "mesh") {
      describe(layout, i, layout.pieces[i], data);
    } else {
      Node domain = data["domain_" + std::to_string(i)];
      describe(layout, i, layout.pieces[i], domain);
    }
  }
  return node;
}

Node initialNode(const std::string& run, const std::vector<std::string>& arguments) {
  Node node;
  node["catalyst/mpi_comm"].set(static_cast<std::int64_t>(MPI_Comm_c2f(MPI_COMM_WORLD)));
  node["catalyst/vdi/parameters/feed/value"].set(0.037);
  node["catalyst/vdi/parameters/feed/low"].set(0.0);
  node["catalyst/vdi/parameters/feed/high"].set(0.1);
  node["catalyst/vdi/parameters/kind/value"].set(2);
  node["catalyst/vdi/parameters/kind/low"].set(0);
  node["catalyst/vdi/parameters/kind/high"].set(3);
  if (run.ends_with(".py")) {
    node["catalyst/scripts/script/filename"].set(run);
    for (const std::string& argument : arguments) node["catalyst/scripts/script/args"].append().set(argument);
  } else {
    node["catalyst/vdi/json"].set(run);
  }
  return node;
}

void checkResults(int made, int failed) {
  Node results;
  expect("results", 0, status(catalyst_results(conduit_cpp::c_node(&results))));
  expect("steps", made, static_cast<int>(results["catalyst/vdi/steps"].as_int64()));
  expect("failed", failed, static_cast<int>(results["catalyst/vdi/failed"].as_int64()));
  expect("feed", 37,
         static_cast<int>(std::lround(1000 * results["catalyst/vdi/parameters/feed"].as_float64())));
  expect("kind", 2, static_cast<int>(results["catalyst/vdi/parameters/kind"].as_int64()));
  Node about;
  expect("about", 0, status(catalyst_about(conduit_cpp::c_node(&about))));
  expect("the implementation is vdi", 1, about["catalyst/implementation"].as_string() == "vdi" ? 1 : 0);
}

int execute(const Node& node) {
  return status(catalyst_execute(conduit_cpp::c_node(&node)));
}

void finalize() {
  const Node node;
  expect("finalize", 0, status(catalyst_finalize(conduit_cpp::c_node(&node))));
  expect("a second finalize", 100, status(catalyst_finalize(conduit_cpp::c_node(&node))));
  expect("a step after it", 100, execute(node));
}

/// Adds arrays of each type, whose values the script knows, one that only the first rank has, and one with
/// too many components.
void addTypes(Node& mesh, std::size_t cells) {
  const auto add = [&](const std::string& name, auto zero) {
    std::vector<decltype(zero)> values(cells);
    for (std::size_t i = 0; i < cells; ++i) values[i] = static_cast<decltype(zero)>(i % 100);
    Node field = mesh["fields/" + name];
    field["association"].set(std::string("element"));
    field["topology"].set(std::string("topo"));
    field["values"].set(values);
  };
  add("u8", conduit_uint8{});
  add("i8", conduit_int8{});
  add("u16", conduit_uint16{});
  add("i16", conduit_int16{});
  add("u32", conduit_uint32{});
  add("i32", conduit_int32{});
  add("u64", conduit_uint64{});
  add("i64", conduit_int64{});
  add("f32", conduit_float32{});
  add("f64", conduit_float64{});
  if (rank == 0) add("mine", conduit_float64{});
  constexpr int speciesCount = 20;
  Node species = mesh["fields/species"];
  species["association"].set(std::string("element"));
  species["topology"].set(std::string("topo"));
  for (int i = 0; i < speciesCount; ++i) {
    std::string name = "s";
    name += std::to_string(i);  // GCC 12 warns of an overlap in the sum of the two
    species["values"][name].set(std::vector<conduit_float32>(cells));
  }
}

void runCatalyst(Layout& layout, const std::string& run, const std::vector<std::string>& arguments,
                 int steps) {
  const Node initial = initialNode(run, arguments);
  expect("initialize", 0, status(catalyst_initialize(conduit_cpp::c_node(&initial))));
  const bool isScript = !arguments.empty();
  for (int step = 0; step < steps; ++step) {
    Node node = stepNode(layout, step);
    Node mesh = node["catalyst/channels/grid/data"];
    if (isScript) addTypes(mesh, countOf(layout.pieces.front(), 0));
    // A run without a script doesn't want this step, so the channel's type goes unread.
    if (!isScript && step == 1) node["catalyst/channels/grid/type"].set(std::string("nonsense"));
    expect("execute", 0, execute(node));
  }
  checkResults(isScript ? steps : steps - 1, 0);
  finalize();
}

// --- Faulty input.

void refuseToStart(const std::string& what, const std::function<void(Node&)>& spoil) {
  Node node;
  spoil(node);
  expect(what, 100, status(catalyst_initialize(conduit_cpp::c_node(&node))));
}

void runBad(const std::string& run) {
  refuseToStart("nothing to make", [](Node& node) { node["catalyst/other"].set(1); });
  refuseToStart("both", [&](Node& node) {
    node["catalyst/vdi/json"].set(run);
    node["catalyst/scripts/script"].set(std::string("script.py"));
  });
  refuseToStart("ParaView's pipelines", [&](Node& node) {
    node["catalyst/vdi/json"].set(run);
    node["catalyst/pipelines/0/type"].set(std::string("io"));
  });
  refuseToStart("no communicator", [](Node& node) { node["catalyst/mpi_comm"].set(123456); });
  const Node initial = initialNode(run, {});
  expect("initialize", 0, status(catalyst_initialize(conduit_cpp::c_node(&initial))));
  expect("a second one", 100, status(catalyst_initialize(conduit_cpp::c_node(&initial))));

  Layout layout = layoutOf("mesh");
  int step = 0;
  const int last = ranks - 1;
  const auto refuse = [&](const std::string& what, int where,
                          const std::function<void(Node&, Node&)>& spoil) {
    Node node = stepNode(layout, step++);
    Node catalyst = node["catalyst"];
    Node mesh = node["catalyst/channels/grid/data"];
    if (rank == where) spoil(catalyst, mesh);
    expect(what, 100, execute(node));
  };
  const std::string coordset = "coordsets/coords";
  refuse("rectilinear", last,
         [&](Node&, Node& mesh) { mesh[coordset + "/type"].set(std::string("rectilinear")); });
  refuse("unstructured", 0,
         [](Node&, Node& mesh) { mesh["topologies/topo/type"].set(std::string("unstructured")); });
  refuse("two dimensions", 0, [&](Node&, Node& mesh) { mesh[coordset + "/dims/k"].set(1); });
  refuse("text for a number", 0,
         [&](Node&, Node& mesh) { mesh[coordset + "/dims/k"].set(std::string("2")); });
  refuse("no spacing", 0, [&](Node&, Node& mesh) { mesh[coordset + "/spacing/dx"].set(0.0); });
  refuse("too few values", last, [&](Node&, Node& mesh) {
    mesh["fields/V/values"].set_external(layout.pieces.front().plainCells.data(), 7);
  });
  refuse("strides beyond", 0, [](Node&, Node& mesh) {
    mesh["fields/V/strides"].set(std::vector<std::int64_t>{1, 1000, 5});
  });
  refuse("no association", 0,
         [](Node&, Node& mesh) { mesh["fields/V/association"].set(std::string("edge")); });
  refuse("ghosts that are no layers", last, [&](Node&, Node& mesh) {
    Node marks = mesh["fields/ascent_ghosts"];
    marks["association"].set(std::string("element"));
    std::vector<std::int32_t> values(countOf(layout.pieces.front(), 0));
    values[values.size() / 2 + 5] = 1;
    marks["values"].set(values);
  });
  refuse("a channel of particles", 0,
         [](Node& catalyst, Node&) { catalyst["channels/grid/type"].set(std::string("particles")); });
  refuse("no time", 0, [](Node& catalyst, Node&) { catalyst["state/time"].set(std::string("now")); });
  refuse("a time that is no number", last,
         [](Node& catalyst, Node&) { catalyst["state/time"].set(std::nan("")); });
  refuse("different steps", last, [](Node& catalyst, Node&) { catalyst["state/timestep"].set(77); });
  Node below = stepNode(layout, -1);
  expect("a step below 0", 100, execute(below));
  ++step;
  Node without;
  without["catalyst/state/timestep"].set(step++);
  without["catalyst/state/time"].set(0.0);
  expect("no channel", 100, execute(without));
  expect("a mesh", 0, execute(stepNode(layout, step)));
  checkResults(1, step);
  finalize();
}

// --- An engine that is lost.

void runLost(const std::string& run) {
  constexpr int steps = 8;
  constexpr std::chrono::milliseconds pause{300};
  constexpr int lost = 102;
  const Node initial = initialNode(run, {});
  expect("initialize", 0, status(catalyst_initialize(conduit_cpp::c_node(&initial))));
  Layout layout = layoutOf("mesh");
  bool isLost = false;
  for (int step = 0; step < steps; ++step) {
    const int code = execute(stepNode(layout, step));
    expect("step " + std::to_string(step), isLost || code != 0 ? lost : 0, code);
    isLost = isLost || code != 0;
    std::this_thread::sleep_for(pause);
  }
  expect("the engine is lost", 1, isLost ? 1 : 0);
  const Node none;
  expect("finalize", lost, status(catalyst_finalize(conduit_cpp::c_node(&none))));
}

}  // namespace

int main(int argc, char** argv) {
  MPI_Init(&argc, &argv);
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Comm_size(MPI_COMM_WORLD, &ranks);
  const std::vector<std::string> given(argv + 1, argv + argc);
  constexpr int steps = 3;
  if (std::getenv("VDI_TEST_CUDA") != nullptr) {
    cuda_begin();
    stream = cuda_stream(0);
  }
  if (given.size() == 2 && given[0] == "bad") {
    runBad(given[1]);
  } else if (given.size() == 2 && given[0] == "lost") {
    runLost(given[1]);
  } else if (given.size() >= 3) {
    Layout layout = layoutOf(given[1]);
    if (given[0] == "native")
      runNative(layout, given[2], steps);
    else
      runCatalyst(layout, given[2], {given.begin() + 3, given.end()}, steps);
  } else {
    wrong = 1;
  }
  MPI_Allreduce(MPI_IN_PLACE, &wrong, 1, MPI_INT, MPI_SUM, MPI_COMM_WORLD);
  MPI_Finalize();
  return wrong == 0 ? 0 : 1;
}
