// ParaView's in situ engine behind a small interface: the only place that depends on its version.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <vtkSmartPointer.h>

class vtkDataObject;

namespace vdi::catalyst {

/// One a process: ParaView can't be started twice. Collective throughout.
class Engine {
 public:
  /// Throws std::runtime_error when the engine was started before or won't start.
  Engine(int fortranCommunicator, const std::vector<std::string>& scripts);
  ~Engine();
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;

  /// Runs every script on `grid`. Returns what went wrong on this rank, "" if nothing did. A script that
  /// fails is called again at the next step.
  std::string execute(vtkDataObject* grid, std::int64_t step, double time);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace vdi::catalyst
