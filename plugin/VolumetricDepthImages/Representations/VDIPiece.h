// A VDI on its way to where it is drawn: what ParaView's delivery carries between processes. Field data of a
// vtkPolyData with one point, for without points nothing is sent:
//   within a process  the arrays of the VDI's image (VDIImageData.h), shared with it
//   between two       VDI.file: unsigned char [n], a .vdi file
// and VDI.problem: a string, instead of either where there's no VDI to show;
//     VDI.isBeingMade: likewise, where it's being made;
//     VDI.filter: an empty string, where the pipeline has the filter that has made it.
#ifndef VDIPiece_h
#define VDIPiece_h

#include <optional>
#include <string>

#include "vdi/core/Vdi.h"

class vtkDataObject;
class vtkFieldData;
class vtkPolyData;

namespace pv {

/// The problem where the VDI's filter or reader has failed, which says why as an error.
constexpr const char* failedUpstream = "There is no VDI to show: what makes it has failed.";

/// How the problem begins where a source waits for a VDI (VDI.waiting).
constexpr const char* noneYet = "There is no VDI to show yet: ";
/// Whether it's one of these two, which a view shows and doesn't repeat as an error.
bool isSaidUpstream(const std::string& problem);

/// Makes `piece` nothing, as ranks and clients without a VDI have it.
void packNothing(vtkPolyData* piece);
/// Makes `piece` a problem.
void packProblem(const std::string& text, vtkPolyData* piece);
/// Makes `piece` the VDI of `data`, or a problem. `crosses`: it leaves the process.
void packVdi(vtkDataObject* data, bool crosses, vtkPolyData* piece);
/// Says, and tells of a piece's field data, that the VDI can be made anew: by a filter of the pipeline.
void markFiltered(vtkPolyData* piece);
bool isFiltered(vtkFieldData* fields);
/// World bounds as VTK has them, of a piece's field data, where it has a VDI with a scene in it.
bool boundsOf(vtkFieldData* fields, double bounds[6]);
/// Of a piece's field data; from any thread. nullopt where it's another rank's VDI, or none. Throws
/// vdi::Error for one that isn't sound, and for a problem.
std::optional<vdi::Vdi> unpackVdi(vtkFieldData* fields);

}  // namespace pv

#endif
