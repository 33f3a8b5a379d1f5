// The threads that serve a view, without ParaView: loading a VDI, making a still picture, reading a file
// ahead, and receiving a stream. ParaView's programs can't run under ThreadSanitizer, and these tests can.
#include <vtkCamera.h>
#include <vtkFieldData.h>
#include <vtkMatrix4x4.h>
#include <vtkNew.h>
#include <vtkPolyData.h>
#include <vtkSmartPointer.h>
#include <vtkUnsignedIntArray.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <exception>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "plugin/VolumetricDepthImages/Filters/VDIImageData.h"
#include "plugin/VolumetricDepthImages/Filters/VDISession.h"
#include "plugin/VolumetricDepthImages/Filters/vtkVDIImageData.h"
#include "plugin/VolumetricDepthImages/Filters/vtkVDIReader.h"
#include "plugin/VolumetricDepthImages/Filters/vtkVDIStreamReader.h"
#include "plugin/VolumetricDepthImages/Representations/VDIBuffers.h"
#include "plugin/VolumetricDepthImages/Representations/VDIPiece.h"
#include "tests/Catch.h"
#include "tests/TemporaryFolder.h"
#include "tests/io/Samples.h"
#include "vdi/io/VdiFile.h"
#include "vdi/stream/Publisher.h"
#include "vdi/stream/Server.h"
#include "vdi/stream/Token.h"

namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

vdi::Vdi vdiOfStep(std::uint64_t step) {
  vdi::Vdi vdi = vdi::test::noisyVdi(80, 60, 8, step + 1);
  vdi.timeStep = step;
  return vdi;
}

vtkSmartPointer<vtkPolyData> pieceOf(const vdi::Vdi& vdi) {
  vtkNew<vtkVDIImageData> image;
  pv::setVdi(image, vdi);
  auto piece = vtkSmartPointer<vtkPolyData>::New();
  pv::packVdi(image, false, piece);
  return piece;
}

/// A VDI's own view, at another size, as VTK's camera gives it.
pv::StillView stillOf(const vdi::Vdi& vdi, const glm::ivec2& size) {
  vtkNew<vtkCamera> camera;
  const vdi::Camera& own = vdi.camera;
  camera->SetPosition(own.position.x, own.position.y, own.position.z);
  camera->SetFocalPoint(own.focalPoint.x, own.focalPoint.y, own.focalPoint.z);
  camera->SetViewUp(own.viewUp.x, own.viewUp.y, own.viewUp.z);
  camera->SetViewAngle(own.viewAngle);
  camera->SetClippingRange(0.1, 100.0);
  vtkNew<vtkMatrix4x4> worldToView;
  worldToView->DeepCopy(camera->GetModelViewTransformMatrix());
  worldToView->Transpose();
  vtkNew<vtkMatrix4x4> viewToClip;
  viewToClip->DeepCopy(camera->GetProjectionTransformMatrix(
      static_cast<double>(size.x) / static_cast<double>(size.y), -1.0, 1.0));
  viewToClip->Transpose();
  const auto pixels = static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y);
  return {pv::ViewMatrices(worldToView, viewToClip),
          size,
          vdi::defaultReconstruction,
          {},
          std::vector<float>(pixels, 1.0F)};
}

std::vector<glm::u8vec4> pictureOf(vdi::VdiRenderer& renderer, const pv::StillView& view) {
  const vdi::ImageBytes picture = renderer.renderBytes(view.matrices.view(view.size.x, view.size.y), {},
                                                       vdi::Alpha::Premultiplied, view.reconstruction);
  return {picture.rgba.begin(), picture.rgba.end()};
}

int largestDifference(const std::vector<glm::u8vec4>& one, const std::vector<glm::u8vec4>& other) {
  REQUIRE(one.size() == other.size());
  int largest = 0;
  for (std::size_t i = 0; i < one.size(); ++i) {
    for (int channel = 0; channel < 4; ++channel)
      largest = std::max(largest, std::abs(int{one[i][channel]} - int{other[i][channel]}));
  }
  return largest;
}

/// Updates the source, and returns the number of supersegments in its output; 0 without a VDI.
unsigned int supersegmentsOf(vtkImageAlgorithm* source) {
  source->Update();
  auto* const offsets = vtkUnsignedIntArray::SafeDownCast(
      source->GetOutputDataObject(0)->GetFieldData()->GetAbstractArray("VDI.offsets"));
  return offsets != nullptr ? offsets->GetValue(offsets->GetNumberOfValues() - 1) : 0;
}

}  // namespace

TEST_CASE("a view draws while VDIs are loaded and a still picture is made") {
  pv::VDIBuffers buffers;
  const glm::ivec2 size(160, 120);
  constexpr std::uint64_t steps = 12;
  const std::uint64_t version = buffers.version();
  for (std::uint64_t step = 0; step < steps; ++step) {
    const vdi::Vdi vdi = vdiOfStep(step);
    buffers.load(pieceOf(vdi));
    buffers.take(step % 3 == 0 ? 1ms : 30ms);
    if (!buffers.hasVdi()) continue;
    const pv::StillView view = stillOf(vdi, size);
    buffers.still().start(buffers.renderer(), view);
    CHECK(buffers.still().isOf(view));
    if (step % 4 == 1) buffers.still().rest();
    if (step % 2 == 0) std::this_thread::sleep_for(5ms);
    if (step % 3 == 2) CHECK(buffers.still().picture().size() == view.window.size());
    buffers.still().drop();
    pictureOf(buffers.renderer(), view);
  }
  const vdi::Vdi last = vdiOfStep(steps);
  buffers.load(pieceOf(last));
  while (buffers.isLoading()) buffers.take(100ms);
  REQUIRE(buffers.hasVdi());
  CHECK(buffers.version() > version);

  const pv::StillView view = stillOf(last, size);
  buffers.still().start(buffers.renderer(), view);
  const auto made = buffers.still().picture();
  const std::vector<glm::u8vec4> still(made.begin(), made.end());
  vdi::VdiRenderer fresh(pv::sharedDevice(0));
  fresh.setVdi(last);
  CHECK(largestDifference(still, pictureOf(fresh, view)) <= 1);  // a strip's rays are rounded otherwise
  CHECK(std::any_of(still.begin(), still.end(), [](const glm::u8vec4& pixel) { return pixel.a > 0; }));
  buffers.still().start(buffers.renderer(), view);  // destroyed while it works
}

TEST_CASE("a piece with a problem leaves no load behind, and the next VDI shows") {
  pv::VDIBuffers buffers;
  for (int round = 0; round < 5; ++round) {
    buffers.load(pieceOf(vdiOfStep(1)));
    vtkNew<vtkPolyData> problem;
    pv::packProblem("no VDI", problem);
    buffers.load(problem);
    bool hasFailed = false;
    while (buffers.isLoading()) {
      try {
        buffers.take(100ms);
      } catch (const std::exception&) {
        hasFailed = true;
      }
    }
    CHECK(hasFailed);
    CHECK_FALSE(buffers.hasVdi());
    buffers.load(pieceOf(vdiOfStep(2)));
    while (buffers.isLoading()) buffers.take(100ms);
    CHECK(buffers.hasVdi());
    if (round % 2 == 0) buffers.clear();
  }
}

TEST_CASE("a piece with the VDI of the last one loads nothing, unless that load failed") {
  pv::VDIBuffers buffers;
  const vtkSmartPointer<vtkPolyData> piece = pieceOf(vdiOfStep(1));
  buffers.load(piece);
  while (buffers.isLoading()) buffers.take(100ms);
  REQUIRE(buffers.hasVdi());
  const std::uint64_t version = buffers.version();
  // While the next VDI is made, the same arrays come in another data object, with a mark or other values.
  vtkNew<vtkPolyData> again;
  again->ShallowCopy(piece);
  pv::markFiltered(again);
  buffers.load(again);
  CHECK_FALSE(buffers.isLoading());
  CHECK(buffers.version() == version);

  buffers.load(pieceOf(vdiOfStep(2)));
  buffers.load(piece);  // replaces the one that waits
  while (buffers.isLoading()) buffers.take(100ms);
  CHECK(buffers.version() > version);

  vtkNew<vtkPolyData> problem;
  pv::packProblem("no VDI", problem);
  for (int round = 0; round < 2; ++round) {
    buffers.load(problem);
    CHECK(buffers.isLoading());
    CHECK_THROWS(buffers.take(std::chrono::seconds(60)));
  }
  buffers.load(piece);
  while (buffers.isLoading()) buffers.take(100ms);
  CHECK(buffers.hasVdi());
  buffers.clear();
  buffers.load(piece);
  while (buffers.isLoading()) buffers.take(100ms);
  CHECK(buffers.hasVdi());
}

TEST_CASE("buffers that are given back don't wait for a load") {
  const vtkSmartPointer<vtkPolyData> piece = pieceOf(vdi::test::noisyVdi(640, 480, 10, 1));
  const vtkSmartPointer<vtkPolyData> other = pieceOf(vdi::test::noisyVdi(640, 480, 10, 2));
  pv::VDIBuffers buffers;
  buffers.load(other);  // the first load opens the device
  while (buffers.isLoading()) buffers.take(100ms);
  REQUIRE(buffers.hasVdi());
  buffers.load(piece);
  Clock::time_point start = Clock::now();
  while (buffers.isLoading()) buffers.take(100ms);
  const Clock::duration loading = Clock::now() - start;

  buffers.load(other);
  start = Clock::now();
  buffers.clear();
  CHECK(Clock::now() - start < loading / 4);
  CHECK_FALSE(buffers.hasVdi());
  CHECK_FALSE(buffers.isLoading());

  // The next VDI doesn't wait for the one that nobody wants.
  buffers.load(pieceOf(vdiOfStep(1)));
  while (buffers.isLoading()) buffers.take(100ms);
  CHECK(buffers.hasVdi());

  auto deleted = std::make_unique<pv::VDIBuffers>();
  deleted->load(piece);
  start = Clock::now();
  deleted.reset();
  CHECK(Clock::now() - start < loading / 4);
}

TEST_CASE("files are read ahead, also ones that nobody asks for") {
  const vdi::test::TemporaryFolder folder;
  std::vector<std::string> names;
  std::vector<std::size_t> counts;
  for (std::uint64_t step = 0; step < 4; ++step) {
    const vdi::Vdi vdi = vdiOfStep(step);
    names.push_back((folder.path() / ("step_" + std::to_string(step) + ".vdi")).string());
    counts.push_back(vdi.supersegmentCount());
    vdi::io::writeVdi(names.back(), vdi);
  }
  for (int round = 0; round < 3; ++round) {
    vtkNew<vtkVDIReader> reader;
    for (std::size_t step = 0; step < names.size(); ++step) {
      reader->SetFileName(names[step].c_str());
      CHECK(supersegmentsOf(reader) == counts[step]);
      reader->Prefetch(names[(step + 1) % names.size()]);
      if (step == 1) reader->Prefetch((folder.path() / "none.vdi").string());
    }
  }  // each reader leaves a file that is being read
}

TEST_CASE("a source shows what a stream brings, pauses, and connects anew") {
  vdi::stream::ServerOptions options;
  options.token = vdi::stream::randomToken();
  vdi::stream::Server server(options);
  vtkNew<vtkVDIStreamReader> source;
  {
    vdi::stream::Publisher publisher(server);
    publisher.publish(std::make_shared<const vdi::Vdi>(vdiOfStep(0)));
    source->SetURL(server.link().c_str());
    source->SetPatience(60);
    CHECK(supersegmentsOf(source) == vdiOfStep(0).supersegmentCount());
    for (std::uint64_t step = 1; step < 10; ++step) {
      source->SetPause(step % 4 == 3);
      publisher.publish(std::make_shared<const vdi::Vdi>(vdiOfStep(step)));
      source->Take();
      CHECK(supersegmentsOf(source) > 0);
      CHECK(std::string(source->GetConnection()).find("live") != std::string::npos);
      if (step == 5) {
        source->SetURL("");
        source->SetURL(server.link().c_str());
      }
      std::this_thread::sleep_for(20ms);
    }
    source->SetPause(false);
  }
  // The publisher has handed over the last VDI.
  const std::size_t expected = vdiOfStep(9).supersegmentCount();
  const Clock::time_point end = Clock::now() + 60s;
  while (supersegmentsOf(source) != expected && Clock::now() < end) {
    std::this_thread::sleep_for(20ms);
    source->Take();
  }
  CHECK(supersegmentsOf(source) == expected);
}
