#include "vtkVDIPictureRepresentation.h"

#include <vtkActor.h>
#include <vtkAlgorithmOutput.h>
#include <vtkCellArray.h>
#include <vtkFieldData.h>
#include <vtkFloatArray.h>
#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkInformationVector.h>
#include <vtkIntArray.h>
#include <vtkMath.h>
#include <vtkObjectFactory.h>
#include <vtkPVRenderView.h>
#include <vtkPVView.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>
#include <vtkTexture.h>
#include <vtkUnsignedCharArray.h>

#include "VDIPlace.h"
#include "VDIUpdate.h"
#include "vdi/core/Error.h"

vtkStandardNewMacro(vtkVDIPictureRepresentation);

namespace {

constexpr const char* colorsName = "RGBA";
constexpr const char* sizeName = "VDI.pictureSize";

/// Makes the rectangle of a picture with these corners, counterclockwise from the lower left one.
void makeRectangle(const std::array<glm::dvec3, 4>& corners, vtkPolyData* rectangle) {
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  vtkNew<vtkFloatArray> coordinates;
  coordinates->SetName("TextureCoordinates");
  coordinates->SetNumberOfComponents(2);
  for (const glm::dvec3& corner : corners) points->InsertNextPoint(&corner.x);
  coordinates->InsertNextTuple2(0.0, 0.0);
  coordinates->InsertNextTuple2(1.0, 0.0);
  coordinates->InsertNextTuple2(1.0, 1.0);
  coordinates->InsertNextTuple2(0.0, 1.0);
  vtkNew<vtkCellArray> cells;
  cells->InsertNextCell({0, 1, 2, 3});
  rectangle->SetPoints(points);
  rectangle->GetPointData()->SetTCoords(coordinates);
  rectangle->SetPolys(cells);
}

}  // namespace

vtkVDIPictureRepresentation::vtkVDIPictureRepresentation() {
  vtkMath::UninitializeBounds(this->PieceBounds.data());
  this->Texture->SetInputData(this->Image);
  this->Texture->InterpolateOn();
  this->Texture->RepeatOff();
  this->Texture->EdgeClampOn();
  this->Texture->SetColorModeToDirectScalars();
  this->Mapper->ScalarVisibilityOff();
  this->Actor->SetMapper(this->Mapper);
  this->Actor->GetProperty()->LightingOff();
  this->Actor->GetProperty()->SetColor(1.0, 1.0, 1.0);
  this->Actor->ForceTranslucentOn();
  this->Actor->PickableOff();
}

vtkVDIPictureRepresentation::~vtkVDIPictureRepresentation() = default;

void vtkVDIPictureRepresentation::PrintSelf(ostream& os, vtkIndent indent) {
  this->Superclass::PrintSelf(os, indent);
  this->Actor->PrintSelf(os, indent.GetNextIndent());
}

void vtkVDIPictureRepresentation::SetVisibility(bool visible) {
  this->Superclass::SetVisibility(visible);
  this->Actor->SetVisibility(visible);
}

void vtkVDIPictureRepresentation::SetOpacity(double opacity) {
  this->Actor->GetProperty()->SetOpacity(opacity);
}

int vtkVDIPictureRepresentation::FillInputPortInformation(int, vtkInformation* info) {
  info->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkDataObject");
  info->Set(vtkAlgorithm::INPUT_IS_OPTIONAL(), 1);
  return 1;
}

int vtkVDIPictureRepresentation::RequestData(vtkInformation* request, vtkInformationVector** inputs,
                                             vtkInformationVector* outputs) {
  this->Piece->Initialize();
  vtkMath::UninitializeBounds(this->PieceBounds.data());
  if (inputs[0]->GetNumberOfInformationObjects() > 0) this->Pack(vtkDataObject::GetData(inputs[0]));
  this->Piece->Modified();
  return this->Superclass::RequestData(request, inputs, outputs);
}

/// Packs the picture and its rectangle. Packs nothing on ranks without the picture.
void vtkVDIPictureRepresentation::Pack(vtkDataObject* input) {
  auto* image = vtkImageData::SafeDownCast(input);
  if (image == nullptr || image->GetNumberOfPoints() == 0) return;
  auto* colors = vtkUnsignedCharArray::SafeDownCast(image->GetPointData()->GetAbstractArray(colorsName));
  const auto camera = pv::cameraIn(image->GetFieldData());
  const auto box = pv::boxIn(image->GetFieldData());
  if (colors == nullptr || colors->GetNumberOfComponents() != 4 || !camera || !box) return;
  const int* dimensions = image->GetDimensions();
  try {
    makeRectangle(pv::cornersOf(vdi::View(*camera, dimensions[0], dimensions[1]), *box), this->Piece);
  } catch (const vdi::Error& error) {
    vtkErrorMacro(<< error.what());
    return;
  }
  vtkNew<vtkIntArray> size;
  size->SetName(sizeName);
  size->InsertNextValue(dimensions[0]);
  size->InsertNextValue(dimensions[1]);
  this->Piece->GetFieldData()->AddArray(size);
  this->Piece->GetFieldData()->AddArray(colors);
  this->Piece->GetBounds(this->PieceBounds.data());
}

int vtkVDIPictureRepresentation::ProcessViewRequest(vtkInformationRequestKey* request, vtkInformation* in,
                                                    vtkInformation* out) {
  {
    const pv::Update update(this, request);
    if (!this->Superclass::ProcessViewRequest(request, in, out)) return 0;
  }
  if (request == vtkPVView::REQUEST_UPDATE()) {
    vtkPVView::SetPiece(in, this, this->Piece);
    vtkPVRenderView::SetGeometryBounds(in, this, this->PieceBounds.data());
    out->Set(vtkPVRenderView::NEED_ORDERED_COMPOSITING(), 1);
    vtkPVRenderView::SetOrderedCompositingConfiguration(
        in, this, vtkPVRenderView::USE_BOUNDS_FOR_REDISTRIBUTION, this->PieceBounds.data());
  } else if (request == vtkPVView::REQUEST_RENDER()) {
    vtkAlgorithmOutput* port = vtkPVRenderView::GetPieceProducer(in, this);
    if (port != nullptr) this->Draw(port->GetProducer()->GetOutputDataObject(port->GetIndex()));
  }
  return 1;
}

void vtkVDIPictureRepresentation::Draw(vtkDataObject* piece) {
  auto* rectangle = vtkPolyData::SafeDownCast(piece);
  vtkFieldData* fields = rectangle != nullptr ? rectangle->GetFieldData() : nullptr;
  auto* size = fields != nullptr ? vtkIntArray::SafeDownCast(fields->GetAbstractArray(sizeName)) : nullptr;
  auto* colors =
      fields != nullptr ? vtkUnsignedCharArray::SafeDownCast(fields->GetAbstractArray(colorsName)) : nullptr;
  const bool isThere = size != nullptr && colors != nullptr && rectangle->GetNumberOfPoints() == 4;
  this->Mapper->SetInputDataObject(isThere ? rectangle : nullptr);
  this->Actor->SetTexture(isThere ? this->Texture.Get() : nullptr);
  if (!isThere || this->Image->GetPointData()->GetScalars() == colors) return;
  this->Image->SetDimensions(size->GetValue(0), size->GetValue(1), 1);
  this->Image->GetPointData()->SetScalars(colors);
  this->Image->Modified();
}

bool vtkVDIPictureRepresentation::AddToView(vtkView* view) {
  auto* renderView = vtkPVRenderView::SafeDownCast(view);
  if (renderView == nullptr) return false;
  renderView->GetRenderer()->AddActor(this->Actor);
  return this->Superclass::AddToView(view);
}

bool vtkVDIPictureRepresentation::RemoveFromView(vtkView* view) {
  auto* renderView = vtkPVRenderView::SafeDownCast(view);
  if (renderView == nullptr) return false;
  renderView->GetRenderer()->RemoveActor(this->Actor);
  return this->Superclass::RemoveFromView(view);
}
