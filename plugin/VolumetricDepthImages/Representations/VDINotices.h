// The notices and faults that a view shows about its VDIs.
#ifndef VDINotices_h
#define VDINotices_h

#include <vtkNew.h>

#include <functional>
#include <optional>
#include <string>

#include "VDIMessage.h"

class vtkProp;
class vtkRenderer;

namespace vdi {
class View;
enum class ViewpointIssue;
}  // namespace vdi

namespace pv {

/// How much of one VDI a view shows.
struct VDISight {
  bool isShown = false;                      // whether the VDI can be seen at all
  std::optional<vdi::ViewpointIssue> issue;  // of vtkVDIProp::IssueIn
  std::optional<double> angle;               // of vtkVDIProp::AngleIn, degrees
};
/// Returns what the view shows of the prop's VDI; nullopt if the prop isn't a VDI.
using VDISightOf = std::function<std::optional<VDISight>(vtkProp* prop)>;

/// The texts of one VDI. An obstacle hides a problem, and a problem hides a notice.
class VDINotices {
 public:
  vtkVDIMessage* message() { return message_; }
  vtkVDIMessage* angleMessage() { return angleMessage_; }

  /// The reason why the VDI isn't drawn although nothing is wrong with it.
  void setObstacle(const std::string& text) { obstacle_ = text; }
  const std::string& obstacle() const { return obstacle_; }
  /// The description of an error.
  void setProblem(const std::string& text) { problem_ = text; }
  const std::string& problem() const { return problem_; }

  /// Each frame begins without notices.
  void clear();
  void note(const std::string& text, vtkVDIMessage::Place place = vtkVDIMessage::Place::Middle);
  /// Notes what is wrong with the viewpoint of the prop's VDI or with the view, unless another VDI of the
  /// renderer notes it. Angles and cut edges aren't faults: a VDI with all of its scene looks right from all
  /// around. `isFiltered`: the user can make the VDI again.
  void noteViewpoint(vtkRenderer* renderer, const vdi::View& view, vtkProp* prop, const VDISightOf& sightOf,
                     bool isFiltered);
  /// Notes how far the view is turned from the VDI's viewpoint. The VDI with the largest angle notes it for
  /// all VDIs of the renderer.
  void noteAngle(vtkRenderer* renderer, vtkProp* prop, const VDISightOf& sightOf);

  /// Shows the texts, or none.
  void show(bool isVisible);

 private:
  vtkNew<vtkVDIMessage> message_;
  vtkNew<vtkVDIMessage> angleMessage_;
  std::string obstacle_;
  std::string problem_;
  std::string notice_;
  vtkVDIMessage::Place noticePlace_ = vtkVDIMessage::Place::Middle;
  std::string angle_;
};

}  // namespace pv

#endif
