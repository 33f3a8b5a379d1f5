// Colour maps of ParaView's presets, against VTK's own colours.
#include <string>
#include <vector>

#include "tests/Catch.h"
#include "vdi/config/ColorMap.h"
#include "vdi/io/Json.h"

using namespace vdi;

namespace {

constexpr const char* nodes = "[0, 0.2, 0.3, 0.8, 1, 0.7, 0.1, 0.1, 3, 0.9, 0.9, 0.2]";

config::ColorMap mapIn(const std::string& space) {
  const std::string text = R"([{"Name": "a", "ColorSpace": ")" + space + R"(", "RGBPoints": )" + nodes +
                           R"(, "NanColor": [1, 0, 0]}])";
  return config::colorMapOf(text, "a.json", "");
}

void checkColors(const config::ColorMap& map, const std::vector<double>& xs,
                 const std::vector<glm::dvec3>& colors) {
  const TransferFunction function{map.colors, {{0.0, 0.0}}, 1.0};
  for (std::size_t i = 0; i < xs.size(); ++i) {
    const glm::dvec3 color = function.colorAt(xs[i]);
    INFO("at " << xs[i] << ": " << color.x << " " << color.y << " " << color.z);
    CHECK(glm::length(color - colors[i]) < 2e-3);
  }
}

}  // namespace

TEST_CASE("a preset has VTK's colours in each of its colour spaces") {
  // vtkColorTransferFunction::GetColor of VTK 9.1, HSVWrap off, as ParaView has it.
  checkColors(mapIn("RGB"), {0.0, 0.25, 2.0}, {{0.2, 0.3, 0.8}, {0.325, 0.25, 0.625}, {0.8, 0.5, 0.15}});
  checkColors(mapIn("HSV"), {0.0, 0.25, 0.75, 1.5, 2.5},
              {{0.2, 0.3, 0.8},
               {0.173, 0.775, 0.6997},
               {0.725, 0.6999, 0.123},
               {0.75, 0.279, 0.122},
               {0.85, 0.6805, 0.172}});
  checkColors(mapIn("Lab"), {0.25, 0.75, 1.5, 2.5},
              {{0.4718, 0.2566, 0.6187},
               {0.6559, 0.1628, 0.2761},
               {0.7675, 0.3556, 0.1237},
               {0.8682, 0.7221, 0.1738}});
  checkColors(mapIn("Diverging"), {0.0, 0.25, 0.75, 1.5, 2.5},
              {{0.2, 0.3, 0.8},
               {0.627, 0.6759, 1.0},
               {0.9499, 0.6172, 0.4638},
               {1.0, 0.7588, 0.4521},
               {1.0, 0.9752, 0.6788}});
  checkColors(mapIn("Step"), {0.25, 0.75, 1.5, 2.5},
              {{0.7, 0.1, 0.1}, {0.7, 0.1, 0.1}, {0.9, 0.9, 0.2}, {0.9, 0.9, 0.2}});
}

TEST_CASE("a map is moved to a range, its opacities with it") {
  const std::string text = R"({"Name": "a", "RGBPoints": [-1, 0, 0, 0, 1, 1, 1, 1],
                               "Points": [0, 0, 0.5, 0, 2, 0.5, 0.5, 0]})";
  const config::ColorMap map = config::rescaled(config::colorMapOf(text, "a.json", "a"), {10.0, 20.0});
  CHECK(map.colors == std::vector<ColorNode>{{10.0, glm::dvec3(0.0)}, {20.0, glm::dvec3(1.0)}});
  CHECK(map.opacities == std::vector<OpacityNode>{{10.0, 0.0}, {20.0, 0.5}});
  // RescaleTransferFunction of ParaView 5.11 puts the node at this double, and the last one at the range's
  // end.
  const std::string inner = R"({"Name": "a", "RGBPoints": [0, 0, 0, 0, 0.7, 0, 0, 0, 1, 1, 1, 1]})";
  const config::ColorMap moved = config::rescaled(config::colorMapOf(inner, "a.json", "a"), {-0.3, 1.0});
  REQUIRE(moved.colors.size() == 3);
  CHECK(moved.colors[1].x == 0.6099999999999999);
  CHECK(moved.colors[2].x == 1.0);
}

TEST_CASE("what isn't a preset is refused with its place") {
  const auto refused = [](const std::string& text, const std::string& name, const std::string& part) {
    INFO(text);
    CHECK_THROWS_WITH(config::colorMapOf(text, "a.json", name), test::ContainsSubstring(part));
  };
  const std::string good = R"({"Name": "a", "RGBPoints": [0, 0, 0, 0, 1, 1, 1, 1]})";
  CHECK_NOTHROW(config::colorMapOf("[" + good + "," + good + "]", "a.json", "a"));
  refused("[" + good + "," + good + "]", "", "the file has 2 presets");
  refused(good, "b", "no preset is named 'b'");
  refused(R"({"Name": "a", "IndexedColors": [0, 0, 0]})", "", "categories");
  refused(R"({"RGBPoints": [0, 0, 0, 0]})", "", "/RGBPoints: must be four numbers");
  refused(R"({"RGBPoints": [0, 0, 0, 0, 1, 1, 1, 2]})", "", "/RGBPoints: colours");
  refused("{\"RGBPoints\": [1, 0, 0, 0,\n0, 1, 1, 1]}", "",
          "/RGBPoints/4: nodes must ascend (a.json, line 2)");
  refused(R"({"RGBPoints": [1, 0, 0, 0, 1, 1, 1, 1]})", "", "the same value");
  refused(R"({"RGBPoints": [-1e308, 0, 0, 0, 1e308, 1, 1, 1]})", "",
          "/RGBPoints: the nodes lie too far apart");
  refused(R"({"ColorSpace": "Lab/CIEDE2000", "RGBPoints": [0, 0, 0, 0, 1, 1, 1, 1]})", "",
          "/ColorSpace: unknown colour space");
}
