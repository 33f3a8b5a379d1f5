// A VDI as standard VTK data: an image with the flat picture, and the VDI beside it in field data. Writers,
// extractors, Live and pipelines then work as with any image.
//   point data  RGBA               unsigned char [h][w], 4 components, straight colour (VTK blends with
//                                  alpha), row 0 at the bottom; w, h: the picture's
//               SupersegmentCount  unsigned int [h][w]
//               Depth              float [h][w], of RenderVDI only
//   field data  VDI.size           unsigned int [2]: columns and rows of lists, the margin's included
//               VDI.margin         unsigned int [2]: vdi::Vdi::margin
//               VDI.offsets        unsigned int [lists + 1]
//               VDI.supersegments  full precision: float [n][6]: front, back, red, green, blue, opacity
//               VDI.codes          compact: unsigned int [n][2], vdi::CompactSupersegment
//               VDI.depthCode      compact: float [2], vdi::DepthCode
//               VDI.camera         double [12]: position, focal point, view-up, view angle, parallel
//                                  projection, scale; of pictures without a VDI, too (VDIPlace.h)
//               VDI.bounds         double [6] as VTK: xmin, xmax, ymin, ...; likewise
//               VDI.parameters     double [4]: N_S, sample step, time, time step
//               (the array's name) double [n]: some of the values shown (VDIValues.h)
//               VDI.isBeingMade    string [1]: there is no VDI yet; of what views get meanwhile alone
//               VDI.waiting        string [1]: why there is no VDI so far; the image has no points then
//               VDI.coloring       string [1]: vdi::Coloring, as vdi::io::metadataText; absent where unknown
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

/// For RequestInformation: tells the pipeline of a picture with RGBA and this whole extent. Ranks without a
/// picture announce an empty one, which keeps the pipeline from asking them for more again and again.
void announcePicture(vtkInformation* output, const int (&extent)[6]);
/// Makes `image` w x h x 1 with RGBA and Depth. `picture` is straight.
void setPicture(vtkImageData* image, const vdi::ImageBytes& picture);
/// Makes `image` w x h x 1 with RGBA, and Depth if `withDepth`.
void setPicture(vtkImageData* image, const vdi::Image& picture, bool withDepth);
/// The flat picture of the VDI and the VDI itself.
void setVdi(vtkImageData* image, const vdi::Vdi& vdi);
/// The same, of a flat picture that's there already (vdi::flatten).
void setVdi(vtkImageData* image, const vdi::Vdi& vdi, const vdi::Image& flat);
/// Says, and tells of field data, that there's no VDI because it is being made. Bounds and camera are those
/// that it will have.
void setBeingMade(vtkImageData* image, const vdi::Camera& camera, const vdi::Box& bounds);
bool isBeingMade(vtkFieldData* fields);
/// Says of an image without points why there's no VDI so far.
void setWaiting(vtkImageData* image, const std::string& why);
/// That reason; empty: none is given.
std::string waitingIn(vtkFieldData* fields);
/// The bytes of its .vdi file. From any thread.
vtkSmartPointer<vtkUnsignedCharArray> fileOf(const vdi::Vdi& vdi);
/// Whether the image carries one, sound or not.
bool hasVdi(vtkImageData* image);
/// What the colours of the VDI mean that the field data carry; nothing where that is unknown or not sound.
std::optional<vdi::Coloring> coloringOf(vtkFieldData* fields);
/// False if the data object carries no VDI (what a rank other than the root has). Throws vdi::Error{Format}
/// for one that isn't sound.
bool getVdi(vtkDataObject* data, vdi::Vdi& vdi);
/// The same of an image's field data. From any thread: makes no VTK object.
bool getVdi(vtkFieldData* fields, vdi::Vdi& vdi);

}  // namespace pv

#endif
