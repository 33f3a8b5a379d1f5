// A VDI on the device, in two buffers: one is shown while the next one is loaded beside it.
#ifndef VDIBuffers_h
#define VDIBuffers_h

#include <vtkSmartPointer.h>

#include <array>
#include <chrono>
#include <cstddef>
#include <future>
#include <memory>
#include <optional>

#include "VDIStill.h"
#include "vdi/core/Vdi.h"
#include "vdi/pipeline/VdiRenderer.h"

class vtkDataObject;
class vtkFieldData;

namespace pv {

/// Of one thread, that of the views; makes others to load.
class VDIBuffers {
 public:
  VDIBuffers() = default;
  ~VDIBuffers();  // waits for what is being loaded, as clear does
  VDIBuffers(const VDIBuffers&) = delete;
  VDIBuffers& operator=(const VDIBuffers&) = delete;
  VDIBuffers(VDIBuffers&&) = delete;
  VDIBuffers& operator=(VDIBuffers&&) = delete;

  /// Starts to load the VDI of a piece (VDIPiece.h). While an earlier one is being loaded the piece waits, in
  /// the place of one that waits already.
  void load(vtkDataObject* piece);
  /// Shows what has been loaded since, and starts what waits; returns whether there was anything. Waits for
  /// the newest piece as long as that; beyond, the last one is shown. Throws vdi::Error for a VDI that isn't
  /// sound, for a problem, and where the device doesn't do it; then nothing is shown.
  bool take(std::chrono::steady_clock::duration wait);
  /// Whether something newer than what is shown is on its way, and whether `take` would show it at once.
  bool isLoading() const { return job_.valid(); }
  bool hasLoaded() const;
  /// Shows nothing and gives the device back.
  void clear();

  bool hasVdi() const { return hasVdi_; }
  /// There's a VDI that shows nothing, in place of one.
  bool isEmpty() const { return isEmpty_; }
  /// World bounds as VTK has them.
  const std::array<double, 6>& bounds() const { return bounds_; }
  /// Of all lists, where there's a VDI.
  const std::optional<vdi::View>& viewpoint() const { return viewpoint_; }
  /// There's a VDI.
  vdi::VdiRenderer& renderer() { return *renderers_->whole; }
  /// The same VDI with fewer lists, for rough pictures, and how many of them there are and in a row. Levels
  /// are from few to more. No lists: there's no such level, for the device is no CPU, or the VDI has hardly
  /// more lists itself.
  static constexpr std::size_t thinLevels = 2;
  struct Thin {
    std::size_t lists = 0;
    double share = 1.0;  // of the lists in a row
  };
  const Thin& thin(std::size_t level) const { return thins_.at(level); }
  vdi::VdiRenderer& thinRenderer(std::size_t level) { return *renderers_->thins.at(level); }
  bool isOnCpu() const { return renderers_->isOnCpu; }
  /// The picture of that VDI that is made beside the frames: goes with the VDI. Who renders drops it first.
  VDIStill& still() { return still_; }

 private:
  struct Renderers {
    std::unique_ptr<vdi::VdiRenderer> whole;
    std::array<std::unique_ptr<vdi::VdiRenderer>, thinLevels> thins;
    bool isOnCpu = false;
  };
  struct Loaded {
    bool hasVdi = false;
    bool isEmpty = false;
    std::array<double, 6> bounds{};
    std::optional<vdi::View> viewpoint;
    std::array<Thin, thinLevels> thins{};
    std::optional<vdi::Vdi> tooLarge;  // for a second buffer
  };
  static Loaded loaded(vtkFieldData* fields, Renderers& renderers);
  static Thin loadThin(const vdi::Vdi& vdi, int width, std::unique_ptr<vdi::VdiRenderer>& renderer);
  void startNext();
  void takeOne();

  std::shared_ptr<Renderers> renderers_ = std::make_shared<Renderers>();
  bool hasVdi_ = false;
  bool isEmpty_ = false;
  std::array<double, 6> bounds_{};
  std::optional<vdi::View> viewpoint_;
  std::array<Thin, thinLevels> thins_{};
  std::future<Loaded> job_;
  vtkSmartPointer<vtkFieldData> loading_;  // the job's; goes on this thread
  vtkSmartPointer<vtkFieldData> waiting_;
  VDIStill still_;  // behind the renderers that it uses
};

}  // namespace pv

#endif
