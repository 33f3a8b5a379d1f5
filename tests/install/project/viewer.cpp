// A program in C++ on the library without VTK: makes a VDI of a small volume, writes and reads it,
// and renders it from another viewpoint. Its argument is the file. The adaptor's header is for C++
// too.
#include <vdi/io/VdiFile.h>
#include <vdi/pipeline/VdiGenerator.h>
#include <vdi/pipeline/VdiRenderer.h>
#include <vdi_catalyst.h>

#include <cstdio>
#include <exception>
#include <vector>

namespace {

int view(const char* path) {
  constexpr int n = 24;
  std::vector<float> values;
  for (int i = 0; i < n * n * n; ++i) values.push_back(static_cast<float>(i % n));
  const auto device = vdi::gpu::Device::create(vdi::gpu::requestFromEnvironment(0));
  vdi::VdiGenerator generator(device, vdi::comm::Communicator::serial());
  generator.setBlocks(
      {vdi::Block::fromPoints({n, n, n}, {}, glm::dvec3(1.0 / n), vdi::ScalarType::F32, values.data())});

  vdi::TransferFunction function;
  function.colors = {{0.0, {0.1, 0.3, 0.9}}, {n, {1.0, 0.4, 0.1}}};
  function.opacities = {{0.0, 0.0}, {n, 0.5}};
  function.unitDistance = 0.1;
  vdi::GenerateSettings settings;
  settings.width = 64;
  settings.height = 48;
  const auto camera = vdi::Camera::framing(generator.scene().bounds, {0.3, -0.2, -1.0}, {0.0, 1.0, 0.0});
  const auto made = generator.generate(camera, function, settings);
  if (!made) return 1;
  vdi::io::writeVdi(path, *made);

  vdi::VdiRenderer renderer(device);
  renderer.setVdi(vdi::io::readVdi(path));
  const vdi::Image image = renderer.render(camera.azimuth(10.0), 64, 48);
  for (const auto& pixel : image.rgba) {
    if (pixel.a > 0.5F) return vdi_catalyst_finalize(nullptr) == VDI_CATALYST_BAD_ARGUMENT ? 0 : 1;
  }
  std::fputs("FAILED: an empty picture\n", stderr);
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return argc > 1 ? view(argv[1]) : 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "FAILED: %s\n", error.what());
    return 1;
  }
}
