/**
 * @class vtkVDIStreamWriter
 * @brief offers the VDI of its input to viewers over the network
 *
 * Input: the output of vtkVDIGenerator or vtkVDIReader. The rank that has the VDI starts a server
 * (vdi/stream/Server.h) when it writes for the first time, and ends it when this object goes; other ranks do
 * nothing. Writing copies the VDI and waits for neither its encoding nor a viewer.
 */
#ifndef vtkVDIStreamWriter_h
#define vtkVDIStreamWriter_h

#include <vtkWriter.h>

#include <memory>

#include "vtkVolumetricDepthImagesModule.h"

class VTKVOLUMETRICDEPTHIMAGES_EXPORT vtkVDIStreamWriter : public vtkWriter {
 public:
  static vtkVDIStreamWriter* New();
  vtkTypeMacro(vtkVDIStreamWriter, vtkWriter);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /// Of the server: changes count until it has started.
  vtkSetStringMacro(Host);  // whose address it listens at
  vtkGetStringMacro(Host);
  vtkSetMacro(Port, int);  // 0: one that is free
  vtkGetMacro(Port, int);
  vtkSetFilePathMacro(TokenFile);  // none: VDI_TOKEN of the environment, or a new token
  vtkGetFilePathMacro(TokenFile);
  vtkSetFilePathMacro(LinkFile);  // gets the link; none: no such file
  vtkGetFilePathMacro(LinkFile);
  vtkSetMacro(Rate, double);  // Mbit a second to each viewer; 0: no limit
  vtkGetMacro(Rate, double);
  vtkSetFilePathMacro(Certificate);  // PEM, with Key: TLS
  vtkGetFilePathMacro(Certificate);
  vtkSetFilePathMacro(Key);
  vtkGetFilePathMacro(Key);
  ///@}

  /// The simulation's step, for viewers; -1 (default): the VDI's own.
  vtkSetMacro(TimeStep, int);

 protected:
  vtkVDIStreamWriter();
  ~vtkVDIStreamWriter() override;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  void WriteData() override;

 private:
  vtkVDIStreamWriter(const vtkVDIStreamWriter&) = delete;
  void operator=(const vtkVDIStreamWriter&) = delete;

  void Start();

  char* Host = nullptr;
  int Port = 0;
  char* TokenFile = nullptr;
  char* LinkFile = nullptr;
  double Rate = 0.0;
  char* Certificate = nullptr;
  char* Key = nullptr;
  int TimeStep = -1;

  struct Service;
  std::unique_ptr<Service> Running;
};

#endif
