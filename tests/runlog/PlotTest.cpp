// The picture of a log.
#include <cstdint>
#include <string>
#include <vector>

#include "tests/Catch.h"
#include "vdi/core/Error.h"
#include "vdi/runlog/Plot.h"

using namespace vdi;
using runlog::FrameRecord;
using runlog::plot;
using runlog::RunRecords;
using runlog::StageTime;

namespace {

FrameRecord frameOf(std::int64_t step, double milliseconds, const std::vector<StageTime>& stages) {
  FrameRecord frame;
  frame.step = step;
  frame.milliseconds = milliseconds;
  frame.stages = stages;
  return frame;
}

std::size_t countOf(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

}  // namespace

TEST_CASE("each stage of each frame is as high as it took long") {
  RunRecords records;
  records.frames.push_back(frameOf(10, 100.0, {{"generate", 60.0, 30.0}, {"output", 40.0, 20.0}}));
  records.frames.push_back(frameOf(20, 50.0, {{"generate", 50.0, 50.0}}));
  const std::string slowest = plot(records, {"run", false});
  CHECK(countOf(slowest, "<path class=\"stage\"") == 2);
  // 300 units are 100 ms: the first frame's boxes reach from 380 to 200 and from there to 80.
  CHECK_THAT(slowest, test::ContainsSubstring("380.00h386.75V200.00"));
  CHECK_THAT(slowest, test::ContainsSubstring("200.00h386.75V80.00"));
  CHECK_THAT(slowest, test::ContainsSubstring("380.00h386.75V230.00"));
  const std::string mean = plot(records, {"run", true});
  CHECK_THAT(mean, test::ContainsSubstring("380.00h386.75V290.00"));
  CHECK(countOf(mean, ">10</text>") == 1);  // the step
  CHECK(countOf(mean, "the simulation's wait") == 1);
  records.starts.push_back({{"V"}, 2, 0, true});
  CHECK(countOf(plot(records, {"run", true}), "the simulation's wait") == 0);
}

TEST_CASE("names and errors can't leave their elements") {
  RunRecords records;
  records.starts.push_back({{"a<b>&c"}, 2, 0});
  records.frames.push_back(frameOf(1, 1.0, {}));
  records.frames.back().error = "</title><script>";
  const std::string svg = plot(records, {"<run>", false});
  CHECK_THAT(svg, test::ContainsSubstring("&lt;run&gt;: a&lt;b&gt;&amp;c, 2 ranks"));
  CHECK(countOf(svg, "<script") == 0);
  CHECK(countOf(svg, "class=\"failed\"") == 1);
}

TEST_CASE("a log of many frames makes a picture of bounded detail, and one of none is refused") {
  CHECK_THROWS_AS(plot(RunRecords(), {}), Error);
  RunRecords records;
  records.frames.assign(20000, frameOf(1, 0.0, {}));
  CHECK(plot(records, {}).size() < 2000000);
}
