// Tests whether a VDI can show its scene truthfully from a viewpoint.
#pragma once

#include <optional>
#include <string>

#include "vdi/core/Box.h"
#include "vdi/core/Camera.h"

namespace vdi {

/// The reason why a VDI shows little or nothing from a viewpoint.
enum class ViewpointIssue {
  SeesNothing,  // the scene, or what V_O saw of it, is outside the picture
  Inside,       // the camera is inside the scene and is not V_O: the part behind the camera is missing
  FarAway,      // the scene is smaller in the picture than farAwayPixels
  FarBeside     // more than farBesideDegrees from V_O: lists are seen from their sides
};

/// Angle between the directions in which V_O and the viewpoint see the scene's centre.
constexpr double farBesideDegrees = 60.0;

/// The largest such angle at which a view counts as one from V_O.
constexpr double besideDegrees = 5.0;

/// Diameter, in the picture, of the sphere around the scene.
constexpr double farAwayPixels = 4.0;

/// The first issue that applies, in the order above; nullopt if none does, and for an empty scene. `bounds`
/// are Vdi::bounds and `original` Vdi::view. This is a cheap test of boxes: the picture may be empty even
/// without an issue.
std::optional<ViewpointIssue> viewpointIssue(const Box& bounds, const View& original, const View& view);

/// The angle, in degrees, between the directions in which `original` and `camera` see the scene's centre.
double degreesBetween(const Box& bounds, const Camera& original, const Camera& camera);

/// The number of lists in a row across the view, at the depth of the scene's centre. It equals V_O's if both
/// views see equal widths, and is smaller in a nearer view. 0 if the centre isn't in front.
double listsAcross(const Box& bounds, const View& original, const View& view);

/// The issue in words, for a warning.
std::string describe(ViewpointIssue issue);

}  // namespace vdi
