// A VDI as standard VTK data: an image of the flat picture, with the VDI in its field data. Writers,
// extractors, Live and pipelines then work as with any image.
//   point data  RGBA               unsigned char [h][w], 4 components, straight colour (VTK blends with
//                                  alpha), row 0 at the bottom; w, h: the picture's size
//               SupersegmentCount  unsigned int [h][w]
//               Depth              float [h][w], from RenderVDI only
//   field data  VDI.size           unsigned int [2]: columns and rows of lists, with the margin
//               VDI.margin         unsigned int [2]: vdi::Vdi::margin
//               VDI.offsets        unsigned int [lists + 1]
//               VDI.supersegments  full precision: float [n][6]: front, back, red, green, blue, opacity
//               VDI.codes          compact: unsigned int [n][2], vdi::CompactSupersegment
//               VDI.depthCode      compact: float [2], vdi::DepthCode
//               VDI.camera         double [12]: position, focal point, view-up, view angle, parallel
//                                  projection, scale; pictures without a VDI have it, too (VDIPlace.h)
//               VDI.bounds         double [6] in VTK's order, xmin, xmax, ymin, ...; pictures have it, too
//               VDI.parameters     double [4]: N_S, sample step, time, time step
//               (the array's name) double [n]: some of the values that the VDI shows (VDIValues.h)
//               VDI.isBeingMade    string [1]: only views get this image, while the VDI is being made
//               VDI.waiting        string [1]: the reason why there is no VDI yet; the image has no points
//               VDI.coloring       string [1]: vdi::Coloring, as vdi::io::metadataText; absent if unknown
#ifndef VDIImageData_h
#define VDIImageData_h

#include <vtkSmartPointer.h>

#include <optional>
#include <string>

#include "vdi/core/Box.h"
#include "vdi/core/Camera.h"
#include "vdi/core/Coloring.h"
#include "vdi/core/Image.h"
#include "vdi/core/Vdi.h"

class vtkDataObject;
class vtkFieldData;
class vtkImageData;
class vtkInformation;
class vtkUnsignedCharArray;

namespace pv {

/// For RequestInformation: announces a picture with RGBA and this whole extent. A rank without a picture
/// announces an empty extent, so that the pipeline doesn't ask it for more again and again.
void announcePicture(vtkInformation* output, const int (&extent)[6]);
/// Makes `image` w x h x 1 with RGBA and Depth. `picture` has straight colours.
void setPicture(vtkImageData* image, const vdi::ImageBytes& picture);
/// Makes `image` w x h x 1 with RGBA, and Depth if `withDepth`.
void setPicture(vtkImageData* image, const vdi::Image& picture, bool withDepth);
/// The picture that the image's RGBA hold, without depth. Throws vdi::Error{InvalidArgument} where it has
/// none.
vdi::Image pictureIn(vtkImageData* image);
/// Stores the VDI and its flat picture in `image`.
void setVdi(vtkImageData* image, const vdi::Vdi& vdi);
/// Stores the VDI and `flat`, its flat picture that vdi::flatten has already made, in `image`.
void setVdi(vtkImageData* image, const vdi::Vdi& vdi, const vdi::Image& flat);
/// Marks the image, whose VDI is being made. Bounds and camera are those of the VDI to come.
void setBeingMade(vtkImageData* image, const vdi::Camera& camera, const vdi::Box& bounds);
bool isBeingMade(vtkFieldData* fields);
/// Gives an image without points the reason why there is no VDI yet.
void setWaiting(vtkImageData* image, const std::string& why);
/// The reason that setWaiting gave; empty if there is none.
std::string waitingIn(vtkFieldData* fields);
/// The bytes of the VDI's .vdi file. Any thread may call it.
vtkSmartPointer<vtkUnsignedCharArray> fileOf(const vdi::Vdi& vdi);
/// The error for an input without a VDI.
inline constexpr const char* noVdi =
    "the input has no VDI; connect a VolumetricDepthImage filter or a VDI reader";
/// Whether the image carries a VDI, sound or not.
bool hasVdi(vtkImageData* image);
/// The meaning of the colours of the VDI in the field data; nullopt if it is unknown or not sound.
std::optional<vdi::Coloring> coloringOf(vtkFieldData* fields);
/// Returns false if the data object carries no VDI, as on ranks other than the root. Throws
/// vdi::Error{Format} for a VDI that isn't sound.
bool getVdi(vtkDataObject* data, vdi::Vdi& vdi);
/// Reads the VDI from an image's field data. Returns false if they hold none, and throws
/// vdi::Error{Format} for one that isn't sound. Any thread may call it: it makes no VTK object.
bool getVdi(vtkFieldData* fields, vdi::Vdi& vdi);

}  // namespace pv

#endif
