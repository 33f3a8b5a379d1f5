// Renders a VDI from any viewpoint.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "vdi/core/Camera.h"
#include "vdi/core/Image.h"
#include "vdi/core/Reconstruction.h"
#include "vdi/core/Region.h"
#include "vdi/core/Vdi.h"
#include "vdi/gpu/Device.h"

namespace vdi {

namespace detail {
class VdiSink;
}

class VdiGenerator;

/// Renders a VDI from anywhere, on one device, which it keeps alive. Not collective. One thread at a time
/// calls a renderer, except for prepareVdi and compile. Pictures are [height][width], row 0 at the bottom;
/// their depths, and `ends`, are depths in the rendering camera's view space (Camera.h), in world units.
/// Functions that use the device throw Error{OutOfMemory} or Error{DeviceFailure}.
class VdiRenderer {
 public:
  explicit VdiRenderer(std::shared_ptr<gpu::Device> device);
  ~VdiRenderer();
  VdiRenderer(const VdiRenderer&) = delete;
  VdiRenderer& operator=(const VdiRenderer&) = delete;
  VdiRenderer(VdiRenderer&&) = delete;
  VdiRenderer& operator=(VdiRenderer&&) = delete;

  /// Copies the VDI, which validate(Vdi) must accept; `vdi` is not needed afterwards. The device goes on with
  /// upload and set-up after this returns, and the next render waits for them (for VDIs of up to 128 MiB;
  /// larger ones wait for all but their last part). After a throw, there may be no VDI.
  void setVdi(const Vdi& vdi);
  /// Double buffering: copies the VDI into buffers of its own, while renders go on with the current VDI. Call
  /// from any one thread, but not during setVdi, showPrepared or another prepareVdi. Returns when the VDI is
  /// on the device. Takes memory for a second VDI, and keeps it for the next one. Throws Error{OutOfMemory}
  /// if memory is short; the current VDI stays.
  void prepareVdi(const Vdi& vdi);
  /// Shows the prepared VDI at once. Returns whether one was prepared.
  bool showPrepared();
  /// Later renders show the sides of the planes to which their normals point; initially no planes are set.
  /// Throws Error{InvalidArgument} for more than maxClipPlanes, and for planes that validate(Region) rejects.
  void setClipPlanes(std::vector<ClipPlane> planes);
  /// Rays end at an opacity of 1 - 1/512, or 1 - 1/1024 along V_O's rays: farther material changes an 8-bit
  /// colour by half a step at most. Throws Error{InvalidArgument} before the first setVdi, and for cameras
  /// and sizes that View rejects.
  Image render(const Camera& camera, int width, int height,
               Reconstruction reconstruction = defaultReconstruction);
  /// Renders for a screen: downloads 8 instead of 20 bytes per pixel, since the download takes longer than
  /// rendering. With Alpha::Premultiplied, each byte is toByte of the value that render gives. The renderer
  /// owns the memory of the picture, which is valid until its next render or renderBytes. Throws as render.
  ImageBytes renderBytes(const Camera& camera, int width, int height, Alpha alpha,
                         Reconstruction reconstruction = defaultReconstruction);
  /// Renders among opaque objects. `ends` has the depths at which the view's rays end, [height][width]:
  /// infinity where no object is hit, empty if there are no objects. Throws Error{InvalidArgument} before the
  /// first setVdi.
  Image render(const View& view, std::span<const float> ends,
               Reconstruction reconstruction = defaultReconstruction);
  ImageBytes renderBytes(const View& view, std::span<const float> ends, Alpha alpha,
                         Reconstruction reconstruction = defaultReconstruction);
  /// Compiles the device's program for renderBytes with premultiplied colours, unless it is compiled, so that
  /// the first view with this reconstruction won't wait. Any thread may call it during the other calls.
  void compile(Reconstruction reconstruction) const;
  double renderMilliseconds() const;  // device time of the last render

 private:
  friend class VdiGenerator;
  /// For VdiGenerator::show: a sink that shows lists made on the renderer's own device, without a detour
  /// through the host. Null for another device. The renderer must outlive the sink.
  std::unique_ptr<detail::VdiSink> sinkFor(const gpu::Device& device);

  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace vdi
