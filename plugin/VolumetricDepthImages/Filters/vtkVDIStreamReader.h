/**
 * @class vtkVDIStreamReader
 * @brief shows the newest VDI that a server offers
 *
 * The output is like vtkVDIReader's: a vtkImageData with the flat picture and the VDI in field data on rank
 * 0; empty on other ranks. Before the first VDI, the image has no points and gives the reason
 * (pv::setWaiting). Rank 0 connects at the first update (vdi/stream/Client.h), and receives and decodes on
 * threads of its own; nothing here is collective. The filter shows a new frame after Take.
 */
#ifndef vtkVDIStreamReader_h
#define vtkVDIStreamReader_h

#include <vtkImageAlgorithm.h>

#include <memory>
#include <string>

#include "VDIFailure.h"
#include "vtkVolumetricDepthImagesModule.h"

class VTKVOLUMETRICDEPTHIMAGES_EXPORT vtkVDIStreamReader : public vtkImageAlgorithm {
 public:
  static vtkVDIStreamReader* New();
  vtkTypeMacro(vtkVDIStreamReader, vtkImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /// Settings of the connection. After a change, the next update reconnects.
  void SetURL(const char* url);      // the link without its token
  void SetToken(const char* token);  // "": the token of TokenFile, or else of the environment
  void SetTokenFile(const char* file);
  void SetAuthority(const char* file);  // a PEM file of certificates to trust besides the system's
  ///@}

  /// The time in seconds that an update waits for the first VDI, as long as the server can be reached.
  vtkSetClampMacro(Patience, double, 0.0, 3600.0);
  vtkGetMacro(Patience, double);

  ///@{
  /// Keeps the shown VDI, in full if its finer levels still arrive, and stops the server from sending more.
  /// If none is shown, the first one to arrive is kept. A call starts no update.
  void SetPause(bool pause);
  vtkGetMacro(Pause, bool);
  ///@}

  /// Makes the next update show the newest VDI, unless Pause is on.
  void Take();

  /// The number of events after which Take may change the output: VDIs of all connections, final failures and
  /// ends of Pause. It never decreases, and is 0 on other ranks.
  int GetArrivals();
  /// The state of the connection for the user, such as "127.0.0.1:8080: live", and "Shown: step 120, time 6"
  /// on a second line if there is a VDI. It has no token.
  const char* GetConnection();

  /// The viewpoint of the shown VDI, as in vtkVDIFileSeriesReader; zeros without one.
  vtkGetVectorMacro(Viewpoint, double, 12);
  /// The meaning of its colours (vdi::io::metadataText); empty if it is unknown.
  const char* GetColoring() const { return this->Coloring.c_str(); }

 protected:
  vtkVDIStreamReader();
  ~vtkVDIStreamReader() override;

  vtkTypeBool ProcessRequest(vtkInformation* request, vtkInformationVector** inputs,
                             vtkInformationVector* outputs) override;
  int RequestInformation(vtkInformation*, vtkInformationVector**, vtkInformationVector*) override;
  int RequestData(vtkInformation*, vtkInformationVector**, vtkInformationVector*) override;

 private:
  vtkVDIStreamReader(const vtkVDIStreamReader&) = delete;
  void operator=(const vtkVDIStreamReader&) = delete;

  void Change(std::string& setting, const char* text);
  void Connect();

  struct ReceivedVdi;
  class Link;

  std::string URL;
  std::string Token;
  std::string TokenFile;
  std::string Authority;
  double Patience = 1.0;
  bool Pause = false;

  std::shared_ptr<Link> Connected;           // on rank 0, from the first update on
  std::shared_ptr<const ReceivedVdi> Shown;  // null before the first VDI
  std::string Trouble;                       // reason why there can't be a connection
  int EarlierArrivals = 0;                   // arrivals on earlier connections, and ends of Pause
  std::string Connection;
  pv::Failure Failure;
  double Viewpoint[12] = {};
  std::string Coloring;
};

#endif
