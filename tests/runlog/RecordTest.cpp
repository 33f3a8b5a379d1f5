// A frame's record: its figures from the ranks' reports, and its lines.
#include <cmath>
#include <string>
#include <vector>

#include "tests/Catch.h"
#include "vdi/runlog/Record.h"

using namespace vdi;
using runlog::FrameRecord;
using runlog::parseRecords;
using runlog::RunRecords;
using runlog::RunSummary;

namespace {

FrameRecord frame() {
  FrameRecord record;
  record.step = 20;
  record.time = 0.1;
  record.milliseconds = 12.5;
  record.stages = {{"upload", 4.0, 3.0}, {"generate", 8.0, 6.5}};
  record.bytesWritten = 3145728;
  record.bytesSent = 10;
  record.deviceBytes = 11;
  record.hostPeakBytes = 12;
  record.dropped = 2;
  record.files = {"a \"b\".vdi"};
  return record;
}

}  // namespace

TEST_CASE("reports come to the slowest rank's and the mean rank's milliseconds") {
  std::vector<RankReport> reports(2);
  reports[0].generateSeconds = 0.002;
  reports[1].generateSeconds = 0.004;
  reports[1].outputSeconds = 0.001;
  reports[0].bytesWritten = 5;
  reports[1].bytesWritten = 6;
  reports[0].deviceBytes = 7;
  reports[1].deviceBytes = 3;
  FrameRecord record;
  runlog::setReports(record, reports);
  REQUIRE(record.stages.size() == 6);
  CHECK(record.stages[0].name == "upload");
  CHECK(record.stages[1].name == "generate");
  CHECK(record.stages[1].slowest == Approx(4.0));
  CHECK(record.stages[1].mean == Approx(3.0));
  CHECK(record.stages[5].slowest == Approx(1.0));
  CHECK(record.stages[5].mean == Approx(0.5));
  CHECK(record.bytesWritten == 11);
  CHECK(record.deviceBytes == 7);
}

TEST_CASE("a line of JSON keeps a record") {
  FrameRecord failed = frame();
  failed.field = "p";
  failed.camera = "top";
  failed.stages.clear();
  failed.error = "no\nspace";
  RunSummary summary;
  summary.add(frame());
  summary.add(failed);
  summary.seconds = 1.0;
  summary.isIsolated = GENERATE(false, true);
  runlog::RunStart start{GENERATE(std::vector<std::string>{"V"}, std::vector<std::string>{"V", "p"}), 4,
                         1700000000, summary.isIsolated};
  if (GENERATE(false, true)) {
    start.fields.clear();
    start.scripts = {"a/first.py", "second.py"};
  }
  const std::string lines =
      jsonLine(start) + "\n" + jsonLine(frame()) + "\n" + jsonLine(failed) + "\n" + jsonLine(summary) + "\n";
  const RunRecords records = parseRecords(lines);
  CHECK(records.skipped == 0);
  CHECK(records.starts == std::vector{start});
  CHECK(records.frames == std::vector{frame(), failed});
  CHECK(records.summaries == std::vector{summary});
}

TEST_CASE("lines that aren't records are counted") {
  const std::string whole = jsonLine(frame());
  const RunRecords records =
      parseRecords(whole.substr(0, 40) + "\n" + whole + "\n[1]\n{}\n\n{\"event\": 5}\n" +
                   "{\"event\": \"frame\", \"step\": \"x\"}\n" + whole);
  CHECK(records.frames == std::vector{frame(), frame()});
  CHECK(records.skipped == 5);
}

TEST_CASE("bytes that aren't UTF-8, and a time that isn't a number, make a line of JSON all the same") {
  FrameRecord record = frame();
  record.files = {"\xff.vdi"};
  record.time = std::nan("");
  const RunRecords records = parseRecords(jsonLine(record));
  REQUIRE(records.frames.size() == 1);
  CHECK(std::isnan(records.frames[0].time));
  CHECK(records.frames[0].step == 20);
}

TEST_CASE("a summary adds frames up") {
  FrameRecord failed;
  failed.milliseconds = 100.0;
  failed.error = "no";
  RunSummary sum;
  sum.add(frame());
  sum.add(frame());
  sum.add(failed);
  CHECK(sum.frames == 2);
  CHECK(sum.failed == 1);
  CHECK(sum.dropped == 2);
  CHECK(sum.bytesWritten == 6291456);
  CHECK(sum.waitedSeconds == Approx(0.125));
  CHECK(sum.longestMilliseconds == 100.0);
  CHECK(sum.stages == std::vector<runlog::StageTime>{{"upload", 8.0, 6.0}, {"generate", 16.0, 13.0}});
}

TEST_CASE("lines to read") {
  CHECK(textLine(frame()) ==
        "step 20, time 0.1: 12.5 ms: upload 4.0 (3.0), generate 8.0 (6.5); 3.00 MiB written, 0.00 MiB sent; "
        "2 dropped so far; a \"b\".vdi");
  FrameRecord failed = frame();
  failed.error = "two\nlines";
  CHECK(textLine(failed) == "step 20, time 0.1: 12.5 ms, failed: two lines");
  RunSummary summary;
  summary.waitedSeconds = 1.0;
  summary.seconds = 4.0;
  CHECK_THAT(textLine(summary), test::ContainsSubstring("; the simulation waited 1.00 s of 4.00 s (25.0 %)"));
  summary.isIsolated = true;
  CHECK_THAT(textLine(summary),
             test::ContainsSubstring("; frames in separate processes took 1.00 s of 4.00 s (25.0 %)"));
}
