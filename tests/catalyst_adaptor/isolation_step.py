"""Compares the cost of a step in a simulation whose frames are made in a separate process with that
of the same step without the library: between frames, while a frame is made, and when values are
handed over. Argument: the simulation, which runs on one rank.

With two cores or more, the simulation has the first one and the process the others. A step's time
differs from one process to the next, because each has other pages of memory. The ratio of steps of
the same process is far steadier. Prints the ratios of medians, as the median of all rounds with the
least and the most. It fails if a step waits for a frame.
"""

import math
import os
import re
import statistics
import subprocess
import sys
import tempfile

program = sys.argv[1]
CORES = sorted(os.sched_getaffinity(0))
OWN = len(CORES) > 1
ROUNDS = 3
FRAMES = 8  # in each round; the first of them makes buffers and compiles shaders, and doesn't count
LAUNCHER = "taskset -c " + ",".join(str(core) for core in CORES[1:])  # of one process


def run(what, steps, every, **environment):
    """The (microseconds, whether a frame is made meanwhile) of each step."""
    command = [program, what, str(steps)]
    if OWN:
        command = ["taskset", "-c", str(CORES[0]), *command]
    with tempfile.TemporaryDirectory() as folder:
        process = subprocess.run(command, capture_output=True, text=True, timeout=300, check=True, cwd=folder,
                                 env={**os.environ, "VDI_TEST_SIZE": "64", "VDI_TEST_REPEAT": "20",
                                      "VDI_TEST_EVERY": str(every), **environment})
    assert not re.search("^(step [0-9]+|finalize|initialize) [1-9]", process.stdout, re.M), process.stdout
    return [(int(time), busy == "1") for time, busy in re.findall(r"^step \d+ 0 (\d+) (\d)$", process.stdout, re.M)]


def text(every):
    return ('{"field": "T", "every": %d, "resolution": [640, 480], "colors": {"range": [0, 1]}, "isolation": "process"}'
            % every)


def median_without(steps):
    return statistics.median(time for time, _ in run("-", steps, 0))


def report(name, ratios):
    print("%s: %.3f (%.3f to %.3f)" % (name, statistics.median(ratios), min(ratios), max(ratios)))


here = [time for time, _ in run(text(2), 9, 0, VDI_ISOLATION="none")]
step = statistics.median(here[1::2])
frame = statistics.median(here[2::2])
EVERY = max(20, math.ceil(4 * frame / step))  # no frame is asked for before the last one is done
own = {"VDI_ISOLATION_LAUNCHER": LAUNCHER} if OWN else {}
print("64^3 doubles, %s: a step takes %.2f ms, %.2f ms where a frame is made in the simulation's process" %
      ("own cores" if OWN else "shared cores", step / 1e3, frame / 1e3))

handing, between, making, same = [], [], [], []
for _ in range(ROUNDS):
    bases = [median_without(EVERY * FRAMES // 4)]
    isolated = run(text(EVERY), EVERY * FRAMES, EVERY, **own)
    bases.append(median_without(EVERY * FRAMES // 4))
    base = statistics.median(bases)
    counted = list(enumerate(isolated))[EVERY:]
    idle = statistics.median(time for number, (time, busy) in counted if number % EVERY and not busy)
    busy = statistics.median(time for number, (time, busy) in counted if number % EVERY and busy)
    handing.append(statistics.median(time for number, (time, _) in counted if number % EVERY == 0) / base)
    between.append(idle / base)
    making.append(busy / base)
    same.append(busy / idle)
report("between frames, of the step without the library", between)
report("while a frame is made, of the step without the library", making)
report("while a frame is made, of the step between frames", same)
report("handing over, of the step without the library", handing)
assert statistics.median(handing) < (step + frame) / 2 / step, "handing over waits for the frame"
