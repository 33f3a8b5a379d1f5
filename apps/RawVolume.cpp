#include "apps/RawVolume.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>

#include "apps/JsonFile.h"
#include "vdi/core/ComponentValues.h"
#include "vdi/core/Error.h"
#include "vdi/io/Files.h"

namespace vdi::apps {

namespace {

constexpr double maxBytes = 9.0e18;  // the limit of file offsets

synthetic::Lattice readLattice(const JsonFile& sidecar) {
  synthetic::Lattice lattice;
  lattice.size = sidecar.positives("dims");
  try {
    lattice.type = scalarTypeFromString(sidecar.text("type"));
  } catch (const Error& error) {
    if (error.code() == ErrorCode::Format) throw;
    sidecar.fail(error.what());
  }
  if (sidecar.has("spacing")) lattice.spacing = sidecar.vector("spacing");
  if (sidecar.has("origin")) lattice.origin = sidecar.vector("origin");
  for (int axis = 0; axis < 3; ++axis) {
    if (!(lattice.spacing[axis] > 0.0)) sidecar.fail("each 'spacing' must be > 0");
  }
  const bool cells = sidecar.has("association") && sidecar.choice("association", {"point", "cell"}) == "cell";
  lattice.joint = cells ? synthetic::Joint::Cells : synthetic::Joint::SharedPoints;
  return lattice;
}

void requireSize(const JsonFile& sidecar, const RawVolume& volume) {
  const std::uint64_t bytes = io::InputFile(volume.data).size();
  const glm::dvec3 dims(volume.lattice.size);
  const double wanted = dims.x * dims.y * dims.z * static_cast<double>(sizeOf(volume.lattice.type)) +
                        static_cast<double>(volume.skip);
  if (wanted > maxBytes) sidecar.fail(fmt::format("'dims' and 'skip' ask for {:g} bytes", wanted));
  const glm::u64vec3 size(volume.lattice.size);
  const std::uint64_t expected = volume.skip + size.x * size.y * size.z * sizeOf(volume.lattice.type);
  if (bytes != expected) {
    sidecar.fail(fmt::format("the raw file has {} bytes, but the sidecar describes {}", bytes, expected));
  }
}

}  // namespace

RawVolume readSidecar(const std::filesystem::path& path) {
  const JsonFile sidecar(
      path, {"file", "dims", "type", "spacing", "origin", "endianness", "association", "skip", "missing"});
  RawVolume volume;
  volume.data = path.parent_path() / sidecar.text("file");
  volume.lattice = readLattice(sidecar);
  volume.bigEndian = sidecar.has("endianness") && sidecar.choice("endianness", {"little", "big"}) == "big";
  if (sidecar.has("skip")) volume.skip = sidecar.count("skip");
  if (sidecar.has("missing")) volume.missing = sidecar.numbers("missing");
  requireSize(sidecar, volume);
  return volume;
}

Block readPart(const RawVolume& volume, const synthetic::Part& part) {
  const std::size_t size = sizeOf(volume.lattice.type);
  const auto row = static_cast<std::size_t>(part.dims.x) * size;
  const std::size_t total =
      row * static_cast<std::size_t>(part.dims.y) * static_cast<std::size_t>(part.dims.z);
  const std::shared_ptr<std::byte[]> data(new std::byte[total]);
  const io::InputFile file(volume.data);
  std::byte* to = data.get();
  const glm::u64vec3 whole(volume.lattice.size);
  const glm::u64vec3 first(part.first);
  for (int z = 0; z < part.dims.z; ++z) {
    for (int y = 0; y < part.dims.y; ++y) {
      const std::uint64_t line =
          (first.z + static_cast<std::uint64_t>(z)) * whole.y + first.y + static_cast<std::uint64_t>(y);
      file.readInto(volume.skip + (line * whole.x + first.x) * size, {to, row});
      to += row;
    }
  }
  if (volume.bigEndian != (std::endian::native == std::endian::big)) {
    for (std::size_t i = 0; i < total; i += size) std::reverse(data.get() + i, data.get() + i + size);
  }
  Block block = synthetic::blockOf(volume.lattice, part, data);
  leaveOutMissing(block, volume.missing);
  return block;
}

}  // namespace vdi::apps
