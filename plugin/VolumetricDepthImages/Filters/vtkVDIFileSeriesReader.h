/**
 * @class vtkVDIFileSeriesReader
 * @brief reads .vdi files as the time steps of one series
 *
 * A step's time is the one in its file. Where two files have the same time, as those of one data set from
 * several viewpoints have, the steps are counted instead, from 0. A file that can't be read costs its own
 * step: it has the time that it had when it could be, or one between its neighbours'. Who goes from step to
 * step finds the next one read already. Information is collective: rank 0 reads the headers, all have their
 * times.
 */
#ifndef vtkVDIFileSeriesReader_h
#define vtkVDIFileSeriesReader_h

#include <vtkFileSeriesReader.h>

#include <memory>
#include <string>
#include <vector>

#include "vtkVolumetricDepthImagesModule.h"

class VTKVOLUMETRICDEPTHIMAGES_EXPORT vtkVDIFileSeriesReader : public vtkFileSeriesReader {
 public:
  static vtkVDIFileSeriesReader* New();
  vtkTypeMacro(vtkVDIFileSeriesReader, vtkFileSeriesReader);

  /// Where the first file that can be read was made from, after UpdateInformation: position, focal point,
  /// view-up, view angle, whether the projection is parallel, and parallel scale, as vtkCamera has them.
  /// Zeros if none can be read.
  vtkGetVectorMacro(Viewpoint, double, 12);

  /// What the colours of the VDI mean that was read last, or that the first file has: vdi::io::metadataText;
  /// empty where the file doesn't say. On rank 0.
  const char* GetColoring() const { return this->Coloring.c_str(); }

 protected:
  vtkVDIFileSeriesReader();
  ~vtkVDIFileSeriesReader() override;

  int RequestInformation(vtkInformation*, vtkInformationVector**, vtkInformationVector*) override;
  int RequestData(vtkInformation*, vtkInformationVector**, vtkInformationVector*) override;

 private:
  vtkVDIFileSeriesReader(const vtkVDIFileSeriesReader&) = delete;
  void operator=(const vtkVDIFileSeriesReader&) = delete;

  struct Header;
  struct Known;
  std::vector<Header> ReadHeaders();
  void ShareHeaders(std::vector<Header>& headers);

  std::unique_ptr<Known> Headers;  // of rank 0's files, from earlier
  double Viewpoint[12] = {};
  std::string Coloring;
  vtkIdType LastIndex = -1;  // of the file that was read last
  vtkIdType LastStep = 0;    // to it from the one before, in [0, count)
};

#endif
