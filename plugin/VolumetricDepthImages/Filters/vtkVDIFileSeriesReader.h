/**
 * @class vtkVDIFileSeriesReader
 * @brief reads .vdi files as the time steps of one series
 *
 * A step's time is the one in its file. If two files have the same time, as VDIs of one data set from several
 * viewpoints have, the reader counts the steps from 0 instead. A file that can't be read costs only its own
 * step. The step has the file's last known time, or a time between those of its neighbours. Once a caller
 * moves on by the same number of steps twice, the reader prefetches the next one. RequestInformation is
 * collective: rank 0 reads the headers, and all ranks get their times.
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

  /// The viewpoint of the first readable file, after UpdateInformation: position, focal point, view-up, view
  /// angle, whether the projection is parallel, and parallel scale, as vtkCamera has them. Zeros if no file
  /// is readable.
  vtkGetVectorMacro(Viewpoint, double, 12);

  /// The meaning of the colours (vdi::io::metadataText) of the VDI that was read last, or of the first file
  /// before that; empty if the file doesn't have it. On rank 0.
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

  std::unique_ptr<Known> Headers;  // headers that earlier reads found in rank 0's files
  double Viewpoint[12] = {};
  std::string Coloring;
  vtkIdType LastIndex = -1;  // index of the file that was read last
  vtkIdType LastStep = 0;    // difference of the last two indices, in [0, count)
};

#endif
