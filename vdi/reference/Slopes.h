// The slopes of supersegments' faces, for Reconstruction::Sheared. The shaders' twin is shaders/slopes.glsl.
#pragma once

#include <cstdint>
#include <vector>

#include "vdi/core/BoxFaces.h"
#include "vdi/core/Camera.h"
#include "vdi/core/Vdi.h"

namespace vdi::reference {

/// Change of depth of a supersegment's front and back from one list to the next in x and in y, in units of
/// `SlopeUnit`. 0 in both: the supersegment ends at the same depth all over its pixel. onFace in both: a list
/// begins or ends there on a face of the box, and reaches to that face all over its pixel.
struct Slopes {
  static constexpr std::int8_t onFace = -128;

  std::int8_t frontX = 0;
  std::int8_t frontY = 0;
  std::int8_t backX = 0;
  std::int8_t backY = 0;
  bool operator==(const Slopes&) const = default;
  bool frontIsOnFace() const { return frontX == onFace && frontY == onFace; }
  bool backIsOnFace() const { return backX == onFace && backY == onFace; }
};

/// Lengths in V_O's view, at the middle of the VDI's depths.
struct SlopeUnit {
  float footprint = 0.0F;  // size of a pixel
  float unit = 0.0F;       // depth per list at a slope of 1
};
SlopeUnit slopeUnitOf(const View& original, float nearest, float farthest);

/// The faces on which lists begin and end.
struct ListBox {
  BoxFaces faces;
  FaceTolerance tolerance;
};
ListBox listBoxOf(const Vdi& vdi, float farthest);

/// The slopes of all supersegments, [lists.segments.size()]. For each of the four lists beside a list:
///   1. A run, supersegments that touch each other, belongs to the neighbour's run that it overlaps most, or
///      that is nearest within renderMaxSlope footprints.
///   2. A face in the front half of its run's optical depth continues where the neighbour's run has the same
///      optical depth in front; another face, where it has the same behind. A face without such a place
///      within renderMaxSlope footprints has no slope towards that neighbour.
///   3. The slope along an axis is the mean of both neighbours', or that of one if the other has none.
/// Slopes fade out for material whose opacity over a footprint is below twice renderLeastOpacity: haze has no
/// faces.
///
/// A list's first front and last back are on a face if the list's ray enters or leaves the box there.
std::vector<Slopes> slopesOf(const SupersegmentLists& lists, const View& original, const SlopeUnit& unit,
                             const ListBox& box);

}  // namespace vdi::reference
