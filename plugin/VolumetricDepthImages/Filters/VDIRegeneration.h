// The choice of a filter's output while a thread may be making the next one.
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

/// A view's request that the filter hasn't answered yet.
struct ViewRequest {
  Load load;
  vdi::Box bounds;  // bounds of all ranks' blocks
};

/// The state between a filter's updates: the last output, what views wait for, and the preparation of the
/// next output. `now` is the modification time of the filter's properties and maps. Only the main thread uses
/// it. Functions with a controller are collective on its ranks.
class Regeneration {
 public:
  /// A held filter keeps its output when properties and maps change.
  void hold();
  /// Returns whether the output is out of date. If so, the filter calls Modified on itself, and then
  /// carryOver.
  bool release(vtkMTimeType now);
  /// Notes that an update has given an earlier output, because it came in the middle of another update.
  /// `release` makes views request the output again.
  void putOff() { isPutOff_ = true; }
  /// Declares that the output prepared for the properties at time `before` is good for those at `now`.
  void carryOver(vtkMTimeType before, vtkMTimeType now);
  bool isHeld() const { return isHeld_; }

  /// While views are deferred, they get an earlier output instead of waiting. An update between beginView and
  /// endView is for a view.
  void deferViews(bool defers) { defers_ = defers; }
  void beginView() { ++views_; }
  void endView();
  bool defersView() const { return defers_ && views_ > 0; }
  /// The request of a view that got an earlier output instead.
  const std::optional<ViewRequest>& asked() const { return asked_; }
  void ask(ViewRequest request) { asked_ = std::move(request); }
  void forgetAsked() { asked_.reset(); }
  /// The next output answers the request, and replaces the earlier one that views have got.
  void answer();
  /// True if no thread can prepare the requested output, so that the next update makes it.
  void setInPlace(bool isInPlace) { isInPlace_ = isInPlace; }
  bool isInPlace() const { return isInPlace_; }

  /// The filter's modification time for VTK's executive. With `forView`, an earlier output is good enough.
  vtkMTimeType time(vtkMTimeType now, bool forView);

  /// The last output, and the origin of its blocks. The output is empty on ranks other than the first. Both
  /// are empty before the first update.
  vtkVDIImageData* made() { return made_; }
  const std::optional<Origin>& madeOf() const { return madeOf_; }
  /// Whether an update with these blocks would give the last output again.
  bool isMade(const Origin& origin, vtkMTimeType now) const;
  /// Whether an update with the last output's own blocks would give it again.
  bool isCurrent(vtkMTimeType now) const { return !hasFailed_ && executed_ == now && !asked_; }
  bool hasFailed() const { return hasFailed_; }
  /// Frees the last output if it shows other blocks, so that memory never holds two.
  void dropOther(const Origin& origin);

  /// An update counts as failed between `begin` and `keep`, `finish` or `cancel`. `begin` returns whether the
  /// last update failed, and its time.
  struct Last {
    vtkMTimeType executed;
    bool hasFailed;
  };
  Last begin(vtkMTimeType now);
  void keep(const Last& last);
  void finish(vtkImageData* output, const Origin& origin, vtkMTimeType now);
  void cancel() { hasFailed_ = false; }

  /// Starts a thread that makes the output for these blocks. Collective on the volume's ranks.
  void prepare(std::shared_ptr<Volume> volume, const Origin& origin, vtkMTimeType now,
               Preparation::Make make);
  /// Whether, on all ranks, the output for these blocks is being prepared or is ready.
  bool isPrepared(const Origin& origin, vtkMultiProcessController* controller) const;
  /// Whether the preparation has ended on any rank. Call it after isPrepared.
  bool isPreparationDone(vtkMultiProcessController* controller) const;
  /// Tells the thread to stop. Returns false if no thread is at work.
  bool giveUp();
  /// Tells the thread to stop unless it makes the output for these blocks.
  void giveUpOther(const Origin& origin);
  /// Waits for the thread, and drops its output. Collective on the volume's ranks.
  void drop() { preparing_.reset(); }
  /// Waits for the thread, and moves its output for these blocks to `output`. Returns false if the thread
  /// made nothing or something else. `take` calls `goesOn` now and then; if it returns false on a rank,
  /// `take` throws vdi::Error{Cancelled} on all ranks.
  bool take(const Origin& origin, vtkMultiProcessController* controller, vtkImageData* output,
            const std::function<bool(double share)>& goesOn);
  bool preparesOnRanks() const { return preparing_ && preparing_->hasRanks(); }
  int percent() const { return preparing_ ? preparing_->percent() : -1; }
  /// Carries out the collective operations of the ranks' threads.
  void serve(std::chrono::milliseconds most);

 private:
  bool isPreparedHere(const Origin& origin) const;

  bool isHeld_ = false;
  bool isPutOff_ = false;
  bool defers_ = false;
  int views_ = 0;  // number of beginView calls that lack their endView
  std::optional<ViewRequest> asked_;
  /// Time of the last endView that left asked_, of the answer to asked_, or of the release after putOff.
  vtkTimeStamp askedTime_;
  bool isInPlace_ = false;
  /// After a failure, the data count as newer than any output. Otherwise rank 0 would try again alone,
  /// because VTK's executive doesn't accept rank 0's empty output.
  bool hasFailed_ = false;
  vtkTimeStamp retryTime_;
  vtkNew<vtkVDIImageData> made_;  // a copy, because VTK empties the output before it asks for another one
  std::optional<Origin> madeOf_;
  vtkMTimeType executed_ = 0;  // `now` of the last update
  std::optional<Origin> preparedFor_;
  std::unique_ptr<Preparation> preparing_;  // last member, because its thread uses the others
};

}  // namespace pv

#endif
