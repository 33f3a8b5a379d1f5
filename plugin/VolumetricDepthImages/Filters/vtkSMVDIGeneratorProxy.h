/**
 * @class vtkSMVDIGeneratorProxy
 * @brief gives VolumetricDepthImage the colour map of its array
 *
 * When nobody has set LookupTable, the proxy takes ParaView's colour map for the chosen array, the one that a
 * representation would use, with its opacity function. A user who sets another one, or none after that, is
 * left alone. A map or opacity function that is still as ParaView made it, or holds a preset on [0, 1], gets
 * the range that the array has then, once; control points that somebody has set stay where they are.
 */
#ifndef vtkSMVDIGeneratorProxy_h
#define vtkSMVDIGeneratorProxy_h

#include <vtkSMSourceProxy.h>

#include <optional>
#include <string>

#include "vtkVolumetricDepthImagesModule.h"

class VTKVOLUMETRICDEPTHIMAGES_EXPORT vtkSMVDIGeneratorProxy : public vtkSMSourceProxy {
 public:
  static vtkSMVDIGeneratorProxy* New();
  vtkTypeMacro(vtkSMVDIGeneratorProxy, vtkSMSourceProxy);

  void UpdatePipeline() override;
  void UpdatePipeline(double time) override;

  /// For proxies behind it that are updated without it: writers, extractors, RenderVDI. Lets all generators
  /// upstream of `proxy` choose their maps. Collective where each rank has a client.
  static void PrepareUpstream(vtkSMProxy* proxy, std::optional<double> time);

 protected:
  vtkSMVDIGeneratorProxy() = default;
  ~vtkSMVDIGeneratorProxy() override = default;

 private:
  vtkSMVDIGeneratorProxy(const vtkSMVDIGeneratorProxy&) = delete;
  void operator=(const vtkSMVDIGeneratorProxy&) = delete;

  /// `time`: that of the update which is to come, if it has one.
  void ChooseLookupTable(std::optional<double> time);
  /// Of the input's array, over all ranks; false if there's none.
  bool RangeOfScalars(const char* name, int association, std::optional<double> time, double range[2]);

  std::string Chosen;  // the array whose map this proxy has set
};

#endif
