/**
 * @class vtkVDIStreamReader
 * @brief the newest VDI that a server offers
 *
 * Output as vtkVDIReader's: a vtkImageData with the flat picture and the VDI in field data, on rank 0; empty
 * elsewhere. Before there is one, the image has no points and says why (pv::setWaiting). Rank 0 connects at
 * the first update (vdi/stream/Client.h) and receives and decodes on threads of its own; nothing here is
 * collective. A frame that has come is shown after Take.
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
  /// Of the connection, which the next update makes anew after a change.
  void SetURL(const char* url);      // without a token
  void SetToken(const char* token);  // "": that of TokenFile, or else of the environment
  void SetTokenFile(const char* file);
  void SetAuthority(const char* file);  // PEM: certificates to trust beside the system's
  ///@}

  /// Seconds that an update waits for a first VDI, no longer than the server can be reached.
  vtkSetClampMacro(Patience, double, 0.0, 3600.0);
  vtkGetMacro(Patience, double);

  ///@{
  /// Keep the VDI that is shown, in full if the rest of it comes, and let the server send nothing more. Where
  /// none is shown, the first one is kept. Makes nothing new by itself.
  void SetPause(bool pause);
  vtkGetMacro(Pause, bool);
  ///@}

  /// Shows the newest VDI that has come from the next update on, unless Pause is on.
  void Take();

  /// How many there have been of what Take may have an effect on: VDIs of all connections, failures for good
  /// and ends of Pause. Never decreases. 0 on other ranks.
  int GetArrivals();
  /// For the user, such as "127.0.0.1:8080: live", and "Shown: step 120, time 6" on a second line where a VDI
  /// is. Without the token.
  const char* GetConnection();

  /// Where the VDI shown was made from, as vtkVDIFileSeriesReader has it; zeros without one.
  vtkGetVectorMacro(Viewpoint, double, 12);
  /// What its colours mean: vdi::io::metadataText; empty where that is unknown.
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

  struct Frame;
  class Link;

  std::string URL;
  std::string Token;
  std::string TokenFile;
  std::string Authority;
  double Patience = 1.0;
  bool Pause = false;

  std::shared_ptr<Link> Connected;     // on rank 0, from the first update on
  std::shared_ptr<const Frame> Shown;  // null: none so far
  std::string Trouble;                 // why there can't be a connection
  int EarlierArrivals = 0;             // beside Connected's
  std::string Connection;
  pv::Failure Failure;
  double Viewpoint[12] = {};
  std::string Coloring;
};

#endif
