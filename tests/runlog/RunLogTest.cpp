// The log's files, to which lines are appended whole or not at all.
#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "tests/Catch.h"
#include "tests/TemporaryFolder.h"
#include "tests/io/Samples.h"
#include "vdi/core/Error.h"
#include "vdi/runlog/RunLog.h"

using namespace vdi;
using runlog::FrameRecord;
using runlog::readRecords;
using runlog::RunLog;
using runlog::RunRecords;

namespace {

namespace fs = std::filesystem;

FrameRecord frameOf(std::int64_t step, double milliseconds, const std::string& error = {}) {
  FrameRecord frame;
  frame.step = step;
  frame.milliseconds = milliseconds;
  frame.error = error;
  return frame;
}

std::string contentOf(const fs::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace

TEST_CASE("a log has the run's start, its frames and its end, and a second run appends") {
  const test::TemporaryFolder folder;
  const fs::path json = folder.path() / "new" / "run.jsonl";
  const fs::path text = folder.path() / "run.log";
  for (int run = 0; run < 2; ++run) {
    RunLog log({json, text}, {{"V"}, 2, 0});
    log.add(frameOf(10, 3.0));
    log.add(frameOf(20, 5.0, "no"));
    const runlog::RunSummary summary = log.finish();
    CHECK(summary.frames == 1);
    CHECK(summary.failed == 1);
    CHECK(summary.seconds >= 0.0);
  }
  const RunRecords records = readRecords(json);
  CHECK(records.starts.size() == 2);
  CHECK(records.frames.size() == 4);
  CHECK(records.summaries.size() == 2);
  CHECK(records.skipped == 0);
  const std::string lines = contentOf(text);
  CHECK(std::count(lines.begin(), lines.end(), '\n') == 8);
  CHECK_THAT(lines, test::ContainsSubstring("step 20, time 0: 5.0 ms, failed: no\n"));
}

TEST_CASE("a line that has no room leaves nothing of itself, and the next one is whole") {
  const test::TemporaryFolder folder;
  const fs::path json = folder.path() / "run.jsonl";
  const fs::path text = folder.path() / "run.log";
  RunLog log({json, text}, {{"V"}, 1, 0});
  log.add(frameOf(1, 1.0));
  const std::string before = contentOf(json);
  {
    const test::FileSizeLimit full(before.size() + 20);
    CHECK_THROWS_WITH(log.add(frameOf(2, 1.0)), test::ContainsSubstring("run.jsonl"));
  }
  CHECK(contentOf(json) == before);
  CHECK_THAT(contentOf(text), test::ContainsSubstring("step 2,"));  // it had room
  log.add(frameOf(3, 1.0));
  const RunRecords records = readRecords(json);
  CHECK(records.skipped == 0);
  REQUIRE(records.frames.size() == 2);
  CHECK(records.frames[1].step == 3);
}

TEST_CASE("a line that was left unfinished spoils no other") {
  const test::TemporaryFolder folder;
  const fs::path json = folder.path() / "run.jsonl";
  std::ofstream(json) << "{\"event\": \"fra";
  RunLog log({json, {}}, {{"V"}, 1, 0});
  log.add(frameOf(1, 1.0));
  const RunRecords records = readRecords(json);
  CHECK(records.skipped == 1);
  CHECK(records.starts.size() == 1);
  CHECK(records.frames.size() == 1);
}

TEST_CASE("a log that can't be is refused at once") {
  const test::TemporaryFolder folder;
  CHECK_THROWS_AS(RunLog({folder.path(), {}}, {{"V"}, 1, 0}), Error);
  CHECK_THROWS_WITH(RunLog({"/dev/null", {}}, {{"V"}, 1, 0}), test::ContainsSubstring("regular file"));
  const fs::path file = folder.path() / "other";
  std::ofstream(file) << "some text\n";
  CHECK_THROWS_WITH(readRecords(file), test::ContainsSubstring("not a run's log"));
  CHECK_THROWS_WITH(readRecords(folder.path() / "none"), test::ContainsSubstring("none"));
}

TEST_CASE("neither file of a log loses its content if the other one can't be opened") {
  const test::TemporaryFolder folder;
  const fs::path file = folder.path() / "run";
  std::ofstream(file) << "an earlier run\n";
  CHECK_THROWS_AS(RunLog({file, folder.path()}, {{"V"}, 1, 0}, RunLog::Before::Goes), Error);
  CHECK_THROWS_AS(RunLog({folder.path(), file}, {{"V"}, 1, 0}, RunLog::Before::Goes), Error);
  CHECK(contentOf(file) == "an earlier run\n");
}

TEST_CASE("a start that has no room leaves no file that it has made, and those that were there") {
  const test::TemporaryFolder folder;
  const fs::path fresh = folder.path() / "run.jsonl";
  const fs::path old = folder.path() / "run.log";
  const std::string line = "an earlier run\n";
  std::ofstream(old) << line;
  {
    const test::FileSizeLimit full(line.size());
    CHECK_THROWS_AS(RunLog({fresh, {}}, {{"V"}, 1, 0}), Error);
    CHECK_THROWS_AS(RunLog({{}, fresh}, {{"V"}, 1, 0}), Error);
    CHECK_THROWS_AS(RunLog({fresh, old}, {{"V"}, 1, 0}), Error);
    CHECK_THROWS_AS(RunLog({old, fresh}, {{"V"}, 1, 0}), Error);
  }
  CHECK_THROWS_AS(RunLog({fresh, folder.path()}, {{"V"}, 1, 0}), Error);
  CHECK_FALSE(fs::exists(fresh));
  CHECK(contentOf(old) == line);
  RunLog({fresh, {}}, {{"V"}, 1, 0});
  CHECK(readRecords(fresh).starts.size() == 1);
}

TEST_CASE("a log starts over where it is told to, and has what was left out") {
  const test::TemporaryFolder folder;
  const fs::path json = folder.path() / "run.jsonl";
  const fs::path text = folder.path() / "run.log";
  for (int run = 0; run < 2; ++run) {
    RunLog log({json, text}, {{"V"}, 2, 0}, RunLog::Before::Goes);
    log.add(frameOf(10, 3.0));
    log.add(runlog::LeftOut{20, 0.25, "no\ntime"});
    CHECK(log.finish().leftOut == 1);
  }
  const RunRecords records = readRecords(json);
  CHECK(records.starts.size() == 1);
  CHECK(records.frames.size() == 1);
  CHECK(records.leftOut == std::vector<runlog::LeftOut>{{20, 0.25, "no\ntime"}});
  REQUIRE(records.summaries.size() == 1);
  CHECK(records.summaries[0].leftOut == 1);
  CHECK(records.skipped == 0);
  CHECK(
      contentOf(text).find("\nstep 20, time 0.25: left out: no time\n1 frame made, 0 failed, 1 left out, ") !=
      std::string::npos);
}
