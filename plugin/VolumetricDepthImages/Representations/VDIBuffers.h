// A VDI on the device, in two buffers: one is shown while the next one is loaded beside it.
#ifndef VDIBuffers_h
#define VDIBuffers_h

#include <vtkSmartPointer.h>

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <future>
#include <memory>
#include <optional>

#include "VDIPiece.h"
#include "VDIStill.h"
#include "vdi/core/Vdi.h"
#include "vdi/pipeline/VdiRenderer.h"

class vtkDataObject;
class vtkFieldData;

namespace pv {

/// Belongs to the views' thread and starts others that load.
class VDIBuffers {
 public:
  VDIBuffers() = default;
  ~VDIBuffers();  // as clear
  VDIBuffers(const VDIBuffers&) = delete;
  VDIBuffers& operator=(const VDIBuffers&) = delete;
  VDIBuffers(VDIBuffers&&) = delete;
  VDIBuffers& operator=(VDIBuffers&&) = delete;

  /// Starts to load the VDI of a piece (VDIPiece.h). While an earlier one is being loaded, the piece waits,
  /// and replaces a piece that waits already. Loads nothing if the newest piece had the same VDI.
  void load(vtkDataObject* piece);
  /// Shows the newest VDI that has been loaded, starts to load a waiting piece, and returns whether the VDI
  /// changed. Waits at most `wait` for the newest piece, then continues to show the last one. Throws
  /// vdi::Error for a VDI that isn't sound, for a piece with a problem, and for a device that fails; then
  /// nothing is shown.
  bool take(std::chrono::steady_clock::duration wait);
  /// Whether a newer VDI than the one shown is being loaded, and whether `take` would show it at once.
  bool isLoading() const { return job_.valid(); }
  bool hasLoaded() const;
  /// Shows nothing and gives the device back. A load that is under way ends on another thread, and the device
  /// is given back then.
  void clear();

  bool hasVdi() const { return hasVdi_; }
  /// Whether the loaded VDI has no supersegments. Then hasVdi is false.
  bool isEmpty() const { return isEmpty_; }
  /// The number of changes of the shown VDI.
  std::uint64_t version() const { return version_; }
  /// World bounds as VTK has them.
  const std::array<double, 6>& bounds() const { return bounds_; }
  /// V_O; nullopt without a VDI.
  const std::optional<vdi::View>& viewpoint() const { return viewpoint_; }
  /// The renderer of all lists. There must be a VDI.
  vdi::VdiRenderer& renderer() { return *renderers_->whole; }
  /// The same VDI with fewer lists, for rough pictures: their number, in all and as a share of a row. Later
  /// levels have more lists. A level without lists doesn't exist: the device is no CPU, or the VDI itself has
  /// hardly more.
  static constexpr std::size_t thinLevels = 2;
  struct Thin {
    std::size_t lists = 0;
    double share = 1.0;
  };
  const Thin& thin(std::size_t level) const { return thins_.at(level); }
  vdi::VdiRenderer& thinRenderer(std::size_t level) { return *renderers_->thins.at(level); }
  bool isOnCpu() const { return renderers_->isOnCpu; }
  /// The full picture that a thread makes in the background. Another VDI drops it. The views' thread must
  /// drop it before it uses a renderer.
  VDIStill& still() { return still_; }

 private:
  struct Renderers {
    std::unique_ptr<vdi::VdiRenderer> whole;
    std::array<std::unique_ptr<vdi::VdiRenderer>, thinLevels> thins;
    bool isOnCpu = false;
    std::future<void> compiling;  // its destructor waits
    void compileForMovement();
    bool areBusy() const;
  };
  struct Loaded {
    bool hasVdi = false;
    bool isEmpty = false;
    std::array<double, 6> bounds{};
    std::optional<vdi::View> viewpoint;
    std::array<Thin, thinLevels> thins{};
    std::optional<vdi::Vdi> tooLarge;  // the device has no memory for a second buffer
  };
  /// A load that nobody waits for. The last member's destructor waits, before the others are destroyed.
  struct Abandoned {
    std::shared_ptr<Renderers> renderers;
    vtkSmartPointer<vtkFieldData> loading;
    std::future<Loaded> job;
  };
  static Loaded loaded(vtkFieldData* fields, Renderers& renderers);
  static Thin loadThin(const vdi::Vdi& vdi, int width, std::unique_ptr<vdi::VdiRenderer>& renderer);
  void startNext();
  void takeOne();
  void continueAfterFailure();
  void abandonRenderers();

  std::shared_ptr<Renderers> renderers_ = std::make_shared<Renderers>();
  bool hasVdi_ = false;
  bool isEmpty_ = false;
  std::uint64_t version_ = 0;
  std::array<double, 6> bounds_{};
  std::optional<vdi::View> viewpoint_;
  std::array<Thin, thinLevels> thins_{};
  std::future<Loaded> job_;
  vtkSmartPointer<vtkFieldData> loading_;  // read by the job
  vtkSmartPointer<vtkFieldData> waiting_;
  PieceContent newest_;  // that of the last piece; empty if its load failed
  VDIStill still_;       // declared after the renderers that it uses, so that it is destroyed before them
};

}  // namespace pv

#endif
