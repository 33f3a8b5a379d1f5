#include "catalyst_adaptor/catalyst2/Session.h"

#include <array>
#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <utility>

#include "catalyst_adaptor/catalyst2/Offers.h"

namespace vdi::catalyst {

namespace {

Settings::Script scriptOf(const Node& node) {
  Settings::Script script;
  if (node.isText()) {
    script.file = node.text();
    return script;
  }
  script.file = node.at("filename").text();
  if (const auto arguments = node.find("args")) {
    for (const Node& argument : arguments->children()) script.arguments.push_back(argument.text());
  }
  return script;
}

Parameter parameterOf(const Node& node) {
  const Node value = node.at("value");
  const auto numberOf = [&](const char* path) {
    constexpr double largestWhole = 0x1p53;  // as vdi_catalyst_parameter_i64 takes them
    const Node number = node.at(path);
    if (value.isWhole() && !(std::abs(number.number()) <= largestWhole)) number.refuse("lies beyond 2^53");
    return number.number();
  };
  return {node.name(), value.isWhole(), numberOf("value"), numberOf("low"), numberOf("high")};
}

Settings settingsOf(const Node& params) {
  Settings settings;
  const Node catalyst = params.at("catalyst");
  for (const char* other : {"pipelines", "proxies"}) {
    if (const auto node = catalyst.find(other))
      node->refuse("are ParaView's own; this implementation has none");
  }
  if (const auto json = catalyst.find("vdi/json")) settings.json = json->text();
  if (const auto scripts = catalyst.find("scripts")) {
    for (const Node& node : scripts->children()) {
      Settings::Script script = scriptOf(node);
      if (!script.file.ends_with(".json")) {
        settings.scripts.push_back(std::move(script));
      } else if (settings.json) {
        node.refuse("is a second run without a script; only one is possible");
      } else {
        settings.json = script.file;
      }
    }
  }
  if (settings.json && !settings.scripts.empty())
    catalyst.refuse("has scripts and a run without a script; choose one of them");
  if (!settings.json && settings.scripts.empty())
    catalyst.refuse("has neither scripts nor vdi/json, so nothing would be made");
  if (const auto channel = catalyst.find("vdi/channel")) settings.channel = channel->text();
  if (const auto parameters = catalyst.find("vdi/parameters")) {
    for (const Node& node : parameters->children()) settings.parameters.push_back(parameterOf(node));
  }
  return settings;
}

std::int64_t stepOf(const Node& state) {
  const auto timestep = state.find("timestep");
  return (timestep ? *timestep : state.at("cycle")).whole();
}

/// The meshes of a channel.
Node dataOf(const Node& channel) {
  const Node type = channel.at("type");
  const std::string text = type.text();
  if (text != "mesh" && text != "multimesh" && text != "amrmesh")
    type.refuse("is '" + text + "'; this implementation takes mesh, multimesh and amrmesh");
  return channel.at("data");
}

}  // namespace

Session::Session(MPI_Comm comm) {
  if (MPI_Comm_dup(comm, &calls_.comm) != MPI_SUCCESS) throw std::runtime_error("MPI_Comm_dup failed");
  MPI_Comm_set_errhandler(calls_.comm, MPI_ERRORS_RETURN);
}

Session::~Session() {
  int over = 0;
  MPI_Finalized(&over);
  if (over == 0) MPI_Comm_free(&calls_.comm);
}

int Session::initialize(const Node& params) {
  int code = guarded(calls_, VDI_CATALYST_BAD_ARGUMENT, [&] { settings_ = settingsOf(params); });
  if (code == VDI_CATALYST_OK) {
    code = guarded(calls_, VDI_CATALYST_BAD_ARGUMENT, [&] {
      requireEqual(calls_.comm, settings_.json ? 1 : 0, "some ranks give scripts, and others a run without");
    });
  }
  if (code == VDI_CATALYST_OK) {
    code = guarded(calls_, VDI_CATALYST_BAD_ARGUMENT, [&] {
      requireEqual(calls_.comm, static_cast<std::int64_t>(settings_.parameters.size()),
                   "the ranks give different numbers of parameters");
    });
  }
  if (code == VDI_CATALYST_OK) code = start();
  if (code == VDI_CATALYST_OK) code = declareParameters();
  if (code != VDI_CATALYST_OK && catalyst_ != nullptr) finalize();
  return code;
}

int Session::start() {
  const MPI_Fint comm = MPI_Comm_c2f(calls_.comm);
  if (settings_.json) return vdi_catalyst_initialize_json(comm, settings_.json->c_str(), &catalyst_);
  std::vector<std::vector<const char*>> arguments;
  for (const Settings::Script& script : settings_.scripts) {
    std::vector<const char*>& own = arguments.emplace_back();
    for (const std::string& argument : script.arguments) own.push_back(argument.c_str());
  }
  std::vector<vdi_catalyst_pipeline> scripts;
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    scripts.push_back({settings_.scripts[i].file.c_str(), static_cast<std::int32_t>(arguments[i].size()),
                       arguments[i].data()});
  }
  return vdi_catalyst_initialize_pipelines(comm, static_cast<std::int32_t>(scripts.size()), scripts.data(),
                                           &catalyst_);
}

double Session::valueOf(const Parameter& one) {
  if (!one.isWhole)
    return vdi_catalyst_parameter_f64(catalyst_, one.name.c_str(), one.value, one.low, one.high);
  const auto whole = [](double number) { return static_cast<std::int64_t>(number); };
  return static_cast<double>(vdi_catalyst_parameter_i64(catalyst_, one.name.c_str(), whole(one.value),
                                                        whole(one.low), whole(one.high)));
}

int Session::declareParameters() {
  for (const Parameter& parameter : settings_.parameters) {
    valueOf(parameter);
    if (*vdi_catalyst_error(catalyst_) != '\0') return VDI_CATALYST_BAD_ARGUMENT;
  }
  return VDI_CATALYST_OK;
}

std::optional<Node> Session::channelOf(const Node& params) const {
  const auto channels = params.find("catalyst/channels");
  if (!channels) return std::nullopt;
  if (!settings_.channel.empty()) return channels->find(settings_.channel);
  if (auto grid = channels->find("grid")) return grid;
  const std::vector<Node> all = channels->children();
  if (all.size() > 1) channels->refuse("has several channels; catalyst/vdi/channel chooses one");
  return all.empty() ? std::nullopt : std::optional<Node>(all.front());
}

int Session::execute(const Node& params) {
  std::int64_t step = 0;
  double time = 0.0;
  int code = guarded(calls_, VDI_CATALYST_BAD_ARGUMENT, [&] {
    const Node state = params.at("catalyst/state");
    step = stepOf(state);
    time = state.at("time").number();
    if (!std::isfinite(time)) state.at("time").refuse("isn't a finite number");
  });
  if (code == VDI_CATALYST_OK) {
    code = guarded(calls_, VDI_CATALYST_BAD_ARGUMENT,
                   [&] { requireEqual(calls_.comm, step, "the ranks give different steps"); });
  }
  // vdi_catalyst_execute reports a number that no step can have.
  bool isWanted = true;
  if (code == VDI_CATALYST_OK && isStep(step)) isWanted = vdi_catalyst_wants(catalyst_, step, time) != 0;
  // A lost engine wants no step. Only vdi_catalyst_execute can tell whether it is still lost.
  if (!isWanted && !hasLostEngine_) return code;
  if (code == VDI_CATALYST_OK) code = handOver(step, params);
  if (code == VDI_CATALYST_OK) {
    code = vdi_catalyst_execute(catalyst_, step, time);
    hasLostEngine_ = code == VDI_CATALYST_ENGINE;
  }
  if (code == VDI_CATALYST_OK) calls_.printed.clear();
  if (code != VDI_CATALYST_OK) {
    ++failed_;
  } else if (isWanted) {
    ++made_;
  }
  return code;
}

int Session::handOver(std::int64_t step, const Node& params) {
  std::array<int, 2> all{0, 0};  // on all ranks: the grid is as before; there is no channel
  int code = guarded(
      calls_, VDI_CATALYST_BAD_ARGUMENT,
      [&] {
        if (const std::optional<Node> stream = params.find("catalyst/vdi/stream")) setStream(*stream);
        const std::optional<Node> channel = channelOf(params);
        all[1] = channel ? 0 : 1;
        const bool same = grid_.read(channel ? std::optional(dataOf(*channel)) : std::nullopt);
        all[0] = same && handedOver_ ? 1 : 0;
      },
      step);
  if (code != VDI_CATALYST_OK) {
    handedOver_ = false;
    return code;
  }
  MPI_Allreduce(MPI_IN_PLACE, all.data(), 2, MPI_INT, MPI_MIN, calls_.comm);
  if (all[1] == 1) {
    const std::string name = settings_.channel.empty() ? "" : " '" + settings_.channel + "'";
    return guarded(
        calls_, VDI_CATALYST_BAD_ARGUMENT,
        [&] { throw std::invalid_argument("catalyst/channels has no channel" + name); }, step);
  }
  if (all[0] == 1) return VDI_CATALYST_OK;
  handedOver_ = false;
  code = vdi_catalyst_set_blocks(catalyst_, static_cast<std::int32_t>(grid_.blocks().size()),
                                 grid_.blocks().data());
  if (code == VDI_CATALYST_OK) code = setArrays();
  handedOver_ = code == VDI_CATALYST_OK;
  return code;
}

/// Not collective.
void Session::setStream(const Node& node) {
  const auto number = static_cast<std::uintptr_t>(node.whole());  // nodes hold no pointers
  auto* const stream = reinterpret_cast<void*>(number);           // NOLINT(performance-no-int-to-ptr)
  try {
    grid_.gpuMemory().setStream(stream);
  } catch (const std::invalid_argument& error) {
    node.refuse(std::string("is no stream: ") + error.what());
  }
  vdi_catalyst_set_stream(catalyst_, stream);
}

int Session::setArrays() {
  const Offers offers = compareOffers(calls_.comm, grid_);
  int rank = 0;
  MPI_Comm_rank(calls_.comm, &rank);
  for (const std::string& name : offers.leftOut) {
    if (leftOut_.insert(name).second && rank == 0) {
      std::fprintf(
          stderr,
          "vdi_catalyst: the field '%s' is left out: it isn't in all domains, isn't the same kind of field "
          "there, or has more than %d components\n",
          name.c_str(), maxComponents);
    }
  }
  for (const auto& [key, type] : offers.common) {
    const auto& [association, components, name] = key;
    const auto own = grid_.arrays().find(key);
    const bool isHere = own != grid_.arrays().end();
    int code = vdi_catalyst_set_array_strided(
        catalyst_, name.c_str(), isHere ? own->second.type : type, association, components,
        isHere ? own->second.data.data() : nullptr, isHere ? own->second.strides.data() : nullptr);
    if (code == VDI_CATALYST_OK) {
      code =
          vdi_catalyst_set_array_missing(catalyst_, name.c_str(), association,
                                         isHere ? static_cast<std::int32_t>(own->second.missing.size()) : 0,
                                         isHere ? own->second.missing.data() : nullptr);
    }
    if (code != VDI_CATALYST_OK) return code;
  }
  return VDI_CATALYST_OK;
}

int Session::results(conduit_node* params) {
  conduit_node_set_path_int64(params, "catalyst/vdi/steps", made_);
  conduit_node_set_path_int64(params, "catalyst/vdi/failed", failed_);
  for (const Parameter& parameter : settings_.parameters) {
    const double value = valueOf(parameter);
    const std::string path = "catalyst/vdi/parameters/" + parameter.name;
    if (parameter.isWhole) {
      conduit_node_set_path_int64(params, path.c_str(), static_cast<std::int64_t>(value));
    } else {
      conduit_node_set_path_float64(params, path.c_str(), value);
    }
  }
  return VDI_CATALYST_OK;
}

int Session::finalize() {
  return vdi_catalyst_finalize(std::exchange(catalyst_, nullptr));
}

}  // namespace vdi::catalyst
