// A VDI that a thread makes beside ParaView's own work, on one rank or on several together.
#ifndef VDIPreparation_h
#define VDIPreparation_h

#include <vtkNew.h>
#include <vtkType.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <thread>

#include "VDIVolume.h"
#include "vdi/pipeline/Reports.h"
#include "vtkVDIImageData.h"

class vtkMultiProcessController;

namespace pv {

/// On several ranks all functions that say so are collective: ParaView's servers have MPI for one thread
/// alone, which carries out what the others ask for, and only while it's in `serve` or one of these.
class Preparation {
 public:
  /// Makes the VDI and leaves it in `output`. It has the volume's turn, obeys `progress`, and throws when it
  /// can't.
  using Make = std::function<void(Volume& volume, const vdi::Progress& progress, vtkVDIImageData* output)>;

  /// Collective: takes the volume's next turn and starts the thread. The volume's controller has the ranks.
  /// `time`: of the maps and properties that it's made of, on this rank.
  Preparation(std::shared_ptr<Volume> volume, vtkMTimeType time, Make make);
  /// Collective: gives it up, and waits for the thread.
  ~Preparation();
  Preparation(const Preparation&) = delete;
  Preparation& operator=(const Preparation&) = delete;
  Preparation(Preparation&&) = delete;
  Preparation& operator=(Preparation&&) = delete;

  vtkMTimeType time() const { return Time; }
  void setTime(vtkMTimeType time) { Time = time; }
  bool hasRanks() const { return Of->hasRanks(); }
  /// Whether this rank's thread has nothing left to do.
  bool isDone() const { return Done; }
  /// Percent of it; 100 when it's there, -1 when it was given up or went wrong.
  int percent() const;
  /// The thread hears late that it's unwanted, once a band. One rank's word is enough.
  void giveUp() { Unwanted = true; }
  bool isGivenUp() const { return Unwanted; }
  /// Of several ranks: carries on what they do together, in the turns before this one, too. Doesn't wait for
  /// other ranks.
  void serve(std::chrono::milliseconds most) { Of->serve(most); }

  enum class End { Good, GivenUp, Failed };
  /// Collective: waits for the end, which is the same for all ranks. Calls `whileWaiting` now and then.
  End wait(const std::function<void()>& whileWaiting);
  /// After a good end.
  vtkVDIImageData* output() { return Output; }
  double share() const { return Share; }

 private:
  void work(const Make& make);

  std::shared_ptr<Volume> Of;
  Turn Mine;
  vtkMTimeType Time;
  std::atomic<double> Share{0.0};
  std::atomic<bool> Unwanted{false};
  std::atomic<bool> Done{false};
  vtkNew<vtkVDIImageData> Output;  // the thread's until Done
  bool Good = false;               // likewise
  std::jthread Worker;             // last: joined before the rest goes
};

/// Collective: whether it's true on all ranks of the controller; null: there's this one.
bool onAllRanks(vtkMultiProcessController* controller, bool here);

}  // namespace pv

#endif
