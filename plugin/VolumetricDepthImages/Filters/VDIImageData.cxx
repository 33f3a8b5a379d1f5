#include "VDIImageData.h"

#include <vtkDataArray.h>
#include <vtkDoubleArray.h>
#include <vtkFieldData.h>
#include <vtkFloatArray.h>
#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkInformationIntegerKey.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkStreamingDemandDrivenPipeline.h>
#include <vtkStringArray.h>
#include <vtkUnsignedCharArray.h>
#include <vtkUnsignedIntArray.h>

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <span>
#include <vector>

#include "VDIPlace.h"
#include "VDIRanges.h"
#include "vdi/core/Error.h"
#include "vdi/core/Flatten.h"
#include "vdi/core/Parallel.h"
#include "vdi/io/Metadata.h"
#include "vdi/io/VdiFile.h"

namespace pv {

namespace {

constexpr const char* beingMadeName = "VDI.isBeingMade";
constexpr const char* waitingName = "VDI.waiting";

template <typename Array>
auto* addField(vtkFieldData* fields, const char* name, int components, vtkIdType tuples) {
  vtkNew<Ranged<Array>> array;
  array->SetName(name);
  array->SetNumberOfComponents(components);
  array->SetNumberOfTuples(tuples);
  fields->AddArray(array);
  return array->GetPointer(0);
}

/// Adds the image's colours, 4 bytes a pixel, and returns their memory.
unsigned char* addColors(vtkImageData* image, std::size_t pixels) {
  vtkNew<Ranged<vtkUnsignedCharArray>> colors;
  colors->SetName("RGBA");
  colors->SetNumberOfComponents(4);
  colors->SetNumberOfTuples(static_cast<vtkIdType>(pixels));
  image->GetPointData()->SetScalars(colors);
  return colors->GetPointer(0);
}

/// Hides the array from ParaView's lists of arrays.
void hide(vtkAbstractArray* array) {
  array->GetInformation()->Set(vtkAbstractArray::GUI_HIDE(), 1);
}

void addDepth(vtkImageData* image, std::span<const float> depths) {
  vtkNew<Ranged<vtkFloatArray>> array;
  array->SetName("Depth");
  array->SetNumberOfTuples(static_cast<vtkIdType>(depths.size()));
  vdi::copyInParallel(std::as_bytes(depths), array->GetPointer(0));
  image->GetPointData()->AddArray(array);
}

/// The field array with this name, type and number of components. Throws if it is missing or has another
/// shape.
template <typename Array>
Array* field(vtkFieldData* fields, const char* name, int components, vtkIdType tuples) {
  auto* array = Array::SafeDownCast(fields->GetAbstractArray(name));
  const bool good = array != nullptr && array->GetNumberOfComponents() == components &&
                    (tuples < 0 || array->GetNumberOfTuples() == tuples);
  if (!good) throw vdi::Error(vdi::ErrorCode::Format, "the data set's VDI is incomplete", name);
  return array;
}

template <typename Segment, typename T>
void copySegments(const vdi::HostVector<Segment>& segments, T* to) {
  vdi::copyInParallel(std::as_bytes(std::span(segments)), to);
}

template <typename Segment, typename Array>
vdi::ListsOf<Segment> listsFrom(vtkUnsignedIntArray* offsets, Array* segments) {
  vdi::ListsOf<Segment> lists;
  const unsigned int* first = offsets->GetPointer(0);
  lists.offsets.assign(first, first + offsets->GetNumberOfTuples());
  lists.segments.resize(static_cast<std::size_t>(segments->GetNumberOfTuples()));
  const auto* values = reinterpret_cast<const std::byte*>(segments->GetPointer(0));
  vdi::copyInParallel({values, lists.segments.size() * sizeof(Segment)}, lists.segments.data());
  return lists;
}

}  // namespace

void announcePicture(vtkInformation* output, const int (&extent)[6]) {
  output->Set(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT(), extent, 6);
  output->Set(vtkDataObject::SPACING(), 1.0, 1.0, 1.0);
  output->Set(vtkDataObject::ORIGIN(), 0.0, 0.0, 0.0);
  vtkDataObject::SetPointDataActiveScalarInfo(output, VTK_UNSIGNED_CHAR, 4);
}

void setPicture(vtkImageData* image, const vdi::ImageBytes& picture) {
  image->SetDimensions(picture.width, picture.height, 1);
  vdi::copyInParallel(std::as_bytes(picture.rgba), addColors(image, picture.rgba.size()));
  rememberRanges(image->GetPointData()->GetScalars());
  addDepth(image, picture.depth);
}

void setPicture(vtkImageData* image, const vdi::Image& picture, bool withDepth) {
  image->SetDimensions(picture.width, picture.height, 1);
  unsigned char* const bytes = addColors(image, picture.rgba.size());
  constexpr std::size_t minimum = 1U << 15;  // pixels
  vdi::inParallel(picture.rgba.size(), minimum, [&](std::size_t first, std::size_t last) {
    unsigned char* out = bytes + 4 * first;
    for (std::size_t i = first; i < last; ++i) {
      const glm::vec4& pixel = picture.rgba[i];
      const float unmultiply = pixel.a > 0.0F ? 1.0F / pixel.a : 0.0F;
      for (int c = 0; c < 3; ++c) *out++ = vdi::toByte(pixel[c] * unmultiply);
      *out++ = vdi::toByte(pixel.a);
    }
  });
  rememberRanges(image->GetPointData()->GetScalars());
  if (withDepth) addDepth(image, picture.depth);
}

vdi::Image pictureIn(vtkImageData* image) {
  auto* const colors = vtkUnsignedCharArray::SafeDownCast(image->GetPointData()->GetArray("RGBA"));
  const int* const size = image->GetDimensions();
  if (colors == nullptr || colors->GetNumberOfComponents() != 4 || size[2] != 1) {
    throw vdi::Error(
        vdi::ErrorCode::InvalidArgument,
        "the input has no picture; connect a VolumetricDepthImage or RenderVDI filter, or a VDI reader");
  }
  vdi::Image picture{size[0], size[1], {}, {}};
  picture.rgba.resize(picture.pixelCount());
  const unsigned char* from = colors->GetPointer(0);
  for (glm::vec4& pixel : picture.rgba) {
    const glm::vec4 straight = glm::vec4(from[0], from[1], from[2], from[3]) / 255.0F;
    pixel = glm::vec4(glm::vec3(straight) * straight.a, straight.a);
    from += 4;
  }
  return picture;
}

void setVdi(vtkImageData* image, const vdi::Vdi& vdi) {
  setVdi(image, vdi, vdi::flatten(vdi));
}

void setVdi(vtkImageData* image, const vdi::Vdi& vdi, const vdi::Image& flat) {
  setPicture(image, flat, false);
  vtkNew<Ranged<vtkUnsignedIntArray>> counts;
  counts->SetName("SupersegmentCount");
  const auto& offsets = vdi.offsets();
  const glm::ivec2 picture = vdi.pictureSize();
  counts->SetNumberOfTuples(vtkIdType{picture.x} * picture.y);
  vtkIdType pixel = 0;
  for (int y = vdi.margin.y; y < vdi.margin.y + picture.y; ++y) {
    const std::size_t row = static_cast<std::size_t>(y) * static_cast<std::size_t>(vdi.width);
    for (int x = vdi.margin.x; x < vdi.margin.x + picture.x; ++x) {
      const std::size_t list = row + static_cast<std::size_t>(x);
      counts->SetValue(pixel++, offsets[list + 1] - offsets[list]);
    }
  }
  image->GetPointData()->AddArray(counts);
  rememberRanges(counts);

  vtkFieldData* fields = image->GetFieldData();
  unsigned int* size = addField<vtkUnsignedIntArray>(fields, "VDI.size", 1, 2);
  size[0] = static_cast<unsigned int>(vdi.width);
  size[1] = static_cast<unsigned int>(vdi.height);
  unsigned int* margin = addField<vtkUnsignedIntArray>(fields, "VDI.margin", 1, 2);
  margin[0] = static_cast<unsigned int>(vdi.margin.x);
  margin[1] = static_cast<unsigned int>(vdi.margin.y);
  std::copy(offsets.begin(), offsets.end(),
            addField<vtkUnsignedIntArray>(fields, "VDI.offsets", 1, static_cast<vtkIdType>(offsets.size())));
  const auto count = static_cast<vtkIdType>(vdi.supersegmentCount());
  if (const auto* compact = std::get_if<vdi::CompactLists>(&vdi.lists)) {
    copySegments(compact->segments, addField<vtkUnsignedIntArray>(fields, "VDI.codes", 2, count));
    float* code = addField<vtkFloatArray>(fields, "VDI.depthCode", 1, 2);
    code[0] = vdi.depthCode.first;
    code[1] = vdi.depthCode.step;
  } else {
    copySegments(std::get<vdi::SupersegmentLists>(vdi.lists).segments,
                 addField<vtkFloatArray>(fields, "VDI.supersegments", 6, count));
  }
  setPlace(fields, vdi.camera, vdi.bounds);
  double* parameters = addField<vtkDoubleArray>(fields, "VDI.parameters", 1, 4);
  parameters[0] = vdi.budget;
  parameters[1] = vdi.sampleStep;
  parameters[2] = vdi.time;
  parameters[3] = static_cast<double>(vdi.timeStep);
  if (vdi.coloring) {
    vtkNew<vtkStringArray> coloring;
    coloring->SetName("VDI.coloring");
    coloring->InsertNextValue(vdi::io::metadataText(*vdi.coloring, vdi.time, vdi.timeStep));
    fields->AddArray(coloring);
  }
  hide(image->GetPointData()->GetScalars());
  hide(counts);
  for (int i = 0; i < fields->GetNumberOfArrays(); ++i) hide(fields->GetAbstractArray(i));
  for (const char* name : {"VDI.offsets", "VDI.codes", "VDI.supersegments"}) {
    if (vtkDataArray* array = fields->GetArray(name)) rememberRanges(array);
  }
}

void setBeingMade(vtkImageData* image, const vdi::Camera& camera, const vdi::Box& bounds) {
  setPlace(image->GetFieldData(), camera, bounds);
  vtkNew<vtkStringArray> mark;
  mark->SetName(beingMadeName);
  mark->InsertNextValue("");
  image->GetFieldData()->AddArray(mark);
  hide(image->GetPointData()->GetScalars());
  for (int i = 0; i < image->GetFieldData()->GetNumberOfArrays(); ++i)
    hide(image->GetFieldData()->GetAbstractArray(i));
}

bool isBeingMade(vtkFieldData* fields) {
  return fields->GetAbstractArray(beingMadeName) != nullptr;
}

void setWaiting(vtkImageData* image, const std::string& why) {
  vtkNew<vtkStringArray> reason;
  reason->SetName(waitingName);
  reason->InsertNextValue(why);
  image->GetFieldData()->AddArray(reason);
  hide(reason);
}

std::string waitingIn(vtkFieldData* fields) {
  auto* reason = vtkStringArray::SafeDownCast(fields->GetAbstractArray(waitingName));
  return reason != nullptr && reason->GetNumberOfValues() == 1 ? reason->GetValue(0) : std::string();
}

vtkSmartPointer<vtkUnsignedCharArray> fileOf(const vdi::Vdi& vdi) {
  const std::vector<std::byte> bytes = vdi::io::encode(vdi);
  auto file = vtkSmartPointer<vtkUnsignedCharArray>::New();
  file->SetNumberOfTuples(static_cast<vtkIdType>(bytes.size()));
  std::memcpy(file->GetPointer(0), bytes.data(), bytes.size());
  return file;
}

bool hasVdi(vtkImageData* image) {
  return image->GetFieldData()->GetAbstractArray("VDI.offsets") != nullptr;
}

std::optional<vdi::Coloring> coloringOf(vtkFieldData* fields) {
  auto* text = vtkStringArray::SafeDownCast(fields->GetAbstractArray("VDI.coloring"));
  if (text == nullptr || text->GetNumberOfValues() != 1) return std::nullopt;
  try {
    return vdi::io::coloringIn(text->GetValue(0));
  } catch (const vdi::Error&) {
    return std::nullopt;
  }
}

bool getVdi(vtkDataObject* data, vdi::Vdi& vdi) {
  auto* image = vtkImageData::SafeDownCast(data);
  return image != nullptr && getVdi(image->GetFieldData(), vdi);
}

bool getVdi(vtkFieldData* fields, vdi::Vdi& vdi) {
  if (fields->GetAbstractArray("VDI.offsets") == nullptr) return false;
  auto* offsets = field<vtkUnsignedIntArray>(fields, "VDI.offsets", 1, -1);
  const double* camera = field<vtkDoubleArray>(fields, "VDI.camera", 1, 12)->GetPointer(0);
  const double* bounds = field<vtkDoubleArray>(fields, "VDI.bounds", 1, 6)->GetPointer(0);
  const double* parameters = field<vtkDoubleArray>(fields, "VDI.parameters", 1, 4)->GetPointer(0);
  const unsigned int* size = field<vtkUnsignedIntArray>(fields, "VDI.size", 1, 2)->GetPointer(0);
  vdi.width = static_cast<int>(size[0]);
  vdi.height = static_cast<int>(size[1]);
  const unsigned int* margin = field<vtkUnsignedIntArray>(fields, "VDI.margin", 1, 2)->GetPointer(0);
  vdi.margin = glm::ivec2(static_cast<int>(margin[0]), static_cast<int>(margin[1]));
  for (int axis = 0; axis < 3; ++axis) {
    vdi.camera.position[axis] = camera[axis];
    vdi.camera.focalPoint[axis] = camera[3 + axis];
    vdi.camera.viewUp[axis] = camera[6 + axis];
    const std::ptrdiff_t side = std::ptrdiff_t{2} * axis;
    vdi.bounds.lo[axis] = bounds[side];
    vdi.bounds.hi[axis] = bounds[side + 1];
  }
  vdi.camera.viewAngle = camera[9];
  vdi.camera.parallelProjection = camera[10] != 0.0;
  vdi.camera.parallelScale = camera[11];
  vdi.budget = static_cast<std::uint32_t>(parameters[0]);
  vdi.sampleStep = parameters[1];
  vdi.time = parameters[2];
  vdi.timeStep = static_cast<std::uint64_t>(parameters[3]);
  vdi.coloring = coloringOf(fields);
  vdi.depthCode = {};
  if (fields->GetAbstractArray("VDI.codes") != nullptr) {
    vdi.lists =
        listsFrom<vdi::CompactSupersegment>(offsets, field<vtkUnsignedIntArray>(fields, "VDI.codes", 2, -1));
    const float* code = field<vtkFloatArray>(fields, "VDI.depthCode", 1, 2)->GetPointer(0);
    vdi.depthCode = {code[0], code[1]};
  } else {
    vdi.lists =
        listsFrom<vdi::Supersegment>(offsets, field<vtkFloatArray>(fields, "VDI.supersegments", 6, -1));
  }
  validate(vdi);
  return true;
}

}  // namespace pv
