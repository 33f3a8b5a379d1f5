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

/// Renders a VDI from anywhere, on one device. Not collective.
class VdiRenderer {
 public:
  explicit VdiRenderer(std::shared_ptr<gpu::Device> device);
  ~VdiRenderer();
  VdiRenderer(const VdiRenderer&) = delete;
  VdiRenderer& operator=(const VdiRenderer&) = delete;
  VdiRenderer(VdiRenderer&&) = delete;
  VdiRenderer& operator=(VdiRenderer&&) = delete;

  /// Copies; `vdi` isn't needed afterwards. Upload and set-up go on on the device while this returns, the
  /// next render waits for them there (VDIs of up to 128 MiB; larger ones wait for all but their last part).
  void setVdi(const Vdi& vdi);
  /// Double buffering: the same into buffers of its own, while renders go on with the VDI that is shown. On
  /// any one thread; not beside setVdi, showPrepared or another of this. Returns when the VDI is on the
  /// device. Takes memory for a second VDI, which stays for the next one. Throws Error{OutOfMemory} where
  /// there's none; what is shown stays.
  void prepareVdi(const Vdi& vdi);
  /// Shows what was prepared, at once. Returns whether there was anything.
  bool showPrepared();
  /// Later renders show the sides of the planes to which their normals point; at first there are none. Throws
  /// Error{InvalidArgument} for more than maxClipPlanes, and for what validate(Region) refuses.
  void setClipPlanes(std::vector<ClipPlane> planes);
  /// Rays end at an opacity of 1 - 1/512, along V_O's of 1 - 1/1024: what's behind changes a colour of 8 bits
  /// by half a step at most. Throws Error{InvalidArgument} before the first setVdi, and for what View
  /// rejects.
  Image render(const Camera& camera, int width, int height,
               Reconstruction reconstruction = Reconstruction::Smooth);
  /// The same for a screen: 8 instead of 20 bytes a pixel come from the device, which takes longer than
  /// rendering. Premultiplied, each byte is toByte of what render gives. Valid until the next call.
  ImageBytes renderBytes(const Camera& camera, int width, int height, Alpha alpha,
                         Reconstruction reconstruction = Reconstruction::Smooth);
  /// Either one among other things that are seen. `ends`: [height][width] of the view, the depths at which
  /// its rays end, at opaque objects; infinity where there's none, empty if there's none at all.
  Image render(const View& view, std::span<const float> ends,
               Reconstruction reconstruction = Reconstruction::Smooth);
  ImageBytes renderBytes(const View& view, std::span<const float> ends, Alpha alpha,
                         Reconstruction reconstruction = Reconstruction::Smooth);
  double renderMilliseconds() const;  // device time of the last render

  /// For VdiGenerator::show: shows lists that this device makes, without a way over the host. Null for
  /// another device. The renderer must outlive it.
  std::unique_ptr<detail::VdiSink> sinkFor(const gpu::Device& device);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace vdi
