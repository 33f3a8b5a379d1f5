"""Checks the files of catalyst_json_log's run: its log, text and picture of it, and links. Arguments: vdi, the folder."""

import json
import os
import subprocess
import sys
import xml.etree.ElementTree

tool, folder = sys.argv[1:]
os.chdir(folder)
lines = [json.loads(line) for line in open("run.jsonl")]
assert [line["event"] for line in lines] == ["start", "frame", "frame", "frame", "end"], lines
start, frames, end = lines[0], lines[1:4], lines[4]
assert (start["field"], start["ranks"]) == ("V", 2), start
assert [(frame["step"], frame["time"]) for frame in frames] == [(0, 0.0), (1, 0.5), (2, 1.0)], frames
for frame in (frames[0], frames[2]):
    stages = frame["stages"]
    assert list(stages) == ["wait", "upload", "generate", "distribute", "composite", "gather", "output"], stages
    assert all(0 <= stage["mean"] <= stage["slowest"] for stage in stages.values()), frame
    # A rank other than the first may have waited for longer than the first one needed.
    assert all(stages[name]["slowest"] <= frame["ms"] for name in stages if name != "wait"), frame
    assert stages["generate"]["mean"] > 0 and stages["output"]["mean"] > 0, stages
    # Two ranks: the slowest one has at most all of what both have.
    assert all(stage["slowest"] <= 2.01 * stage["mean"] + 0.01 for stage in stages.values()), stages
    names = ["log_%d.%s" % (frame["step"], kind) for kind in ("vdi", "png")]
    assert frame["files"] == names, frame
    assert frame["bytes_written"] == sum(os.path.getsize(name) for name in names), frame
    assert frame["bytes_sent"] > 0 and "error" not in frame, frame
assert "log_1.vdi" in frames[1]["error"] and frames[1]["bytes_written"] == 0, frames[1]
assert (end["frames"], end["failed"]) == (2, 1), end
assert abs(end["waited_seconds"] - sum(frame["ms"] for frame in frames) / 1e3) < 0.01, end
assert end["waited_seconds"] < end["seconds"], end
assert os.readlink("latest.vdi") == "log_2.vdi" and os.readlink("latest.png") == "log_2.png"
text = open("run.log").read().splitlines()
assert len(text) == 5 and text[2].startswith("step 1, time 0.5: ") and "failed: " in text[2], text

said = subprocess.run([tool, "log", "run.jsonl"], check=True, capture_output=True, text=True, timeout=30).stdout
assert "2 frames made, 1 failed" in said and "run.svg" in said, said
svg = xml.etree.ElementTree.parse("run.svg").getroot()
paths = [element.get("class") for element in svg.iter("{http://www.w3.org/2000/svg}path")]
assert paths.count("stage") == 7 and paths.count("failed") == 1, paths
