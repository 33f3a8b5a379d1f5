#include "vtkVDIRenderer.h"

#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkInformationVector.h>
#include <vtkObjectFactory.h>
#include <vtkPointData.h>
#include <vtkStreamingDemandDrivenPipeline.h>

#include <optional>
#include <utility>

#include "VDIImageData.h"
#include "VDISession.h"
#include "vdi/core/Error.h"
#include "vdi/core/Viewpoint.h"
#include "vdi/pipeline/VdiRenderer.h"

vtkStandardNewMacro(vtkVDIRenderer);

struct vtkVDIRenderer::Internals {
  std::unique_ptr<vdi::VdiRenderer> Renderer;  // null before the first VDI
  // the input whose VDI the renderer has; compared, never followed
  vtkDataObject* Uploaded = nullptr;
  vtkMTimeType UploadedTime = 0;
  vtkDataObject* Other = nullptr;     // the last reported input without a VDI; compared, never followed
  std::optional<vdi::View> Original;  // the VDI's viewpoint, with all its lists
  vdi::Box Bounds;
  std::optional<vdi::ViewpointIssue> Warned;  // the issue of the last picture
  int Width = 0;
  int Height = 0;
};

vtkVDIRenderer::vtkVDIRenderer() : Internal(new Internals) {}

vtkVDIRenderer::~vtkVDIRenderer() = default;

void vtkVDIRenderer::AddClippingPlane(double originX, double originY, double originZ, double normalX,
                                      double normalY, double normalZ) {
  this->ClippingPlanes.push_back({originX, originY, originZ, normalX, normalY, normalZ});
  this->Modified();
}

void vtkVDIRenderer::RemoveAllClippingPlanes() {
  if (this->ClippingPlanes.empty()) return;
  this->ClippingPlanes.clear();
  this->Modified();
}

void vtkVDIRenderer::PrintSelf(ostream& os, vtkIndent indent) {
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Resolution: " << this->Resolution[0] << " x " << this->Resolution[1] << "\n"
     << indent << "UseOriginalCamera: " << this->UseOriginalCamera << "\n"
     << indent << "Reconstruction: " << this->Reconstruction << "\n"
     << indent << "Azimuth: " << this->Azimuth << "\n";
}

int vtkVDIRenderer::FillInputPortInformation(int, vtkInformation* info) {
  info->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkImageData");
  return 1;
}

int vtkVDIRenderer::RequestInformation(vtkInformation*, vtkInformationVector** inputs,
                                       vtkInformationVector* outputs) {
  using Pipeline = vtkStreamingDemandDrivenPipeline;
  int extent[6] = {0, -1, 0, -1, 0, -1};
  vtkInformation* in = inputs[0]->GetInformationObject(0);
  if (in->Has(Pipeline::WHOLE_EXTENT())) in->Get(Pipeline::WHOLE_EXTENT(), extent);
  const bool something = extent[1] >= extent[0];
  if (something && this->Resolution[0] > 0 && this->Resolution[1] > 0) {
    extent[1] = this->Resolution[0] - 1;
    extent[3] = this->Resolution[1] - 1;
  }
  pv::announcePicture(outputs->GetInformationObject(0), extent);
  return 1;
}

int vtkVDIRenderer::RequestUpdateExtent(vtkInformation*, vtkInformationVector** inputs,
                                        vtkInformationVector*) {
  // A VDI can't be split into pieces.
  using Pipeline = vtkStreamingDemandDrivenPipeline;
  vtkInformation* info = inputs[0]->GetInformationObject(0);
  info->Set(Pipeline::UPDATE_PIECE_NUMBER(), 0);
  info->Set(Pipeline::UPDATE_NUMBER_OF_PIECES(), 1);
  info->Set(Pipeline::UPDATE_NUMBER_OF_GHOST_LEVELS(), 0);
  int whole[6];
  if (info->Has(Pipeline::WHOLE_EXTENT())) {
    info->Get(Pipeline::WHOLE_EXTENT(), whole);
    info->Set(Pipeline::UPDATE_EXTENT(), whole, 6);
  }
  return 1;
}

int vtkVDIRenderer::RequestData(vtkInformation*, vtkInformationVector** inputs,
                                vtkInformationVector* outputs) {
  vtkImageData* output = vtkImageData::GetData(outputs);
  output->Initialize();
  if (this->IsOther(vtkDataObject::GetData(inputs[0]))) {
    // Gives an empty picture of the announced size. The pipeline would repeat a request that failed, and its
    // message.
    int extent[6];
    outputs->GetInformationObject(0)->Get(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT(), extent);
    output->SetExtent(extent);
    output->AllocateScalars(VTK_UNSIGNED_CHAR, 4);
    output->GetPointData()->GetScalars()->Fill(0.0);
    output->GetPointData()->GetScalars()->SetName("RGBA");
    return 1;
  }
  try {
    this->Render(vtkDataObject::GetData(inputs[0]), output);
  } catch (const vdi::Error& error) {
    if (error.code() == vdi::ErrorCode::DeviceFailure) {  // a lost device stays lost
      this->Internal->Renderer.reset();
      this->Internal->Uploaded = nullptr;
    }
    output->Initialize();
    vtkErrorMacro(<< error.what());
    return 0;
  } catch (const std::exception& error) {
    output->Initialize();
    vtkErrorMacro(<< error.what());
    return 0;
  }
  return 1;
}

/// Whether `input` has data but no VDI. Reports that once.
bool vtkVDIRenderer::IsOther(vtkDataObject* input) {
  auto* image = vtkImageData::SafeDownCast(input);
  if (image == nullptr || image->GetNumberOfPoints() == 0 || pv::hasVdi(image)) {
    this->Internal->Other = nullptr;
    return false;
  }
  if (input != this->Internal->Other) vtkErrorMacro(<< pv::noVdi);
  this->Internal->Other = input;
  return true;
}

void vtkVDIRenderer::Render(vtkDataObject* input, vtkImageData* output) {
  Internals& internal = *this->Internal;
  if (input != internal.Uploaded || input->GetMTime() != internal.UploadedTime) {
    internal.Uploaded = nullptr;
    vdi::Vdi vdi;
    if (!pv::getVdi(input, vdi)) return;  // another rank has it
    if (!internal.Renderer) internal.Renderer = std::make_unique<vdi::VdiRenderer>(pv::sharedDevice(0));
    internal.Renderer->setVdi(vdi);
    internal.Uploaded = input;
    internal.UploadedTime = input->GetMTime();
    internal.Original = vdi.view();
    internal.Bounds = vdi.bounds;
    internal.Width = vdi.pictureSize().x;
    internal.Height = vdi.pictureSize().y;
  }
  const vdi::Camera camera = this->Viewpoint();
  const bool own = this->Resolution[0] <= 0 || this->Resolution[1] <= 0;
  const int width = own ? internal.Width : this->Resolution[0];
  const int height = own ? internal.Height : this->Resolution[1];
  this->WarnOf(camera, width, height);
  std::vector<vdi::ClipPlane> planes;
  for (const std::array<double, 6>& plane : this->ClippingPlanes)
    planes.push_back({{plane[0], plane[1], plane[2]}, {plane[3], plane[4], plane[5]}});
  internal.Renderer->setClipPlanes(std::move(planes));
  pv::setPicture(output,
                 internal.Renderer->renderBytes(camera, width, height, vdi::Alpha::Straight,
                                                static_cast<vdi::Reconstruction>(this->Reconstruction)));
}

vdi::Camera vtkVDIRenderer::Viewpoint() const {
  const vdi::Camera& original = this->Internal->Original->camera();
  const auto vector = [](const double* v) { return glm::dvec3(v[0], v[1], v[2]); };
  const vdi::Camera own{vector(this->CameraPosition),   vector(this->CameraFocalPoint),
                        vector(this->CameraViewUp),     this->CameraViewAngle,
                        this->CameraParallelProjection, this->CameraParallelScale};
  if (!this->UseOriginalCamera && own.position != own.focalPoint) return own;
  return original.azimuth(this->Azimuth);
}

void vtkVDIRenderer::WarnOf(const vdi::Camera& camera, int width, int height) {
  Internals& internal = *this->Internal;
  const auto issue =
      vdi::viewpointIssue(internal.Bounds, *internal.Original, vdi::View(camera, width, height));
  if (issue && issue != internal.Warned) vtkWarningMacro(<< describe(*issue));
  internal.Warned = issue;
}
