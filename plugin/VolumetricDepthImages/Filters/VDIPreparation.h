// A VDI that a thread makes in the background of ParaView's own work, on one rank or on several together.
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

namespace pv {

/// On several ranks, a function is collective if its comment states it. ParaView's servers allow MPI on one
/// thread alone. That thread carries out the operations of the others, and only while it is in `serve` or in
/// a collective function of this class.
class Preparation {
 public:
  /// A function that makes the VDI and leaves it in `output`. It is called during a turn of the volume, obeys
  /// `progress`, and throws if it can't make the VDI.
  using Make = std::function<void(Volume& volume, const vdi::Progress& progress, vtkVDIImageData* output)>;

  /// Collective: takes the volume's next turn and starts the thread. The ranks are those of the volume's
  /// controller. `time` is the modification time of the maps and properties in use, on this rank.
  Preparation(std::shared_ptr<Volume> volume, vtkMTimeType time, Make make);
  /// Collective: gives the VDI up, and waits for the thread.
  ~Preparation();
  Preparation(const Preparation&) = delete;
  Preparation& operator=(const Preparation&) = delete;
  Preparation(Preparation&&) = delete;
  Preparation& operator=(Preparation&&) = delete;

  vtkMTimeType time() const { return time_; }
  void setTime(vtkMTimeType time) { time_ = time; }
  bool hasRanks() const { return volume_->hasRanks(); }
  /// Whether this rank's thread has nothing left to do.
  bool isDone() const { return isDone_; }
  /// The progress in percent: 100 once the VDI is ready, -1 after it was given up or failed.
  int percent() const;
  /// Asks the thread to stop. The thread checks this once a band. One rank's call is enough.
  void giveUp() { isUnwanted_ = true; }
  bool isGivenUp() const { return isUnwanted_; }
  /// With several ranks: carries out the collective operations of the ranks' threads, in this turn and in
  /// those before it. Doesn't wait for other ranks.
  void serve(std::chrono::milliseconds most) { volume_->serve(most); }

  enum class End { Good, GivenUp, Failed };
  /// Collective: waits for the end, which is the same on all ranks. Calls `whileWaiting` now and then.
  End wait(const std::function<void()>& whileWaiting);
  /// `output` and `share` are valid once `wait` has returned End::Good.
  vtkVDIImageData* output() { return output_; }
  double share() const { return share_; }

 private:
  void work(const Make& make);

  std::shared_ptr<Volume> volume_;
  Turn turn_;
  vtkMTimeType time_;
  std::atomic<double> share_{0.0};
  std::atomic<bool> isUnwanted_{false};
  std::atomic<bool> isDone_{false};
  vtkNew<vtkVDIImageData> output_;  // belongs to the thread until isDone_
  bool isGood_ = false;             // belongs to the thread until isDone_
  // last member, so that the thread is joined before the others are destroyed
  std::jthread thread_;
};

}  // namespace pv

#endif
