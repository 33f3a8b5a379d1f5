#include "vtkVDIStreamReader.h"

#include <fmt/format.h>
#include <vtkDemandDrivenPipeline.h>
#include <vtkDoubleArray.h>
#include <vtkFieldData.h>
#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkInformationVector.h>
#include <vtkObjectFactory.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "VDIImageData.h"
#include "VDIRetire.h"
#include "VDISession.h"
#include "VDIValues.h"
#include "vdi/core/Error.h"
#include "vdi/core/Flatten.h"
#include "vdi/io/Metadata.h"
#include "vdi/io/VdiFile.h"
#include "vdi/stream/Client.h"
#include "vdi/stream/GivenToken.h"
#include "vdi/stream/Url.h"
#include "vtkVDIImageData.h"

vtkStandardNewMacro(vtkVDIStreamReader);

namespace {

const char* nameOf(vdi::stream::Phase phase) {
  switch (phase) {
    case vdi::stream::Phase::Waiting:
      return "waiting for a first VDI";
    case vdi::stream::Phase::Live:
      return "live";
    case vdi::stream::Phase::Ended:
      return "ended";
  }
  return "";
}

}  // namespace

/// A received VDI with its flat picture.
struct vtkVDIStreamReader::ReceivedVdi {
  vdi::Vdi Vdi;
  vdi::Image Flat;
  std::string Session;       // the server's session
  std::uint32_t Number = 0;  // the frame's number in the session
  bool IsFull = false;       // true if no finer level follows

  ReceivedVdi(vdi::stream::Received&& received)
      : Vdi(received.decode()),
        Flat(vdi::flatten(this->Vdi)),
        Session(received.session),
        Number(received.level.frame),
        IsFull(received.level.level + 1 == received.level.levels) {}

  /// Whether both are the same VDI, at any level.
  bool IsSameAs(const ReceivedVdi& other) const {
    return this->Session == other.Session && this->Number == other.Number;
  }
};

/// A connection, and a thread that decodes the received frames. It makes no VTK object.
class vtkVDIStreamReader::Link {
 public:
  explicit Link(vdi::stream::ClientOptions options)
      : Authority(options.url.authority()), Client(std::move(options)), Worker([this] { this->Work(); }) {}

  ~Link() {
    this->IsEnding = true;
    this->Worker.join();
  }
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;

  /// The newest received VDI; null before the first.
  std::shared_ptr<const ReceivedVdi> Newest() const {
    const std::scoped_lock lock(this->Mutex);
    return this->Last;
  }

  /// Waits until a whole VDI has arrived or none can arrive any more, for `seconds` at most.
  void WaitForFirst(double seconds) const {
    std::unique_lock lock(this->Mutex);
    this->Changed.wait_for(lock, std::chrono::duration<double>(seconds),
                           [this] { return (this->Last && this->Last->IsFull) || !this->Failed.empty(); });
  }

  int Arrivals() const {
    const std::scoped_lock lock(this->Mutex);
    return this->Count;
  }

  /// The reason why retrying is useless; empty while the client retries.
  std::string Failure() const {
    const std::scoped_lock lock(this->Mutex);
    return this->Failed;
  }

  /// A pause stops the server once the newest VDI is whole, or once a level of another frame has arrived.
  void SetPause(bool pause) {
    const std::scoped_lock lock(this->Mutex);
    this->IsPaused = pause;
    if (!pause) {
      this->Client.resume();
    } else if (this->Last && this->Last->IsFull) {
      this->Client.pause();
    }
  }

  std::string Line() const {
    const std::scoped_lock lock(this->Mutex);
    if (!this->Failed.empty()) return this->Failed;
    const vdi::stream::Client::Standing standing = this->Client.standing();
    std::string line = this->Authority + ": ";
    if (standing.isConnected) {
      line += nameOf(standing.state.phase);
      if (standing.hasState && !standing.state.cause.empty()) line += "; " + standing.state.cause;
    } else if (standing.trouble.empty()) {
      line += "connecting";
    } else {
      line += standing.trouble + "; trying again";
    }
    return this->Damaged.empty() ? line : line + "; the last VDI is damaged: " + this->Damaged;
  }

 private:
  void Work() {
    constexpr std::chrono::milliseconds look{50};
    while (!this->IsEnding) {
      try {
        std::optional<vdi::stream::Received> received = this->Client.next(look);
        if (received && received->missing.empty()) this->Keep(*std::move(received));
      } catch (const std::exception& error) {
        const std::scoped_lock lock(this->Mutex);
        this->Failed = error.what();
        ++this->Count;
        this->Changed.notify_all();
        return;
      }
    }
  }

  /// Keeps a received VDI. A damaged one costs only its own frame.
  void Keep(vdi::stream::Received received) {
    std::shared_ptr<const ReceivedVdi> frame;
    std::string damage;
    try {
      frame = std::make_shared<const ReceivedVdi>(std::move(received));
    } catch (const vdi::Error& error) {
      damage = error.what();
    }
    const std::scoped_lock lock(this->Mutex);
    this->Damaged = damage;
    if (!frame) return;
    const bool isEnough = frame->IsFull || (this->Last && !frame->IsSameAs(*this->Last));
    if (this->IsPaused && isEnough) this->Client.pause();
    this->Last = std::move(frame);
    ++this->Count;
    this->Changed.notify_all();
  }

  const std::string Authority;
  mutable std::mutex Mutex;  // guards the members up to IsPaused
  mutable std::condition_variable Changed;
  std::shared_ptr<const ReceivedVdi> Last;
  std::string Failed;
  std::string Damaged;  // reason why the newest VDI can't be shown
  int Count = 0;
  bool IsPaused = false;
  std::atomic<bool> IsEnding = false;
  vdi::stream::Client Client;
  std::thread Worker;
};

vtkVDIStreamReader::vtkVDIStreamReader() {
  this->SetNumberOfInputPorts(0);
}

vtkVDIStreamReader::~vtkVDIStreamReader() {
  if (this->Connected) pv::retire(std::move(this->Connected));
}

void vtkVDIStreamReader::PrintSelf(ostream& os, vtkIndent indent) {
  this->Superclass::PrintSelf(os, indent);
  os << indent << "URL: " << this->URL << "\n" << indent << "Pause: " << this->Pause << "\n";
}

void vtkVDIStreamReader::Change(std::string& setting, const char* text) {
  const std::string value = text != nullptr ? text : "";
  if (setting == value) return;
  setting = value;
  if (this->Connected) {
    this->EarlierArrivals += this->Connected->Arrivals();
    pv::retire(std::move(this->Connected));
  }
  this->Connected.reset();
  this->Shown.reset();
  this->Trouble.clear();
  this->Modified();
}

void vtkVDIStreamReader::SetURL(const char* url) {
  this->Change(this->URL, url);
}

void vtkVDIStreamReader::SetToken(const char* token) {
  this->Change(this->Token, token);
}

void vtkVDIStreamReader::SetTokenFile(const char* file) {
  this->Change(this->TokenFile, file);
}

void vtkVDIStreamReader::SetAuthority(const char* file) {
  this->Change(this->Authority, file);
}

void vtkVDIStreamReader::SetPause(bool pause) {
  if (this->Pause == pause) return;
  this->Pause = pause;
  if (!this->Connected) return;
  this->Connected->SetPause(pause);
  if (!pause) ++this->EarlierArrivals;  // the pause may have kept out a VDI, which Take can show now
}

void vtkVDIStreamReader::Take() {
  if (!this->Connected) return;
  std::shared_ptr<const ReceivedVdi> newest = this->Connected->Newest();
  if (this->Pause && this->Shown && !newest->IsSameAs(*this->Shown)) newest = this->Shown;
  const std::string failure = this->Connected->Failure();
  if (newest == this->Shown && failure == this->Trouble) return;
  this->Shown = std::move(newest);
  this->Trouble = failure;
  this->Modified();
}

int vtkVDIStreamReader::GetArrivals() {
  return this->EarlierArrivals + (this->Connected ? this->Connected->Arrivals() : 0);
}

const char* vtkVDIStreamReader::GetConnection() {
  this->Connection = this->Connected ? this->Connected->Line() : this->Trouble;
  if (this->Shown && this->Connected)
    this->Connection += fmt::format("\nShown: step {}, time {:g}{}", this->Shown->Vdi.timeStep,
                                    this->Shown->Vdi.time, this->Shown->IsFull ? "" : ", coarse");
  return this->Connection.c_str();
}

/// Connects, or puts the reason why it can't into Trouble.
void vtkVDIStreamReader::Connect() {
  this->Trouble.clear();
  try {
    if (this->URL.empty())
      throw vdi::Error(vdi::ErrorCode::InvalidArgument, "no URL was given: paste the server's link");
    vdi::stream::ClientOptions options;
    options.url = vdi::stream::parseUrl(this->URL);
    if (options.url.token.empty()) options.url.token = this->Token;
    if (options.url.token.empty()) options.url.token = vdi::stream::givenToken(this->TokenFile);
    if (options.url.token.empty())
      throw vdi::Error(vdi::ErrorCode::InvalidArgument,
                       "the token is missing: paste the server's link as URL, or set Token File",
                       options.url.authority());
    options.authority = this->Authority;
    options.decodes = true;
    this->Connected = std::make_shared<Link>(std::move(options));
    if (this->Pause) this->Connected->SetPause(true);
  } catch (const std::exception& error) {
    this->Trouble = error.what();
  }
}

vtkTypeBool vtkVDIStreamReader::ProcessRequest(vtkInformation* request, vtkInformationVector** inputs,
                                               vtkInformationVector* outputs) {
  if (request->Has(vtkDemandDrivenPipeline::REQUEST_DATA_OBJECT())) {
    vtkVDIImageData::MakeOutput(outputs);
    return 1;
  }
  return this->Superclass::ProcessRequest(request, inputs, outputs);
}

int vtkVDIStreamReader::RequestInformation(vtkInformation*, vtkInformationVector**,
                                           vtkInformationVector* outputs) {
  if (pv::isRoot() && !this->Connected) {
    this->Connect();
    if (this->Connected) {
      this->Connected->WaitForFirst(this->Patience);
      this->Shown = this->Connected->Newest();
      this->Trouble = this->Connected->Failure();
    }
  }
  int extent[6] = {0, -1, 0, -1, 0, -1};
  if (this->Shown) {
    const glm::ivec2 size = this->Shown->Vdi.pictureSize();
    extent[1] = size.x - 1;
    extent[3] = size.y - 1;
    extent[5] = 0;
  }
  pv::announcePicture(outputs->GetInformationObject(0), extent);
  return 1;
}

int vtkVDIStreamReader::RequestData(vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs) {
  vtkImageData* output = vtkImageData::GetData(outputs);
  output->Initialize();
  if (!pv::isRoot()) return 1;
  if (this->Trouble.empty()) {
    this->Failure.isOver();
  } else if (this->Failure.isNew(this, this->Trouble)) {
    vtkErrorMacro(<< this->Trouble);
  }
  this->Coloring.clear();
  std::fill_n(this->Viewpoint, 12, 0.0);
  if (!this->Shown) {
    pv::setWaiting(output, this->Trouble.empty() ? this->Connected->Line() : this->Trouble);
    return 1;
  }
  const vdi::Vdi& vdi = this->Shown->Vdi;
  pv::setVdi(output, vdi, this->Shown->Flat);
  if (vdi.coloring) {
    this->Coloring = vdi::io::metadataText(*vdi.coloring, vdi.time, vdi.timeStep);
    pv::setShownRange(output, *vdi.coloring);
  }
  auto* camera = vtkDoubleArray::SafeDownCast(output->GetFieldData()->GetAbstractArray("VDI.camera"));
  if (camera != nullptr && camera->GetNumberOfValues() == 12)
    std::copy_n(camera->GetPointer(0), 12, this->Viewpoint);
  output->GetInformation()->Set(vtkDataObject::DATA_TIME_STEP(), vdi.time);
  return 1;
}
