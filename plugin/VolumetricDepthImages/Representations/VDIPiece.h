// A VDI on its way to the process that draws it, in the form in which ParaView delivers it. It is the field
// data of a vtkPolyData with one point, because ParaView sends nothing without points:
//   within a process  the arrays of the VDI's image (VDIImageData.h), shared with it
//   between two       VDI.file: unsigned char [n], a .vdi file
// Instead of these, the piece has
//     VDI.problem: a string, if there is no VDI to show;
//     VDI.isBeingMade: a string, if the VDI is being made.
// It also has
//     VDI.filter: an empty string, if the pipeline has the filter that made the VDI.
#ifndef VDIPiece_h
#define VDIPiece_h

#include <vtkType.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "vdi/core/Vdi.h"

class vtkAbstractArray;
class vtkDataObject;
class vtkFieldData;
class vtkPolyData;

namespace pv {

/// The problem after the VDI's filter or reader has failed, which reports the reason as an error.
constexpr const char* failedUpstream = "No VDI can be shown: its filter or reader has failed.";

/// Prefix of the problem's text while a source waits for a VDI (VDI.waiting).
constexpr const char* noneYet = "No VDI has arrived yet: ";
/// Whether `problem` is one of these two. A view shows them, but doesn't repeat them as errors.
bool isSaidUpstream(const std::string& problem);

/// Empties `piece`, for ranks and clients without a VDI.
void packNothing(vtkPolyData* piece);
/// Makes `piece` carry a problem.
void packProblem(const std::string& text, vtkPolyData* piece);
/// Makes `piece` carry the VDI of `data`, or a problem. `crosses`: the piece leaves the process.
void packVdi(vtkDataObject* data, bool crosses, vtkPolyData* piece);
/// Marks a piece whose VDI a filter of the pipeline can make again.
void markFiltered(vtkPolyData* piece);
bool isFiltered(vtkFieldData* fields);
/// Gets the world bounds, in VTK's order, from a piece's field data. Returns false if it has no VDI with a
/// scene.
bool boundsOf(vtkFieldData* fields, double bounds[6]);
/// The arrays of the VDI in a piece's field data, each with its modification time. Two pieces with the same
/// content have the same VDI.
using PieceContent = std::vector<std::pair<const vtkAbstractArray*, vtkMTimeType>>;
PieceContent contentOf(vtkFieldData* fields);
/// Returns the VDI in a piece's field data; nullopt if there is none, or another rank has it. Any thread may
/// call it. Throws vdi::Error for a VDI that isn't sound, and for a problem.
std::optional<vdi::Vdi> unpackVdi(vtkFieldData* fields);

}  // namespace pv

#endif
