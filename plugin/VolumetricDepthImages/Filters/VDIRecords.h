// The events by which filters and writers report frames for a run's log.
//
// catalyst_adaptor observes both events on the global vtkMultiProcessController. Invoking them isn't
// collective. This header is free of VTK and MPI, as VDICollective.h is.
#ifndef VDIRecords_h
#define VDIRecords_h

#include <cstdint>
#include <span>
#include <string>

#include "vdi/pipeline/Reports.h"

namespace pv {

/// Call data of the event that a VolumetricDepthImage invokes after it has made a VDI or a picture.
struct FrameMade {
  static constexpr unsigned long event = 1000 + 5644;  // vtkCommand::UserEvent and any number

  const void* filter = nullptr;                   // the vtkVDIGenerator
  double seconds = 0.0;                           // duration of the filter's update on this rank
  std::span<const vdi::RankReport> reports = {};  // of all ranks, on the first one; otherwise empty
};

/// Call data of the event that a writer invokes on the rank that has the output, once it has written it.
struct OutputMade {
  static constexpr unsigned long event = 1000 + 5645;  // vtkCommand::UserEvent and any number

  const void* filter = nullptr;  // the vtkVDIGenerator upstream of the writer; null: unknown
  double seconds = 0.0;          // duration of writing
  std::string file = {};         // empty: the output was published to viewers
  std::uint64_t dropped = 0;     // frames that the stream has left out so far
};

}  // namespace pv

#endif
