/**
 * @class vtkVDIReader
 * @brief reads a .vdi file
 *
 * Output as vtkVDIGenerator's: a vtkImageData with the flat picture and the VDI in field data, on rank 0;
 * empty elsewhere. docs/format.md describes the file. Series of files become time steps by
 * vtkFileSeriesReader.
 */
#ifndef vtkVDIReader_h
#define vtkVDIReader_h

#include <vtkImageAlgorithm.h>

#include <map>
#include <memory>
#include <string>
#include <utility>

#include "vtkVolumetricDepthImagesModule.h"

class VTKVOLUMETRICDEPTHIMAGES_EXPORT vtkVDIReader : public vtkImageAlgorithm {
 public:
  static vtkVDIReader* New();
  vtkTypeMacro(vtkVDIReader, vtkImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  vtkSetFilePathMacro(FileName);
  vtkGetFilePathMacro(FileName);

  /// 1 if the file starts as a .vdi file does.
  int CanReadFile(const char* name);

  /// Reads that file on another thread, so that it's there when it's asked for next, unless it has changed by
  /// then. One at a time: the one before is dropped, without waiting for it. On rank 0; elsewhere there's
  /// nothing to read.
  void Prefetch(const std::string& name);

  struct Announced {
    double Time = 0.0;
    int Width = 0;
    int Height = 0;
  };
  /// What's known of files by their names, so that they needn't be there to be announced, nor on all ranks.
  void SetSeries(std::map<std::string, Announced> series) { this->Series = std::move(series); }

 protected:
  vtkVDIReader();
  ~vtkVDIReader() override;

  vtkTypeBool ProcessRequest(vtkInformation* request, vtkInformationVector** inputs,
                             vtkInformationVector* outputs) override;
  int RequestInformation(vtkInformation*, vtkInformationVector**, vtkInformationVector*) override;
  int RequestData(vtkInformation*, vtkInformationVector**, vtkInformationVector*) override;

 private:
  vtkVDIReader(const vtkVDIReader&) = delete;
  void operator=(const vtkVDIReader&) = delete;

  struct Contents;
  struct Ahead;
  Contents Read();

  char* FileName = nullptr;
  std::unique_ptr<Ahead> Next;
  std::map<std::string, Announced> Series;
  std::string Said;  // of what went wrong last
};

#endif
