#include "VDIBuffers.h"

#include <vtkDataObject.h>
#include <vtkFieldData.h>

#include <chrono>
#include <utility>

#include "VDIPiece.h"
#include "VDIRetire.h"
#include "VDISession.h"
#include "vdi/core/Error.h"
#include "vdi/core/Ready.h"
#include "vdi/core/Thinning.h"

namespace pv {

namespace {

using Clock = std::chrono::steady_clock;

/// The lists across a thinned VDI. Rough pictures on a CPU are hardly larger. The second level serves nearer
/// views, which show only some of the lists.
constexpr std::array<int, VDIBuffers::thinLevels> thinWidths{160, 320};

}  // namespace

/// Views at rest don't use the program of moving ones, which would be compiled at the first movement.
void VDIBuffers::Renderers::compileForMovement() {
  if (compiling.valid()) return;
  compiling = std::async(std::launch::async,
                         [renderer = whole.get()] { renderer->compile(vdi::Reconstruction::Smooth); });
}

bool VDIBuffers::Renderers::areBusy() const {
  return compiling.valid() && !vdi::isReady(compiling);
}

VDIBuffers::~VDIBuffers() {
  this->clear();
}

/// A load waits for the device, which may be making a VDI for seconds. The window doesn't wait for either.
void VDIBuffers::abandonRenderers() {
  auto abandoned = std::make_shared<Abandoned>();
  abandoned->renderers = std::exchange(renderers_, std::make_shared<Renderers>());
  abandoned->loading = std::exchange(loading_, nullptr);
  abandoned->job = std::exchange(job_, {});
  if (abandoned->job.valid() || abandoned->renderers->areBusy()) pv::retire(std::move(abandoned));
}

void VDIBuffers::clear() {
  waiting_ = nullptr;
  newest_.clear();
  still_.drop();
  this->abandonRenderers();
  hasVdi_ = false;
  isEmpty_ = false;
  ++version_;
}

void VDIBuffers::load(vtkDataObject* piece) {
  // While a VDI is being made, the filter gives the last one again, in the same arrays. The next VDI comes
  // in the same data object, but in other arrays.
  PieceContent content = contentOf(piece->GetFieldData());
  if (!content.empty() && content == newest_) return;
  newest_ = std::move(content);
  waiting_ = vtkSmartPointer<vtkFieldData>::New();
  waiting_->ShallowCopy(piece->GetFieldData());
  if (!job_.valid()) this->startNext();
}

void VDIBuffers::startNext() {
  loading_ = std::exchange(waiting_, nullptr);
  if (loading_ == nullptr) return;
  vtkFieldData* const fields = loading_;
  job_ =
      std::async(std::launch::async, [fields, renderers = renderers_] { return loaded(fields, *renderers); });
}

VDIBuffers::Loaded VDIBuffers::loaded(vtkFieldData* fields, Renderers& renderers) {
  Loaded result;
  std::optional<vdi::Vdi> vdi = pv::unpackVdi(fields);
  if (!vdi) return result;
  result.isEmpty = vdi->supersegmentCount() == 0;
  if (result.isEmpty) return result;
  result.hasVdi = true;
  pv::boundsOf(fields, result.bounds.data());
  result.viewpoint = vdi->view();
  if (!renderers.whole) {
    const std::shared_ptr<vdi::gpu::Device> device = pv::sharedDevice(0);
    renderers.whole = std::make_unique<vdi::VdiRenderer>(device);
    renderers.isOnCpu = device->isCpu();
    if (renderers.isOnCpu)
      for (auto& thin : renderers.thins) thin = std::make_unique<vdi::VdiRenderer>(device);
  }
  for (std::size_t level = 0; renderers.isOnCpu && level < thinLevels; ++level)
    result.thins[level] = loadThin(*vdi, thinWidths[level], renderers.thins[level]);
  try {
    renderers.whole->prepareVdi(*vdi);
  } catch (const vdi::Error& error) {
    if (error.code() != vdi::ErrorCode::OutOfMemory) throw;
    result.tooLarge = std::move(vdi);
  }
  return result;
}

/// Loads a VDI of about `width` lists in a row; returns no lists if the whole VDI has hardly more.
VDIBuffers::Thin VDIBuffers::loadThin(const vdi::Vdi& vdi, int width,
                                      std::unique_ptr<vdi::VdiRenderer>& renderer) {
  const int factor = vdi.width / width;
  if (factor < 2) return {};
  const vdi::Vdi thin = vdi::thinned(vdi, factor);
  if (thin.supersegmentCount() == 0) return {};
  renderer->prepareVdi(thin);
  return {thin.listCount(), static_cast<double>(thin.width) / vdi.width};
}

void VDIBuffers::takeOne() {
  still_.drop();
  ++version_;
  isEmpty_ = false;
  try {
    const Loaded result = job_.get();
    hasVdi_ = result.hasVdi;
    isEmpty_ = result.isEmpty;
    bounds_ = result.bounds;
    viewpoint_ = result.viewpoint;
    thins_ = result.thins;
    if (result.tooLarge) {
      renderers_->whole->setVdi(*result.tooLarge);
    } else if (hasVdi_) {
      renderers_->whole->showPrepared();
    }
    if (hasVdi_) renderers_->compileForMovement();
    for (std::size_t level = 0; level < thinLevels; ++level) {
      if (thins_[level].lists > 0) renderers_->thins[level]->showPrepared();
    }
  } catch (const vdi::Error& error) {
    const bool vdiIsAtFault =
        error.code() == vdi::ErrorCode::Format || error.code() == vdi::ErrorCode::InvalidArgument;
    if (!vdiIsAtFault) this->abandonRenderers();
    this->continueAfterFailure();
    throw;
  } catch (...) {
    this->continueAfterFailure();
    throw;
  }
  this->startNext();
}

void VDIBuffers::continueAfterFailure() {
  hasVdi_ = false;
  if (waiting_ == nullptr) newest_.clear();
  this->startNext();
}

bool VDIBuffers::hasLoaded() const {
  return vdi::isReady(job_);
}

bool VDIBuffers::take(Clock::duration wait) {
  const Clock::time_point end = Clock::now() + wait;
  bool hasTaken = false;
  while (job_.valid()) {
    if (job_.wait_until(end) != std::future_status::ready) break;
    const bool isNewest = waiting_ == nullptr;
    try {
      this->takeOne();
    } catch (...) {
      if (isNewest) throw;  // a newer piece replaces the faulty one
    }
    hasTaken = true;
  }
  return hasTaken;
}

}  // namespace pv
