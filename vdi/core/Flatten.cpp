#include "vdi/core/Flatten.h"

#include <span>
#include <variant>

#include "vdi/core/Parallel.h"

namespace vdi {

namespace {

/// Flattens the lists from column and row `margin` on.
template <typename Segment>
void flattenLists(const ListsOf<Segment>& lists, const DepthCode& code, int listsWide,
                  const glm::ivec2& margin, Image& image) {
  constexpr float opaque = 0.999999F;
  constexpr std::size_t minimum = 4096;  // lists
  inParallel(image.pixelCount(), minimum, [&](std::size_t first, std::size_t last) {
    const auto width = static_cast<std::size_t>(image.width);
    for (std::size_t i = first; i < last; ++i) {
      const std::size_t column = i % width + static_cast<std::size_t>(margin.x);
      const std::size_t row = i / width + static_cast<std::size_t>(margin.y);
      const std::span<const Segment> list = lists.list(row * static_cast<std::size_t>(listsWide) + column);
      glm::vec4 sum(0.0F);
      for (auto segment = list.begin(); segment != list.end() && sum.a < opaque; ++segment) {
        const Supersegment& s = expanded(*segment, code);
        sum += (1.0F - sum.a) * glm::vec4(s.red, s.green, s.blue, s.opacity);
      }
      image.rgba[i] = sum;
      image.depth[i] = list.empty() ? Image::noDepth : expanded(list.front(), code).front;
    }
  });
}

}  // namespace

Image flatten(const Vdi& vdi) {
  const glm::ivec2 size = vdi.pictureSize();
  Image image{size.x, size.y, {}, {}};
  image.rgba.resize(image.pixelCount());
  image.depth.resize(image.pixelCount());
  std::visit([&](const auto& lists) { flattenLists(lists, vdi.depthCode, vdi.width, vdi.margin, image); },
             vdi.lists);
  return image;
}

}  // namespace vdi
