/**
 * @class vtkVDIForViews
 * @brief passes data on to the parts of a view, and tells the filter upstream that they are for a view
 *
 * Each representation in a view updates its input by itself, and so do the axes of a data set.
 * vtkVDIGenerator may give an earlier VDI to these consumers (vtkVDIGenerator::DeferViews), but to no others.
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

  /// The filter upstream of an algorithm that can make the VDI again; null if there is none.
  static vtkVDIGenerator* GeneratorOf(vtkAlgorithm* algorithm);

  /// While it exists, updates of that filter are for a view.
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
