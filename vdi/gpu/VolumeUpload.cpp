#include "vdi/gpu/VolumeUpload.h"

#include <algorithm>
#include <cmath>
#include <condition_variable>
#include <cstring>
#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <tuple>
#include <utility>

#include "shaders/shared/cast.h"
#include "shaders/shared/cells.h"
#include "shaders/shared/place.h"
#include "vdi/core/BitCast.h"
#include "vdi/core/Error.h"
#include "vdi/core/Parallel.h"

namespace vdi::gpu {

namespace {

constexpr std::uint64_t slotBytes = 32ULL << 20;
constexpr std::size_t maxSlots = 4;  // both the host and the device have memory for each

/// Below this size, importing memory takes longer than copying it.
constexpr std::uint64_t minImport = 1ULL << 20;

/// Each import takes one of a device's allocations, at least 4096 in all.
constexpr std::size_t maxImports = 256;

/// Below this number of cores, copying values takes longer than pinning their pages.
constexpr std::size_t coresThatCopyFaster = 2;

/// Makes infinite texels finite: they would turn what is interpolated with them into NaN, even with weight 0.
/// Values that are never interpolated may lie beyond a float's range.
template <typename Value>
float filterable(Value texel) {
  const auto infinite = bit_cast<float>(shared::infiniteTexelBits);
  const bool tooLarge = std::abs(texel) > static_cast<Value>(std::numeric_limits<float>::max());
  return tooLarge ? std::copysign(infinite, texel < 0 ? -1.0F : 1.0F) : static_cast<float>(texel);
}

ComputePipelineInfo placeInfo() {
  ComputePipelineInfo info = infoOf<shared::PlaceConstants>("place");
  info.imageCount = shared::castMaxPages;
  info.storeCount = shared::castMaxPages;
  return info;
}

/// Whether some of the stored values in `part` of a block of f32 are infinite.
bool anyInfinite(const Block& block, const IndexBox& part) {
  const Tiling tiles = block.tilesOf(part);
  TileBuffer buffer;
  for (std::size_t i = 0; i < tiles.count(); ++i) {
    const IndexBox tile = tiles[i];
    block.copyTo(tile, buffer.bytes.data());
    bool found = false;
    for (const float value : std::span(reinterpret_cast<const float*>(buffer.bytes.data()), tile.count()))
      found |= std::isinf(value);
    if (found) return true;
  }
  return false;
}

/// The distance between rows in values, and between slices in rows.
struct Pitches {
  int row = 0;
  int rows = 0;
};

/// The block's pitches; nullopt if its values don't lie in rows and slices that a device can copy.
std::optional<Pitches> pitchesOf(const Block& block) {
  if (block.isPacked()) return Pitches{block.dims.x, block.dims.y};
  if (block.computed) return std::nullopt;
  const ByteStrides& strides = *block.strides;
  const auto bytes = static_cast<std::int64_t>(sizeOf(block.type));
  constexpr std::int64_t most = 1 << 30;
  if (strides.x != bytes || strides.y % bytes != 0 || strides.y < bytes * block.dims.x ||
      strides.y / bytes > most || strides.z % strides.y != 0 || strides.z / strides.y < block.dims.y ||
      strides.z / strides.y > most)
    return std::nullopt;
  return Pitches{static_cast<int>(strides.y / bytes), static_cast<int>(strides.z / strides.y)};
}

/// Converts `count` values to texels. The unsigned integer formats shift signed values up. The float format
/// is relative to the block's range, except for f32, which is stored unchanged unless it is infinite.
template <typename From, typename To, typename Convert>
void convertRow(const void* from, std::size_t first, std::size_t count, std::byte* to, Convert convert) {
  const auto* values = static_cast<const From*>(from) + first;
  auto* texels = reinterpret_cast<To*>(to);
  for (std::size_t i = 0; i < count; ++i) texels[i] = convert(values[i]);
}

/// Writes `count` values, from number `first` of the array `data` on.
void writeRow(ScalarType type, const void* data, VkFormat format, const ValueMap& values, std::size_t first,
              std::size_t count, std::byte* to) {
  const auto relative = [&values](auto value) {
    return filterable((static_cast<double>(value) - values.offset) / values.scale);
  };
  const bool wide = format == VK_FORMAT_R16_UNORM;
  using U8 = std::uint8_t;
  using U16 = std::uint16_t;
  switch (type) {
    case ScalarType::U8:
      if (wide) {
        return convertRow<U8, U16>(data, first, count, to, [](U8 v) { return static_cast<U16>(v * 257); });
      }
      std::memcpy(to, static_cast<const U8*>(data) + first, count);
      return;
    case ScalarType::I8:
      if (wide) {
        return convertRow<std::int8_t, U16>(data, first, count, to,
                                            [](std::int8_t v) { return static_cast<U16>((v + 128) * 257); });
      }
      return convertRow<std::int8_t, U8>(data, first, count, to,
                                         [](std::int8_t v) { return static_cast<U8>(v + 128); });
    case ScalarType::U16:
      std::memcpy(to, static_cast<const U16*>(data) + first, count * 2);
      return;
    case ScalarType::I16:
      return convertRow<std::int16_t, U16>(data, first, count, to,
                                           [](std::int16_t v) { return static_cast<U16>(v + 32768); });
    case ScalarType::F32:
      return convertRow<float, float>(data, first, count, to, filterable<float>);
    case ScalarType::U32:
      return convertRow<std::uint32_t, float>(data, first, count, to, relative);
    case ScalarType::I32:
      return convertRow<std::int32_t, float>(data, first, count, to, relative);
    case ScalarType::F64:
      return convertRow<double, float>(data, first, count, to, relative);
  }
}

/// What staged values are: as the simulation stores them, for a shader to place, or texels.
struct Staged {
  std::uint32_t type = shared::placeF32;  // for the shader
  std::uint64_t bytes = 0;                // of a value
  bool raw = false;                       // not converted on the host
};

/// Gives jobs their workgroups, and returns the number of all.
std::uint64_t numberGroups(std::span<shared::PlaceJob> jobs) {
  std::uint64_t groups = 0;
  for (shared::PlaceJob& job : jobs) {
    job.firstGroup = static_cast<std::uint32_t>(groups);
    constexpr std::uint64_t share = std::uint64_t{shared::placeGroup} * shared::placeEach;
    groups += (volumeOf(job.size) + share - 1) / share;
  }
  return groups;
}

/// Finds layers whose texels another block of the rank has, bit for bit.
class LayerSources {
 public:
  explicit LayerSources(std::span<const VolumePiece> pieces) {
    for (const VolumePiece& piece : pieces) {
      if (piece.values.ranges) continue;  // each block has a scale and offset of its own
      Source& source = sources_[keyOf(*piece.block)];
      if (source.pieces.empty()) {
        for (const Patch& patch : piece.block->patchList()) {
          const IndexBox covered = patch.box.intersection(piece.block->stored());
          if (!covered.empty()) source.covered.push_back(covered);
        }
      }
      source.pieces.push_back(&piece);
    }
  }

  /// Adds the jobs that copy the patch's part of the piece. Returns false, and adds none, if the texels of
  /// some values aren't there.
  bool add(const VolumePiece& piece, const Patch& patch, std::vector<shared::PlaceJob>& jobs) const {
    if (!patch.donor || piece.values.ranges) return false;
    const auto found = sources_.find(keyOf(*patch.donor));
    if (found == sources_.end()) return false;
    const IndexBox part = patch.box.intersection(piece.box());
    std::vector<IndexBox> left{{part.lo + patch.shift, part.hi + patch.shift}};
    const auto meets = [&left](const IndexBox& box) { return !box.intersection(left.front()).empty(); };
    if (std::ranges::any_of(found->second.covered, meets)) return false;
    const std::size_t before = jobs.size();
    for (const VolumePiece* from : found->second.pieces) {
      if (left.empty()) break;
      for (const IndexBox& box : left) {
        const IndexBox common = box.intersection(from->box());
        if (!common.empty()) jobs.push_back(jobOf(piece, *from, common, patch.shift));
      }
      subtract(left, from->box());
    }
    if (!left.empty()) jobs.resize(before);
    return left.empty();
  }

 private:
  using Key = std::tuple<const void*, const void*, std::array<std::int64_t, 3>, std::array<int, 3>,
                         std::array<double, 6>>;
  struct Source {
    std::vector<const VolumePiece*> pieces;
    std::vector<IndexBox> covered;  // stored values that patches replace
  };

  static Key keyOf(const Block& block) {
    const ByteStrides strides = block.strides.value_or(ByteStrides(0));
    return {
        block.data,
        block.computed.get(),
        {strides.x, strides.y, strides.z},
        {block.dims.x, block.dims.y, block.dims.z},
        {block.origin.x, block.origin.y, block.origin.z, block.spacing.x, block.spacing.y, block.spacing.z}};
  }
  /// `box` is in the indices of the block from which it comes.
  static shared::PlaceJob jobOf(const VolumePiece& to, const VolumePiece& from, const IndexBox& box,
                                const glm::ivec3& shift) {
    shared::PlaceJob job{};
    job.type = shared::placeTexel;
    job.size = glm::uvec3(box.size());
    job.place = to.place + glm::uvec3(box.lo - shift - to.first);
    job.page = to.page;
    job.from = from.place + glm::uvec3(box.lo - from.first);
    job.fromPage = from.page;
    return job;
  }

  std::map<Key, Source> sources_;
};

/// f64 becomes texels on the host, where that halves the bytes to write and to transfer. That takes less than
/// half the time of raw values, because host memory limits both (H200, 16 cores, 2026-11-29: 768^3 in 128 ms
/// instead of 311).
Staged stagedAs(const VolumePiece& piece, bool places) {
  const ScalarType type = piece.block->type;
  if (!places || type == ScalarType::F64) return {shared::placeF32, texelBytes(piece.format), false};
  static_assert(static_cast<std::uint32_t>(ScalarType::F32) == shared::placeF32);
  return {static_cast<std::uint32_t>(type), sizeOf(type), true};
}

}  // namespace

/// A box of a piece, in the block's indices, to be staged: the stored values, covered by the patches.
struct VolumeUpload::Load {
  const VolumePiece* piece = nullptr;
  IndexBox box;
  Staged staged;
  std::uint64_t offset = 0;  // in its slot
  std::vector<const Patch*> patches;

  /// Writes the values of a tile to the slot's memory.
  void write(const IndexBox& tile, std::byte* to) const {
    staged.raw ? writeValues(tile, to + offset) : writeTexels(tile, to + offset);
  }

 private:
  void writeValues(const IndexBox& tile, std::byte* to) const {
    const Block& block = *piece->block;
    const ByteStrides apart = packedStrides(box.size(), staged.bytes);
    const IndexBox stored = block.stored().intersection(tile);
    if (!stored.empty()) block.copyTo(stored, to + offsetOf(stored.lo - box.lo, apart), apart);
    for (const Patch* patch : patches) {
      const IndexBox part = patch->box.intersection(tile);
      if (!part.empty()) patch->copyTo(block.type, part, to + offsetOf(part.lo - box.lo, apart), apart);
    }
  }

  void writeTexels(const IndexBox& tile, std::byte* to) const {
    const Block& block = *piece->block;
    // Writes `part` from an array that holds the values of the box `of`.
    const auto writeArray = [&](const void* values, const IndexBox& of, const IndexBox& part) {
      for (int z = part.lo.z; z < part.hi.z; ++z) {
        for (int y = part.lo.y; y < part.hi.y; ++y) {
          const glm::ivec3 at(part.lo.x, y, z);
          writeRow(block.type, values, piece->format, piece->values, of.position(at),
                   static_cast<std::size_t>(part.size().x), to + box.position(at) * staged.bytes);
        }
      }
    };
    TileBuffer buffer;
    const IndexBox stored = block.stored().intersection(tile);
    if (!stored.empty() && block.isPacked()) {
      writeArray(block.data, block.stored(), stored);
    } else if (!stored.empty()) {
      block.copyTo(stored, buffer.bytes.data());
      writeArray(buffer.bytes.data(), stored, stored);
    }
    for (const Patch* patch : patches) {
      const IndexBox part = patch->box.intersection(tile);
      if (part.empty()) continue;
      if (patch->values) {
        writeArray(patch->values.get(), patch->box, part);
      } else {
        patch->copyTo(block.type, part, buffer.bytes.data(), packedStrides(part.size(), sizeOf(block.type)));
        writeArray(buffer.bytes.data(), part, part);
      }
    }
  }
};

namespace {

/// The alignment of offsets in the buffers from which the transfer queue copies. Whole texels aren't enough
/// for a queue that does nothing but copying.
std::uint64_t offsetAlignment(const Device& device) {
  const VulkanDevice& vulkan = device.vulkan();
  const bool onlyCopies = vulkan.queueFamily(QueueKind::Transfer) != vulkan.queueFamily(QueueKind::Compute);
  return onlyCopies ? 4 : 1;
}

/// Whether the block's values equal the texels of the piece's format.
bool isTexels(const VolumePiece& piece) {
  switch (piece.block->type) {
    case ScalarType::U8:
      return piece.format == VK_FORMAT_R8_UNORM;
    case ScalarType::U16:
      return piece.format == VK_FORMAT_R16_UNORM;
    case ScalarType::F32:
      return piece.format == VK_FORMAT_R32_SFLOAT;
    default:
      return false;
  }
}

}  // namespace

/// What fills a slot once.
struct VolumeUpload::Batch {
  std::size_t first = 0;  // loads
  std::size_t last = 0;
  std::uint64_t bytes = 0;  // of values
  std::uint64_t end() const { return bytes + (last - first) * sizeof(shared::PlaceJob); }
};

/// Loads in the order in which they travel, and how slots are filled with them.
struct VolumeUpload::Plan {
  /// What a thread fills at a time: tiles of a load.
  struct Unit {
    std::uint32_t load = 0;
    std::uint32_t batch = 0;
    std::size_t first = 0;
    std::size_t last = 0;
  };
  std::vector<Load> loads;
  std::vector<Batch> batches;
  std::vector<Unit> units;
  std::vector<shared::PlaceJob> layers;  // texels to copy after all loads

  /// Adds pieces whose values a shader places. Layers come from other pieces if possible. Places of those
  /// that lie in a box of values get any texels first.
  void add(std::span<const VolumePiece> pieces, const LayerSources& sources) {
    std::vector<Part> parts(pieces.size());
    constexpr std::size_t minimum = 16;  // pieces of blocks with 26 neighbours take some 10 us each
    inParallel(parts.size(), minimum, [&](std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) parts[i] = partOf(pieces[i], sources);
    });
    for (std::size_t i = 0; i < parts.size(); ++i) {
      add(pieces[i], parts[i].box, true, parts[i].patches);
      layers.insert(layers.end(), parts[i].layers.begin(), parts[i].layers.end());
    }
  }
  /// Adds values, in the piece's block's indices, with those patches that they are covered by: as many whole
  /// slices at a time as the slot has room for, or as many whole rows of one slice.
  void add(const VolumePiece& piece, const IndexBox& values, bool places,
           std::span<const Patch* const> patches) {
    if (values.empty()) return;
    constexpr std::uint64_t alignment = 16;
    const Staged staged = stagedAs(piece, places);
    const std::uint64_t rowBytes = static_cast<std::uint64_t>(values.size().x) * staged.bytes;
    const std::uint64_t sliceBytes = rowBytes * static_cast<std::uint64_t>(values.size().y);
    glm::ivec3 at = values.lo;
    while (at.z < values.hi.z) {
      const bool slices = at.y == values.lo.y && sliceBytes + spareBytes <= slotBytes;
      const std::uint64_t unit = slices ? sliceBytes : rowBytes;
      if (batches.empty() || batches.back().end() + unit + spareBytes > slotBytes)
        batches.push_back({loads.size(), loads.size(), 0});
      Batch& batch = batches.back();
      const std::uint64_t offset = (batch.bytes + alignment - 1) / alignment * alignment;
      const std::uint64_t room = slotBytes - batch.end() - spareBytes;
      const auto fitting = [&](int left) {
        return static_cast<int>(std::clamp<std::uint64_t>(room / unit, 1, static_cast<std::uint64_t>(left)));
      };
      IndexBox box{at, {values.hi.x, values.hi.y, at.z + 1}};
      if (slices) {
        box.hi.z = at.z + fitting(values.hi.z - at.z);
      } else {
        box.hi.y = at.y + fitting(values.hi.y - at.y);
      }
      batch.bytes = offset + box.count() * staged.bytes;
      batch.bytes = (batch.bytes + alignment - 1) / alignment * alignment;
      addLoad({&piece, box, staged, offset, {}}, patches);
      ++batch.last;
      at.y = box.hi.y;
      if (at.y == values.hi.y) at = {values.lo.x, values.lo.y, box.hi.z};
    }
  }

 private:
  /// Room for a load's job, and for alignment.
  static constexpr std::uint64_t spareBytes = sizeof(shared::PlaceJob) + 32;

  /// What comes from the host, and what from other pieces.
  struct Part {
    IndexBox box;
    std::vector<const Patch*> patches;
    std::vector<shared::PlaceJob> layers;
  };

  static Part partOf(const VolumePiece& piece, const LayerSources& sources) {
    const std::span<const Patch> all = piece.block->patchList();
    constexpr std::size_t most = 100;  // finding patches that meet takes the square of their number
    const auto meetsAnother = [&](const Patch& patch) {
      return std::ranges::any_of(all, [&patch](const Patch& other) {
        return &other != &patch && !other.box.intersection(patch.box).empty();
      });
    };
    Part part;
    const IndexBox stored = piece.box().intersection(piece.block->stored());
    if (!stored.empty()) part.box = stored;
    for (const Patch& patch : all) {
      const IndexBox common = patch.box.intersection(piece.box());
      if (common.empty() ||
          (all.size() <= most && !meetsAnother(patch) && sources.add(piece, patch, part.layers)))
        continue;
      part.patches.push_back(&patch);
      part.box.include(common);
    }
    return part;
  }

  void addLoad(Load load, std::span<const Patch* const> patches) {
    for (const Patch* patch : patches) {
      if (!patch->box.intersection(load.box).empty()) load.patches.push_back(patch);
    }
    constexpr std::size_t tilesAtOnce = 16;
    const std::size_t tiles = load.piece->block->tilesOf(load.box).count();
    for (std::size_t tile = 0; tile < tiles; tile += tilesAtOnce) {
      units.push_back({static_cast<std::uint32_t>(loads.size()),
                       static_cast<std::uint32_t>(batches.size() - 1), tile,
                       std::min(tile + tilesAtOnce, tiles)});
    }
    loads.push_back(std::move(load));
  }
};

VolumeUpload::VolumeUpload(std::shared_ptr<Device> device)
    : device_(std::move(device)),
      places_(device_->runsGpuPrograms() && device_->limits().storesTexels &&
              usableCores() >= coresThatCopyFaster),
      frame_(device_, places_ ? QueueKind::Compute : QueueKind::Transfer),
      sampler_(device_),
      pipelines_(device_, placeInfo()) {}

/// Copies the piece's stored values from host memory. Returns false if the values must be staged instead.
/// `imported` must stay until the copies are complete.
bool VolumeUpload::copyDirectly(const VolumePiece& piece, const SampledImage& page,
                                std::vector<Buffer>& imported) {
  const Block& block = *piece.block;
  const IndexBox part = piece.box().intersection(block.stored());
  if (part.empty() || usableCores() >= coresThatCopyFaster || !isTexels(piece) ||
      imported.size() == maxImports)
    return false;
  const std::optional<Pitches> pitches = pitchesOf(block);
  if (!pitches) return false;
  const std::uint64_t bytes = texelBytes(piece.format);
  const IndexBox layout{glm::ivec3(0), {pitches->row, pitches->rows, block.dims.z}};
  const std::uint64_t first = layout.position(part.lo) * bytes;
  const std::uint64_t end = (layout.position(part.hi - 1) + 1) * bytes;
  if (end - first < minImport) return false;
  const auto* data = static_cast<const std::byte*>(block.data);
  if (block.type == ScalarType::F32 && anyInfinite(block, part)) return false;
  std::optional<ImportedBuffer> source = importHostMemory(device_, data + first, end - first);
  if (!source || source->offset % std::max(bytes, offsetAlignment(*device_)) != 0) return false;
  frame_.copyToImage(source->buffer, source->offset, page, piece.place + glm::uvec3(part.lo - piece.first),
                     glm::uvec3(part.size()),
                     {static_cast<std::uint32_t>(pitches->row), static_cast<std::uint32_t>(pitches->rows)});
  imported.push_back(std::move(source->buffer));
  return true;
}

/// Plans the texels that the host makes: all, or those of patches if the others were copied directly.
void VolumeUpload::planTexels(Plan& plan, const VolumePiece& piece, const SampledImage& page,
                              std::vector<Buffer>& imported) {
  std::vector<const Patch*> patches;
  for (const Patch& patch : piece.block->patchList()) patches.push_back(&patch);
  if (!copyDirectly(piece, page, imported)) return plan.add(piece, piece.box(), false, patches);
  for (const Patch* patch : patches) {
    const IndexBox part = patch->box.intersection(piece.box());
    if (!part.empty()) plan.add(piece, part, false, patches);
  }
}

void VolumeUpload::begin(const Commands& before) {
  frame_.begin();
  frame_.waitFor(before);
}

void VolumeUpload::run(std::span<const VolumePiece> pieces, std::span<const SampledImage> pages) {
  std::vector<Buffer> imported;
  const auto waitForAll = [&] {
    for (const std::unique_ptr<Slot>& slot : slots_) {
      slot->copies.wait();
      slot->stores.wait();
    }
    frame_.wait();
  };
  try {
    for (const SampledImage& page : pages) places_ ? frame_.beginStores(page) : frame_.beginUpload(page);
    Plan plan;
    if (places_) {
      plan.add(pieces, LayerSources(pieces));
    } else {
      for (const VolumePiece& piece : pieces) planTexels(plan, piece, pages[piece.page], imported);
    }
    frame_.barrier();  // patches overwrite the values that were copied directly
    frame_.submit();
    if (places_) bindPages(pages);
    makeSlots(plan);
    send(plan, pages);
    frame_.begin();
    copyLayers(plan);
    for (const SampledImage& page : pages) places_ ? frame_.endStores(page) : frame_.endUpload(page);
    frame_.submit();
    waitForAll();
  } catch (...) {
    waitForAll();  // no command may read memory that is about to be freed
    throw;
  }
}

void VolumeUpload::bindPages(std::span<const SampledImage> pages) {
  const std::vector<const SampledImage*> images = imagesOf(pages);
  pipeline_ = &pipelines_.with({static_cast<std::uint32_t>(pages.size())});
  pipeline_->bindImages(images, sampler_);
  pipeline_->bindStores(images);
}

/// Records the copies of texels that are in place.
void VolumeUpload::copyLayers(const Plan& plan) {
  if (plan.layers.empty()) return;
  const std::span<const shared::PlaceJob> layers(plan.layers);
  layerJobs_.reserve(device_, layers.size_bytes(), MemoryKind::Upload);
  const auto jobs = layerJobs_.mappedAs<shared::PlaceJob>().first(layers.size());
  std::ranges::copy(layers, jobs.begin());
  const std::uint64_t groups = numberGroups(jobs);
  frame_.barrier();
  frame_.dispatchMany(*pipeline_,
                      shared::PlaceConstants{layerJobs_.address(), static_cast<std::uint32_t>(jobs.size()),
                                             static_cast<std::uint32_t>(groups)},
                      groups, 1);
}

/// Makes as many slots as the plan needs and memory allows.
void VolumeUpload::makeSlots(const Plan& plan) {
  std::uint64_t bytes = 0;
  for (const Batch& batch : plan.batches) bytes = std::max(bytes, batch.end());
  const std::size_t wanted = std::min(plan.batches.size(), maxSlots);
  for (std::size_t i = 0; i < wanted; ++i) {
    try {
      if (i == slots_.size()) slots_.push_back(std::make_unique<Slot>(device_));
      slots_[i]->staging.reserve(device_, bytes, MemoryKind::Upload);
      if (places_) slots_[i]->values.reserve(device_, bytes, MemoryKind::DeviceLocal);
    } catch (const Error& error) {
      if (error.code() != ErrorCode::OutOfMemory || i == 0) throw;
      slots_.resize(i);
      return;
    }
  }
}

/// All threads fill the slots, and the one that completes a batch submits it.
void VolumeUpload::send(const Plan& plan, std::span<const SampledImage> pages) {
  const std::size_t count = plan.batches.size();
  if (count == 0) return;
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<std::size_t> left(count);  // units to fill
  for (const Plan::Unit& unit : plan.units) ++left[unit.batch];
  std::vector<Submission> copied(count);
  std::size_t submitted = 0;
  bool failed = false;
  // Waits until the slot's previous values are copied. Returns false after a failure.
  const auto waitForSlot = [&](std::size_t batch) {
    if (batch < slots_.size()) return true;
    const std::size_t previous = batch - slots_.size();
    std::unique_lock lock(mutex);
    changed.wait(lock, [&] { return failed || submitted > previous; });
    if (failed) return false;
    const Submission submission = copied[previous];
    lock.unlock();
    device_->vulkan().wait(submission.kind, submission.number);
    return true;
  };
  const auto finish = [&](std::size_t batch) {
    const std::lock_guard lock(mutex);
    --left[batch];
    for (; !failed && submitted < count && left[submitted] == 0; ++submitted) {
      Slot& slot = *slots_[submitted % slots_.size()];
      submit(plan, plan.batches[submitted], slot, pages);
      copied[submitted] = slot.copies.last();
    }
    changed.notify_all();
  };
  const auto work = [&](const Plan::Unit& unit) {
    try {
      if (!waitForSlot(unit.batch)) return;
      const Load& load = plan.loads[unit.load];
      std::byte* const to = slots_[unit.batch % slots_.size()]->staging.mapped().data();
      const Tiling tiles = load.piece->block->tilesOf(load.box);
      for (std::size_t tile = unit.first; tile < unit.last; ++tile) load.write(tiles[tile], to);
      finish(unit.batch);
    } catch (...) {
      const std::lock_guard lock(mutex);
      failed = true;
      changed.notify_all();
      throw;
    }
  };
  eachInParallel(plan.units.size(), [&](std::size_t i) { work(plan.units[i]); });
}

void VolumeUpload::submit(const Plan& plan, const Batch& batch, Slot& slot,
                          std::span<const SampledImage> pages) {
  slot.copies.begin();
  if (!places_) {
    for (std::size_t i = batch.first; i < batch.last; ++i) {
      const Load& load = plan.loads[i];
      const VolumePiece& piece = *load.piece;
      slot.copies.copyToImage(slot.staging, load.offset, pages[piece.page],
                              piece.place + glm::uvec3(load.box.lo - piece.first),
                              glm::uvec3(load.box.size()));
    }
    return slot.copies.submit();
  }
  const std::span jobs(reinterpret_cast<shared::PlaceJob*>(slot.staging.mapped().data() + batch.bytes),
                       batch.last - batch.first);
  for (std::size_t i = batch.first; i < batch.last; ++i) {
    const Load& load = plan.loads[i];
    const VolumePiece& piece = *load.piece;
    shared::PlaceJob& job = jobs[i - batch.first];
    job.values = slot.values.address() + load.offset;
    job.scale = piece.values.scale;
    job.offset = piece.values.offset;
    job.size = glm::uvec3(load.box.size());
    job.type = load.staged.type;
    job.place = piece.place + glm::uvec3(load.box.lo - piece.first);
    job.page = piece.page;
  }
  const std::uint64_t groups = numberGroups(jobs);
  slot.copies.waitFor(slot.stores);
  slot.copies.copy(slot.staging, 0, slot.values, 0, batch.end());
  slot.copies.submit();
  const shared::PlaceConstants constants{slot.values.address() + batch.bytes,
                                         static_cast<std::uint32_t>(jobs.size()),
                                         static_cast<std::uint32_t>(groups)};
  slot.stores.begin();
  slot.stores.waitFor(slot.copies);
  slot.stores.dispatchMany(*pipeline_, constants, groups, 1);
  slot.stores.submit();
}

}  // namespace vdi::gpu
