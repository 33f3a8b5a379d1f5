#include "VDIRegeneration.h"

#include <vtkImageData.h>

#include <algorithm>
#include <utility>

#include "VDISession.h"
#include "vdi/core/Error.h"

namespace pv {

void Regeneration::hold() {
  isHeld_ = true;
  this->giveUp();
}

bool Regeneration::release(vtkMTimeType now) {
  isHeld_ = false;
  if (std::exchange(isPutOff_, false)) askedTime_.Modified();
  return executed_ != now || asked_.has_value();
}

void Regeneration::carryOver(vtkMTimeType before, vtkMTimeType now) {
  if (preparing_ && preparing_->time() == before) preparing_->setTime(now);
}

void Regeneration::endView() {
  --views_;
  if (asked_) askedTime_.Modified();
}

void Regeneration::answer() {
  if (!asked_) return;
  asked_.reset();
  askedTime_.Modified();  // views haven't seen the output that replaces the earlier one
}

vtkMTimeType Regeneration::time(vtkMTimeType now, bool forView) {
  // Only views may take an earlier output, until it is replaced.
  const bool isGoodEnough = asked_ && forView;
  const vtkMTimeType asked = isGoodEnough ? 0 : askedTime_.GetMTime();
  if (isHeld_ && (isGoodEnough || !asked_)) return std::max(executed_, asked);
  if (hasFailed_) retryTime_.Modified();
  return std::max({now, asked, retryTime_.GetMTime()});
}

bool Regeneration::isMade(const Origin& origin, vtkMTimeType now) const {
  const bool keepsProperties = isHeld_ && !asked_;
  return madeOf_ == origin && !hasFailed_ && (keepsProperties || executed_ == now);
}

void Regeneration::dropOther(const Origin& origin) {
  if (madeOf_ == origin) return;
  made_->Initialize();
  madeOf_.reset();
}

Regeneration::Last Regeneration::begin(vtkMTimeType now) {
  return {std::exchange(executed_, now), std::exchange(hasFailed_, true)};
}

void Regeneration::keep(const Last& last) {
  executed_ = last.executed;
  hasFailed_ = false;
}

void Regeneration::finish(vtkImageData* output, const Origin& origin, vtkMTimeType now) {
  made_->ShallowCopy(output);
  madeOf_ = origin;
  hasFailed_ = false;
  executed_ = now;
}

void Regeneration::prepare(std::shared_ptr<Volume> volume, const Origin& origin, vtkMTimeType now,
                           Preparation::Make make) {
  preparedFor_ = origin;
  preparing_ = std::make_unique<Preparation>(std::move(volume), now, std::move(make));
}

bool Regeneration::isPreparedHere(const Origin& origin) const {
  return preparing_ && !preparing_->isGivenUp() && preparing_->time() == executed_ && preparedFor_ == origin;
}

bool Regeneration::isPrepared(const Origin& origin, vtkMultiProcessController* controller) const {
  return onAllRanks(controller, this->isPreparedHere(origin));
}

bool Regeneration::isPreparationDone(vtkMultiProcessController* controller) const {
  return !onAllRanks(controller, !preparing_->isDone());
}

bool Regeneration::giveUp() {
  if (!preparing_ || preparing_->isDone()) return false;
  preparing_->giveUp();
  return true;
}

void Regeneration::giveUpOther(const Origin& origin) {
  if (!(preparedFor_ == origin)) this->giveUp();
}

bool Regeneration::take(const Origin& origin, vtkMultiProcessController* controller, vtkImageData* output,
                        const std::function<bool(double share)>& goesOn) {
  if (!preparing_) return false;
  if (!this->isPrepared(origin, controller)) {
    this->drop();
    return false;
  }
  const Preparation::End end = preparing_->wait([&] {
    if (!goesOn(preparing_->share())) preparing_->giveUp();
  });
  const bool isGood = end == Preparation::End::Good;
  if (isGood) output->ShallowCopy(preparing_->output());
  this->drop();
  if (end == Preparation::End::GivenUp) throw vdi::Error(vdi::ErrorCode::Cancelled, "it was aborted");
  return isGood;
}

void Regeneration::serve(std::chrono::milliseconds most) {
  if (this->preparesOnRanks() && !preparing_->isDone()) preparing_->serve(most);
}

}  // namespace pv
