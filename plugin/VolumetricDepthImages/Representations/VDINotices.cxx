#include "VDINotices.h"

#include <vtkMath.h>
#include <vtkPropCollection.h>
#include <vtkRenderer.h>

#include <cmath>
#include <limits>
#include <optional>

#include "VDIView.h"
#include "vdi/core/Box.h"
#include "vdi/core/Viewpoint.h"

namespace pv {

namespace {

/// Calls `visit` for the renderer's props until it returns false; returns whether it never did.
template <typename Visit>
bool visitProps(vtkRenderer* renderer, Visit visit) {
  vtkPropCollection* props = renderer->GetViewProps();
  vtkCollectionSimpleIterator at;
  props->InitTraversal(at);
  while (vtkProp* prop = props->GetNextProp(at)) {
    if (!visit(prop)) return false;
  }
  return true;
}

/// The reason why the view shows little or nothing of a prop; nullopt if it shows the prop.
std::optional<vdi::ViewpointIssue> issueOf(vtkProp* prop, const vdi::View& view) {
  const double* bounds = prop->GetBounds();
  if (bounds == nullptr || vtkMath::AreBoundsInitialized(bounds) == 0)
    return vdi::ViewpointIssue::SeesNothing;
  vdi::Box box = boxOf(bounds);
  constexpr double beyond = std::numeric_limits<double>::max();
  for (int axis = 0; axis < 3; ++axis) {  // so that a flat object's box isn't empty
    box.lo[axis] = std::nextafter(box.lo[axis], -beyond);
    box.hi[axis] = std::nextafter(box.hi[axis], beyond);
  }
  return vdi::viewpointIssue(box, view, view);
}

/// Whether the view shows nothing but this VDI.
bool isBlank(vtkRenderer* renderer, const vdi::View& view, vtkProp* own, const VDISightOf& sightOf) {
  return visitProps(renderer, [&](vtkProp* prop) {
    if (prop == own || prop->GetVisibility() == 0 || !prop->GetUseBounds()) return true;
    const std::optional<VDISight> other = sightOf(prop);
    if (other && !other->isShown) return true;
    const std::optional<vdi::ViewpointIssue> issue = other ? other->issue : issueOf(prop, view);
    return issue == vdi::ViewpointIssue::SeesNothing || issue == vdi::ViewpointIssue::FarAway;
  });
}

/// Whether no VDI before this one has the same issue.
bool isFirst(vtkRenderer* renderer, vtkProp* own, const VDISightOf& sightOf, vdi::ViewpointIssue issue) {
  bool isBefore = true;
  return visitProps(renderer, [&](vtkProp* prop) {
    isBefore = isBefore && prop != own;
    const std::optional<VDISight> other = isBefore ? sightOf(prop) : std::nullopt;
    return !other || other->issue != issue;
  });
}

}  // namespace

void VDINotices::clear() {
  notice_.clear();
  angle_.clear();
}

void VDINotices::note(const std::string& text, vtkVDIMessage::Place place) {
  notice_ = text;
  noticePlace_ = place;
}

void VDINotices::noteViewpoint(vtkRenderer* renderer, const vdi::View& view, vtkProp* prop,
                               const VDISightOf& sightOf, bool isFiltered) {
  const std::optional<vdi::ViewpointIssue> issue = sightOf(prop).value_or(VDISight()).issue;
  if (!issue || !isFirst(renderer, prop, sightOf, *issue)) return;
  switch (*issue) {
    case vdi::ViewpointIssue::SeesNothing:
      if (isBlank(renderer, view, prop, sightOf)) this->note("The VDI is out of sight: press Reset Camera.");
      break;
    case vdi::ViewpointIssue::FarAway:
      if (isBlank(renderer, view, prop, sightOf))
        this->note("The VDI is too small to be seen from here: press Reset Camera.");
      break;
    case vdi::ViewpointIssue::Inside:
      this->note(isFiltered ? "From inside, this VDI is rough: press Regenerate From This View."
                            : "From inside, this VDI is rough: press Reset Camera.",
                 vtkVDIMessage::Place::Top);
      break;
    case vdi::ViewpointIssue::FarBeside:
      break;
  }
}

void VDINotices::noteAngle(vtkRenderer* renderer, vtkProp* prop, const VDISightOf& sightOf) {
  const std::optional<double> own = sightOf(prop).value_or(VDISight()).angle;
  if (!own || *own <= vdi::besideDegrees) return;
  bool isAlone = true;
  bool isBefore = true;  // among VDIs at the same angle, the renderer's first one shows it
  const bool isFarthest = visitProps(renderer, [&](vtkProp* each) {
    isBefore = isBefore && each != prop;
    const std::optional<VDISight> other = each != prop ? sightOf(each) : std::nullopt;
    const std::optional<double> angle = other ? other->angle : std::nullopt;
    isAlone = isAlone && !angle;
    return !angle || (*angle <= *own && !(*angle == *own && isBefore));
  });
  if (!isFarthest) return;
  const std::string degrees = std::to_string(std::lround(*own)) + "\u00b0";
  angle_ =
      isAlone ? degrees + " from the VDI's viewpoint" : "up to " + degrees + " from the VDIs' viewpoints";
}

void VDINotices::show(bool isVisible) {
  const std::string& fault = obstacle_.empty() ? problem_ : obstacle_;
  message_->Show(isVisible ? (fault.empty() ? notice_ : fault) : std::string(),
                 fault.empty() ? noticePlace_ : vtkVDIMessage::Place::Middle);
  angleMessage_->Show(isVisible ? angle_ : std::string(), vtkVDIMessage::Place::Bottom);
}

}  // namespace pv
