// Whether a VDI has anything true to show from a viewpoint.
#pragma once

#include <optional>
#include <string>

#include "vdi/core/Box.h"
#include "vdi/core/Camera.h"

namespace vdi {

/// What's to be said of a viewpoint of a VDI.
enum class ViewpointIssue {
  SeesNothing,  // the scene, or what V_O saw of it, is outside of the picture
  Inside,       // the camera is inside the scene, and isn't V_O: what's behind it is missing
  FarAway,      // the scene is smaller in the picture than farAwayPixels
  FarBeside     // more than farBesideDegrees from where the VDI was made: lists are seen from their sides
};

/// Between the directions in which the scene's centre is seen from V_O and from the viewpoint.
constexpr double farBesideDegrees = 60.0;

/// Of the sphere around the scene: its diameter in the picture.
constexpr double farAwayPixels = 4.0;

/// The first that applies, in that order; nullopt where nothing does, and for an empty scene. `bounds` are
/// Vdi::bounds and `original` Vdi::view. A cheap test of boxes: where it says nothing, the picture may still
/// be empty.
std::optional<ViewpointIssue> viewpointIssue(const Box& bounds, const View& original, const View& view);

/// By how many degrees the directions differ in which `original` and `camera` see the scene's centre.
double degreesBetween(const Box& bounds, const Camera& original, const Camera& camera);

/// In words for a warning.
std::string describe(ViewpointIssue issue);

}  // namespace vdi
