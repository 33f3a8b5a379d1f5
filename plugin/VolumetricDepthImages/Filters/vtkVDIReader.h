/**
 * @class vtkVDIReader
 * @brief reads a .vdi file
 *
 * The output is like vtkVDIGenerator's: a vtkImageData with the flat picture and the VDI in field data on
 * rank 0; empty on other ranks. docs/format.md describes the file. vtkVDIFileSeriesReader turns a series of
 * files into time steps.
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

  /// Returns 1 if the file starts as a .vdi file does.
  int CanReadFile(const char* name);

  /// Starts to read that file on another thread. The next read of this name takes the result, unless the file
  /// has changed by then. There is one prefetch at a time: a new one drops the last without waiting for it.
  /// Does nothing on ranks other than 0.
  void Prefetch(const std::string& name);

  struct Announced {
    double Time = 0.0;
    int Width = 0;
    int Height = 0;
  };
  /// Sets the facts about files by name, so that a file can be announced without being read, on all ranks.
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
  std::string Said;  // the last error's text
};

#endif
