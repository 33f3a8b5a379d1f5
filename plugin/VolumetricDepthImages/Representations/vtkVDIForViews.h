/**
 * @class vtkVDIForViews
 * @brief passes data on to what a view shows, and says upstream that they are for a view
 *
 * Each representation in a view updates its input by itself, the axes of a data set as well. vtkVDIGenerator
 * may have no VDI yet for those that needn't wait (vtkVDIGenerator::DeferViews), but for them alone.
 */
#ifndef vtkVDIForViews_h
#define vtkVDIForViews_h

#include <vtkPassInputTypeAlgorithm.h>
#include <vtkSmartPointer.h>

#include "vtkVolumetricDepthImagesRepresentationsModule.h"

class vtkVDIGenerator;

class VTKVOLUMETRICDEPTHIMAGESREPRESENTATIONS_EXPORT vtkVDIForViews : public vtkPassInputTypeAlgorithm {
 public:
  static vtkVDIForViews* New();
  vtkTypeMacro(vtkVDIForViews, vtkPassInputTypeAlgorithm);

  /// The filter upstream of an algorithm, which can make the VDI anew; null where there's none.
  static vtkVDIGenerator* GeneratorOf(vtkAlgorithm* algorithm);

  /// While it exists, that filter is updated for a view.
  class Bracket {
   public:
    explicit Bracket(vtkAlgorithm* algorithm);
    ~Bracket();
    Bracket(const Bracket&) = delete;
    Bracket& operator=(const Bracket&) = delete;

   private:
    vtkSmartPointer<vtkVDIGenerator> Generator;
  };

 protected:
  vtkVDIForViews() = default;
  ~vtkVDIForViews() override = default;

  vtkExecutive* CreateDefaultExecutive() override;
  int FillInputPortInformation(int port, vtkInformation* info) override;
  int RequestData(vtkInformation*, vtkInformationVector**, vtkInformationVector*) override;

 private:
  vtkVDIForViews(const vtkVDIForViews&) = delete;
  void operator=(const vtkVDIForViews&) = delete;
};

#endif
