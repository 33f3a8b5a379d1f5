/**
 * @class vtkVDIWriter
 * @brief writes the VDI of its input as a .vdi file or as a page for browsers, or its picture as PNG
 *
 * A file whose name ends in .html gets a page with the VDI inside (vdi/page/Page.h), and one whose name ends
 * in .png gets the picture over Background.
 *
 * Input: the output of vtkVDIGenerator or vtkVDIReader; for pictures that of vtkVDIRenderer, too. The rank
 * that has the VDI writes, under a temporary name that is renamed when the file is whole; other ranks do
 * nothing.
 */
#ifndef vtkVDIWriter_h
#define vtkVDIWriter_h

#include <vtkWriter.h>

#include "vtkVolumetricDepthImagesModule.h"

class VTKVOLUMETRICDEPTHIMAGES_EXPORT vtkVDIWriter : public vtkWriter {
 public:
  static vtkVDIWriter* New();
  vtkTypeMacro(vtkVDIWriter, vtkWriter);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  vtkSetFilePathMacro(FileName);
  vtkGetFilePathMacro(FileName);

  /// The simulation's step, kept in the file; -1 (default): the VDI's own.
  vtkSetMacro(TimeStep, int);

  /// The background of pictures: red, green and blue from 0 to 1; default: black.
  vtkSetVector3Macro(Background, double);

 protected:
  vtkVDIWriter();
  ~vtkVDIWriter() override;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  void WriteData() override;

 private:
  vtkVDIWriter(const vtkVDIWriter&) = delete;
  void operator=(const vtkVDIWriter&) = delete;

  char* FileName = nullptr;
  int TimeStep = -1;
  double Background[3] = {0.0, 0.0, 0.0};
};

#endif
