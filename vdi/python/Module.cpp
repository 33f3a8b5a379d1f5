// Python module pv_vdi._core: .vdi files as NumPy arrays, and pictures of them. pv_vdi/__init__.py re-exports
// it and documents the classes.
#include <pybind11/numpy.h>
#include <pybind11/operators.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <array>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "vdi/core/Camera.h"
#include "vdi/core/Error.h"
#include "vdi/core/Reconstruction.h"
#include "vdi/core/Vdi.h"
#include "vdi/gpu/Device.h"
#include "vdi/gpu/DeviceRequest.h"
#include "vdi/io/Metadata.h"
#include "vdi/io/VdiFile.h"
#include "vdi/pipeline/VdiRenderer.h"

namespace py = pybind11;

namespace {

using Vector = std::array<double, 3>;

Vector toVector(const glm::dvec3& vector) {
  return {vector.x, vector.y, vector.z};
}

glm::dvec3 fromVector(const Vector& vector) {
  return {vector[0], vector[1], vector[2]};
}

/// An array over memory that `owner` keeps alive. Read only: a VDI doesn't change.
template <typename T>
py::array viewOf(const T* data, std::vector<py::ssize_t> shape, const py::object& owner) {
  py::array_t<T> array(std::move(shape), data, owner);
  array.attr("flags").attr("writeable") = false;
  return array;
}

/// An array that owns its values.
template <typename T>
py::array own(vdi::HostVector<T> values, std::vector<py::ssize_t> shape) {
  auto kept = std::make_unique<vdi::HostVector<T>>(std::move(values));
  const T* const data = kept->data();
  const py::capsule owner(kept.release(),
                          [](void* memory) { delete static_cast<vdi::HostVector<T>*>(memory); });
  return py::array_t<T>(std::move(shape), data, owner);
}

py::array offsetsOf(const py::object& self) {
  const auto& offsets = self.cast<const vdi::Vdi&>().offsets();
  return viewOf(offsets.data(), {static_cast<py::ssize_t>(offsets.size())}, self);
}

py::array segmentsOf(const py::object& self) {
  const auto& vdi = self.cast<const vdi::Vdi&>();
  const auto count = static_cast<py::ssize_t>(vdi.supersegmentCount());
  if (const auto* full = std::get_if<vdi::SupersegmentLists>(&vdi.lists))
    return viewOf(full->segments.data(), {count}, self);
  return own(vdi.expandedLists().segments, {count});
}

std::optional<std::string> metadataOf(const vdi::Vdi& vdi) {
  if (!vdi.coloring) return std::nullopt;
  return vdi::io::metadataText(*vdi.coloring, vdi.time, vdi.timeStep);
}

/// Renders one VDI. Python's threads may share it: renders take turns.
class Renderer {
 public:
  explicit Renderer(const vdi::Vdi& vdi)
      : size_(vdi.pictureSize()),
        camera_(vdi.camera),
        renderer_(vdi::gpu::Device::create(vdi::gpu::requestFromEnvironment(0))) {
    renderer_.setVdi(vdi);
  }

  std::pair<py::array, py::array> render(const std::optional<vdi::Camera>& camera,
                                         const std::optional<std::pair<int, int>>& size,
                                         const std::string& reconstruction) {
    const auto [width, height] = size.value_or(std::pair(size_.x, size_.y));
    vdi::Image image;
    {
      const py::gil_scoped_release others;
      const std::scoped_lock lock(mutex_);
      image = renderer_.render(camera.value_or(camera_), width, height,
                               vdi::reconstructionFromString(reconstruction));
    }
    const std::vector<py::ssize_t> shape{height, width};
    static_assert(sizeof(glm::vec4) == 4 * sizeof(float));
    auto kept = std::make_unique<vdi::Image>(std::move(image));
    const auto* const colors = reinterpret_cast<const float*>(kept->rgba.data());
    const float* const depths = kept->depth.data();
    const py::capsule owner(kept.release(), [](void* memory) { delete static_cast<vdi::Image*>(memory); });
    return {py::array_t<float>({shape[0], shape[1], py::ssize_t{4}}, colors, owner),
            py::array_t<float>(shape, depths, owner)};
  }

 private:
  glm::ivec2 size_;
  vdi::Camera camera_;
  vdi::VdiRenderer renderer_;
  std::mutex mutex_;
};

void addCamera(py::module_& module) {
  py::class_<vdi::Camera>(module, "Camera", "The parameters of vtkCamera that shape a picture.")
      .def(py::init([](const Vector& position, const Vector& focalPoint, const Vector& viewUp,
                       double viewAngle, std::optional<double> parallelScale) {
             return vdi::Camera{fromVector(position),      fromVector(focalPoint),
                                fromVector(viewUp),        viewAngle,
                                parallelScale.has_value(), parallelScale.value_or(1.0)};
           }),
           py::arg("position"), py::arg("focal_point"), py::arg("view_up") = Vector{0.0, 1.0, 0.0},
           py::arg("view_angle") = 30.0, py::arg("parallel_scale") = py::none(),
           "`view_angle` is vertical, in degrees. With `parallel_scale`, half the height of the picture in "
           "world units, the projection is parallel.")
      .def_property_readonly("position", [](const vdi::Camera& camera) { return toVector(camera.position); })
      .def_property_readonly("focal_point",
                             [](const vdi::Camera& camera) { return toVector(camera.focalPoint); })
      .def_property_readonly("view_up", [](const vdi::Camera& camera) { return toVector(camera.viewUp); })
      .def_readonly("view_angle", &vdi::Camera::viewAngle)
      .def_property_readonly("parallel_scale",
                             [](const vdi::Camera& camera) {
                               return camera.parallelProjection ? std::optional(camera.parallelScale)
                                                                : std::nullopt;
                             })
      .def("azimuth", &vdi::Camera::azimuth, py::arg("degrees"),
           "The camera turned about its focal point, around its view-up, as vtkCamera::Azimuth turns it.")
      .def(py::self == py::self);
}

void addVdi(py::module_& module) {
  py::class_<vdi::Vdi, std::shared_ptr<vdi::Vdi>>(module, "Lists")
      .def_readonly("camera", &vdi::Vdi::camera)
      .def_readonly("width", &vdi::Vdi::width)
      .def_readonly("height", &vdi::Vdi::height)
      .def_property_readonly("margin",
                             [](const vdi::Vdi& vdi) { return std::pair(vdi.margin.x, vdi.margin.y); })
      .def_readonly("budget", &vdi::Vdi::budget)
      .def_property_readonly(
          "bounds",
          [](const vdi::Vdi& vdi) { return std::pair(toVector(vdi.bounds.lo), toVector(vdi.bounds.hi)); })
      .def_readonly("sample_step", &vdi::Vdi::sampleStep)
      .def_readonly("time", &vdi::Vdi::time)
      .def_readonly("time_step", &vdi::Vdi::timeStep)
      .def_property_readonly("precision",
                             [](const vdi::Vdi& vdi) { return std::string(toString(vdi.precision())); })
      .def_property_readonly("metadata_text", &metadataOf)
      .def_property_readonly("offsets", &offsetsOf)
      .def("segments", &segmentsOf)
      .def("write", [](const vdi::Vdi& vdi, const std::filesystem::path& path) {
        const py::gil_scoped_release others;
        vdi::io::writeVdi(path, vdi);
      });
}

}  // namespace

PYBIND11_MODULE(_core, module) {
  py::register_exception<vdi::Error>(module, "Error", PyExc_RuntimeError);
  PYBIND11_NUMPY_DTYPE(vdi::Supersegment, front, back, red, green, blue, opacity);
  addCamera(module);
  addVdi(module);
  py::class_<Renderer>(module, "Renderer")
      .def(py::init<const vdi::Vdi&>(), py::call_guard<py::gil_scoped_release>())
      .def("render", &Renderer::render, py::arg("camera"), py::arg("size"), py::arg("reconstruction"));
  module.def(
      "read",
      [](const std::filesystem::path& path) { return std::make_shared<vdi::Vdi>(vdi::io::readVdi(path)); },
      py::call_guard<py::gil_scoped_release>());
}
