"""Checks the log of catalyst_script_log's run of two_filters.py, whose second step fails. Arguments: vdi, the folder,
isolated or not."""

import json
import os
import subprocess
import sys

tool, folder, place = sys.argv[1:]
os.chdir(folder)
lines = [json.loads(line) for line in open("run.jsonl")]
assert [line["event"] for line in lines] == ["start"] + 6 * ["frame"] + ["end"], lines
start, frames, end = lines[0], lines[1:-1], lines[-1]
assert os.path.basename(start["scripts"][0]) == "two_filters.py" and start["ranks"] == 2 and "field" not in start, start
assert start.get("isolated", False) == end.get("isolated", False) == (place == "isolated"), (start, end)
made = [frame for frame in frames if "error" not in frame]
assert [(frame["step"], frame["camera"]) for frame in made] == [(1, "near"), (1, "far"), (2, "near"), (3, "near"), (3, "far")]
assert all(frame["time"] == 0.5 * frame["step"] for frame in frames), frames
for frame in made:
    stages = dict(frame["stages"])
    # The first frame of a step has the wait for the step's last rank.
    assert ("wait" in stages) == (frame["camera"] == "near"), frame
    waited = stages.pop("wait", None)
    assert list(stages) == ["upload", "generate", "distribute", "composite", "gather", "output"], stages
    assert stages["generate"]["mean"] > 0, stages
    assert all(0 <= stage["mean"] <= stage["slowest"] <= frame["ms"] for stage in stages.values()), (frame, waited)
    assert frame["bytes_sent"] > 0 and frame["device_bytes"] > 0 and frame["dropped"] == 0, frame
    kinds = [] if frame["step"] == 2 else ["vdi", "png"] if frame["camera"] == "far" else ["vdi"]
    names = ["%s_%d.%s" % (frame["camera"], frame["step"], kind) for kind in kinds]
    assert sorted(os.path.basename(name) for name in frame["files"]) == sorted(names), frame
    assert frame["bytes_written"] == sum(os.path.getsize(name) for name in frame["files"]), frame
    assert (stages["output"]["mean"] > 0) == bool(kinds), frame
failed = [frame for frame in frames if "error" in frame]
assert len(failed) == 1 and failed[0]["step"] == 2 and "asked to fail" in failed[0]["error"], failed
assert (end["frames"], end["failed"], end["dropped"]) == (5, 1, 0), end
assert end["bytes_written"] == sum(frame["bytes_written"] for frame in made), end
assert 0 < end["waited_seconds"] < end["seconds"], end
text = open("run.log").read().splitlines()
assert len(text) == 8 and text[0].startswith("run of two_filters.py, 2 ranks"), text
assert text[1].startswith("step 1, time 0.5, near: ") and "near_1.vdi" in text[1], text

said = subprocess.run([tool, "log", "run.jsonl"], check=True, capture_output=True, text=True, timeout=30).stdout
assert "5 frames made, 1 failed" in said and "run.svg" in said, said
assert "two_filters.py, 2 ranks" in open("run.svg").read()
