/**
 * @class vtkVDIStreamWriter
 * @brief offers the VDI of its input to viewers over the network
 *
 * Input: the output of vtkVDIGenerator or vtkVDIReader. The rank that has the VDI starts a server
 * (vdi/stream/LiveStream.h) at the first write, and the destructor ends it; other ranks do nothing. Writing
 * copies the VDI and waits for neither its encoding nor a viewer.
 */
#ifndef vtkVDIStreamWriter_h
#define vtkVDIStreamWriter_h

#include <vtkWriter.h>

#include <chrono>
#include <memory>
#include <optional>

#include "vtkVolumetricDepthImagesModule.h"

#ifndef __VTK_WRAP__
namespace vdi::stream {
struct Controls;
class LiveStream;
struct SteeringRequest;
}  // namespace vdi::stream
#endif

class VTKVOLUMETRICDEPTHIMAGES_EXPORT vtkVDIStreamWriter : public vtkWriter {
 public:
  static vtkVDIStreamWriter* New();
  vtkTypeMacro(vtkVDIStreamWriter, vtkWriter);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /// Settings of the server. Changes after its start have no effect.
  vtkSetStringMacro(Host);  // the server listens on this host's address
  vtkGetStringMacro(Host);
  vtkSetMacro(Port, int);  // 0: a free port
  vtkGetMacro(Port, int);
  vtkSetFilePathMacro(TokenFile);  // none: VDI_TOKEN of the environment, or a new token
  vtkGetFilePathMacro(TokenFile);
  vtkSetFilePathMacro(LinkFile);  // gets the link; none: no such file
  vtkGetFilePathMacro(LinkFile);
  vtkSetStringMacro(Title);  // of the page and its tab
  vtkGetStringMacro(Title);
  vtkSetMacro(Rate, double);  // Mbit a second to each viewer; 0: no limit
  vtkGetMacro(Rate, double);
  vtkSetFilePathMacro(Certificate);  // PEM; with Key, the server uses TLS
  vtkGetFilePathMacro(Certificate);
  vtkSetFilePathMacro(Key);
  vtkGetFilePathMacro(Key);
  vtkSetStringMacro(Origins);  // of other sites whose pages may connect, with spaces between them
  vtkGetStringMacro(Origins);
  vtkSetStringMacro(EmbedIn);  // origins of sites whose pages may show the page in a frame, likewise
  vtkGetStringMacro(EmbedIn);
  // whether viewers may ask for changes, which an extractor carries out (VDISteering.h)
  vtkSetMacro(Steer, bool);
  vtkGetMacro(Steer, bool);
  ///@}

  vtkSetFilePathMacro(SteeringLog);  // gets a line of JSON for each change; none: no such file
  vtkGetFilePathMacro(SteeringLog);

  /// The simulation's step, for viewers; -1 (default): the VDI's own.
  vtkSetMacro(TimeStep, int);

#ifndef __VTK_WRAP__
  /// The viewers' request since the last call. Waits at most `patience`. Nullopt if there is none, before the
  /// server has started, and without Steer.
  std::optional<vdi::stream::SteeringRequest> TakeRequest(std::chrono::milliseconds patience);
  /// Tells viewers what they may ask for, and the values in force. Has no effect before the server has
  /// started.
  void SetControls(const vdi::stream::Controls& controls);
#endif

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
  char* Title = nullptr;
  double Rate = 0.0;
  char* Certificate = nullptr;
  char* Key = nullptr;
  char* Origins = nullptr;
  char* EmbedIn = nullptr;
  int TimeStep = -1;
  bool Steer = false;
  char* SteeringLog = nullptr;

  std::unique_ptr<vdi::stream::LiveStream> Running;
};

#endif
