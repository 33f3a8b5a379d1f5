// The sink that writes a VDI into a file; each rank writes its own lists. Not part of the library's
// interface.
#pragma once

#include <filesystem>
#include <optional>

#include "vdi/pipeline/BandDownload.h"
#include "vdi/pipeline/Stages.h"
#include "vdi/pipeline/VdiSink.h"
#include "vdi/pipeline/VdiWriter.h"

namespace vdi::detail {

/// The host encodes a band while the device makes the next one.
template <typename Segment>
class FileSink final : public VdiSink {
 public:
  /// All arguments must outlive it.
  FileSink(const comm::Communicator& comm, int root, const std::filesystem::path& path,
           BandDownload& download)
      : comm_(comm), root_(root), path_(path), download_(download) {}

  void begin(const Vdi& header) override { writer_.emplace(comm_, root_, path_, header); }
  gpu::Submission add(const Band& band, const Wait& wait, RankReport& report) override {
    comm_.together([&] {
      Stopwatch watch;
      wait();
      report.compositeSeconds += watch.lap();
      if (band.lists.listCount > 0) writer_->add(band.firstList, download_.template get<Segment>(band.lists));
      report.outputSeconds += watch.lap();
    });
    return {};
  }
  void finish(RankReport& report) override {
    Stopwatch watch;
    written_ = writer_->finish();
    report.outputSeconds += watch.lap();
    report.bytesSent += writer_->bytesSent();
    report.bytesWritten = writer_->bytesWritten();
  }

  const WrittenVdi& written() const { return written_; }  // after finish

 private:
  const comm::Communicator& comm_;
  int root_;
  const std::filesystem::path& path_;
  BandDownload& download_;
  std::optional<VdiWriter<Segment>> writer_;
  WrittenVdi written_;
};

}  // namespace vdi::detail
