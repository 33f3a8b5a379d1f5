"""Runs an example's program, or compares what it has made on several numbers of ranks.

    examples.py run FOLDER VDI_JSON LAUNCHER... PROGRAM...   with the adaptor and without it: the same result, bit for bit
    examples.py compare VDI_JSON FOLDER FOLDER               two such runs: the same result, the same pictures
"""

import json
import os
import shutil
import subprocess
import sys

import pv_vdi

WITH, WITHOUT = "with", "without"


def files(folder, ends):
    return sorted(name for name in os.listdir(folder) if name.endswith(ends))


def results(folder):
    found = {name: open(os.path.join(folder, name), "rb").read() for name in files(folder, (".npy", ".raw", ".bin"))}
    assert len(found) == 1 and all(len(content) > 1000 for content in found.values()), found.keys()
    return found


def run(folder, description, *program):
    shutil.rmtree(folder, ignore_errors=True)
    with open(description) as file:
        asked = json.load(file)
    asked["resolution"] = [64, 48]  # fewer and smaller frames, for the test's time
    asked["every"] *= 2
    for name, arguments in ((WITHOUT, []), (WITH, [json.dumps(asked)])):
        os.makedirs(os.path.join(folder, name))
        process = subprocess.run([*program, *arguments], cwd=os.path.join(folder, name), stderr=subprocess.PIPE, text=True,
                                 timeout=100)
        print(process.stderr)
        # The examples ignore the codes of the adaptor's calls, but it also prints what fails.
        assert process.returncode == 0 and "vdi_catalyst:" not in process.stderr, process.returncode
    assert results(os.path.join(folder, WITH)) == results(os.path.join(folder, WITHOUT)), "the adaptor changes the result"
    assert not files(os.path.join(folder, WITHOUT), (".vdi", ".png"))
    made = files(os.path.join(folder, WITH), ".vdi")
    assert len(made) > 1, made
    for name in made:
        assert len(pv_vdi.read(os.path.join(folder, WITH, name)).segments) > 500, name


def compare(description, one, several):
    with open(description) as file:
        most = 3 / 255 if json.load(file).get("shade") else 1 / 255  # the guide's bounds
    one, several = os.path.join(one, WITH), os.path.join(several, WITH)
    assert results(one) == results(several), "the number of ranks changes the result"
    made = files(one, ".vdi")
    assert made == files(several, ".vdi"), made
    pictures = []
    for name in made:
        alone, together = (pv_vdi.read(os.path.join(folder, name)) for folder in (one, several))
        pictures.append(alone.render()[0])
        difference = abs(pictures[-1] - together.render()[0]).max()
        print("%s: the pictures differ by %.1f / 255 at most" % (name, 255 * difference))
        assert difference <= most, difference
        assert (alone.time, alone.time_step) == (together.time, together.time_step)
    assert abs(pictures[0] - pictures[-1]).max() > 0.05, "nothing has changed from step to step"


{"run": run, "compare": compare}[sys.argv[1]](*sys.argv[2:])
