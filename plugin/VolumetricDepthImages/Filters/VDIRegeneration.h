// Which output a filter's updates give while a thread may be making the next one.
#ifndef VDIRegeneration_h
#define VDIRegeneration_h

#include <vtkNew.h>
#include <vtkTimeStamp.h>
#include <vtkType.h>

#include <chrono>
#include <functional>
#include <memory>
#include <optional>

#include "VDILoad.h"
#include "VDIPreparation.h"
#include "vdi/core/Box.h"
#include "vtkVDIImageData.h"

class vtkImageData;
class vtkMultiProcessController;

namespace pv {

class Volume;

/// What a view has asked for and hasn't got yet.
struct Request {
  Load load;
  vdi::Box bounds;  // of all ranks' blocks
};

/// The state between a filter's updates: the last output, what views wait for, and the preparation of the
/// next output. `now` is the modification time of the filter's properties and maps. Belongs to the main
/// thread. Functions with a controller are collective on its ranks.
class Regeneration {
 public:
  /// A held filter keeps its output when properties and maps change.
  void hold();
  /// Returns whether the output is out of date. Then the filter is modified, and calls carryOver.
  bool release(vtkMTimeType now);
  /// What was prepared for the properties of `before` is good for those of `now`.
  void carryOver(vtkMTimeType before, vtkMTimeType now);
  bool isHeld() const { return isHeld_; }

  /// Whether views get an earlier output instead of waiting, and which updates are a view's.
  void deferViews(bool defers) { defers_ = defers; }
  void beginView() { ++views_; }
  void endView();
  bool defersView() const { return defers_ && views_ > 0; }
  /// What a view has asked for, and got an earlier output instead.
  const std::optional<Request>& asked() const { return asked_; }
  void ask(Request request) { asked_ = std::move(request); }
  void forgetAsked() { asked_.reset(); }
  /// The output to come replaces the earlier one that views have got.
  void answer();
  /// Whether what is asked for can't be prepared, so that the next update makes it.
  void setInPlace(bool isInPlace) { isInPlace_ = isInPlace; }
  bool isInPlace() const { return isInPlace_; }

  /// The filter's modification time for VTK's executive. `forView`: an earlier output is good enough.
  vtkMTimeType time(vtkMTimeType now, bool forView);

  /// The last output, and its blocks: empty on ranks other than the first, and none before the first update.
  vtkVDIImageData* made() { return made_; }
  const std::optional<Origin>& madeOf() const { return madeOf_; }
  /// Whether the last output is what an update of these blocks is to give.
  bool isMade(const Origin& origin, vtkMTimeType now) const;
  /// Whether it is what an update of its own blocks is to give.
  bool isCurrent(vtkMTimeType now) const { return !hasFailed_ && executed_ == now && !asked_; }
  bool hasFailed() const { return hasFailed_; }
  /// Frees the last output if it is of other blocks. There is no need to have two in memory.
  void dropOther(const Origin& origin);

  /// An update, which counts as failed until `keep`, `finish` or `cancel`. Returns whether the last one
  /// failed, and its time.
  struct Last {
    vtkMTimeType executed;
    bool hasFailed;
  };
  Last begin(vtkMTimeType now);
  void keep(const Last& last);
  void finish(vtkImageData* output, const Origin& origin, vtkMTimeType now);
  void cancel() { hasFailed_ = false; }

  /// Starts to make the output of these blocks on a thread. Collective on the volume's ranks.
  void prepare(std::shared_ptr<Volume> volume, const Origin& origin, vtkMTimeType now,
               Preparation::Make make);
  /// Whether these blocks' output is being prepared, or is there, on all ranks.
  bool isPrepared(const Origin& origin, vtkMultiProcessController* controller) const;
  /// After isPrepared: whether the output is there on a rank.
  bool isPreparationDone(vtkMultiProcessController* controller) const;
  /// Tells the thread to stop; false where none is at work.
  bool giveUp();
  /// Stops it unless it makes the output of these blocks.
  void giveUpOther(const Origin& origin);
  /// Waits for the thread. Collective on the volume's ranks.
  void drop() { preparing_.reset(); }
  /// Waits for the thread, and gives `output` what it made of these blocks; false where it made nothing or
  /// something else. `goesOn` is asked now and then; where it returns false on a rank, this throws
  /// vdi::Error{Cancelled} on all.
  bool take(const Origin& origin, vtkMultiProcessController* controller, vtkImageData* output,
            const std::function<bool(double share)>& goesOn);
  bool preparesOnRanks() const { return preparing_ && preparing_->hasRanks(); }
  int percent() const { return preparing_ ? preparing_->percent() : -1; }
  /// Carries on what the ranks' threads do together.
  void serve(std::chrono::milliseconds most);

 private:
  bool isPreparedHere(const Origin& origin) const;

  bool isHeld_ = false;
  bool defers_ = false;
  int views_ = 0;  // calls of beginView without their endView
  std::optional<Request> asked_;
  vtkTimeStamp askedTime_;  // of the last endView that left asked_, or of its answer
  bool isInPlace_ = false;
  /// After a failure, the data count as newer than any output: left to the executive, rank 0, whose empty
  /// output isn't what was asked for, would try again alone.
  bool hasFailed_ = false;
  vtkTimeStamp retryTime_;
  vtkNew<vtkVDIImageData> made_;  // VTK empties the output before it asks for another one
  std::optional<Origin> madeOf_;
  vtkMTimeType executed_ = 0;  // `now` of the last update
  std::optional<Origin> preparedFor_;
  std::unique_ptr<Preparation> preparing_;  // last member, because its thread uses the others
};

}  // namespace pv

#endif
