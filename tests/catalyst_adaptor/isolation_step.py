"""Compares the cost of a step in a simulation whose frames are made in a separate process with that of the same
step without the library: between frames, while a frame is made, and when values are handed over. Argument: the simulation,
which runs on one rank.

With two cores or more, the simulation has the first one and the process the others. Prints the ratios of medians. It fails
if a step waits for a frame.
"""

import os
import re
import statistics
import subprocess
import sys
import tempfile

program = sys.argv[1]
CORES = sorted(os.sched_getaffinity(0))
OWN = len(CORES) > 1
STEPS = 1000
FRAME = 500  # the step whose frame is watched; that of step 0 has long been made
FILE = "vdi_%06d.vdi" % FRAME
TEXT = ('{"field": "T", "every": %d, "resolution": [640, 480], "colors": {"range": [0, 1]}, "existing": "overwrite", '
        '"isolation": "process"}') % FRAME


def run(what, steps, **environment):
    """The (microseconds, whether the watched frame doesn't exist yet) of each step."""
    command = [program, what, str(steps)]
    if OWN:
        command = ["taskset", "-c", str(CORES[0]), *command]
    process = subprocess.run(command, capture_output=True, text=True, timeout=500, check=True,
                             env={**os.environ, "VDI_TEST_SIZE": "64", "VDI_TEST_REPEAT": "20", "VDI_TEST_BUSY": FILE,
                                  **environment})
    assert not re.search("^(step [0-9]+|finalize|initialize) [1-9]", process.stdout, re.M), process.stdout
    return [(int(time), busy == "1") for time, busy in re.findall(r"^step \d+ 0 (\d+) (\d)$", process.stdout, re.M)]


with tempfile.TemporaryDirectory() as folder:
    os.chdir(folder)
    own = {}
    if OWN:  # a launcher of one process
        own["VDI_ISOLATION_LAUNCHER"] = "taskset -c " + ",".join(str(core) for core in CORES[1:])
    without = [time for time, _ in run("-", FRAME)]
    isolated = run(TEXT, STEPS, **own)
    os.remove(FILE)
    without += [time for time, _ in run("-", FRAME)]
    here = run(TEXT, FRAME + 1, VDI_ISOLATION="none")
    os.chdir("/")

base = statistics.median(without)
making = [time for time, busy in isolated[FRAME + 1:] if busy]
between = [time for time, busy in isolated[FRAME + 1:] if not busy]
handing = isolated[FRAME][0]
print("64^3 doubles, %s: a step takes %.2f ms without the library, %.2f ms where it hands over, %.2f ms where a frame is made "
      "in the simulation's process" % ("own cores" if OWN else "shared cores", base / 1e3, handing / 1e3, here[FRAME][0] / 1e3))
for name, times in (("between frames", between), ("while a frame is made", making)):
    if times:
        print("%s: %.3f of the step without the library (%d steps)" % (name, statistics.median(times) / base, len(times)))
assert between, "no frame was done before the end"
assert handing < base + (here[FRAME][0] - base) / 2, "handing over waits for the frame"
