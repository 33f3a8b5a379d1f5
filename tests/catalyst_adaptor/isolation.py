"""Processes that make frames and die, stop, are slow, or find no room. Arguments: the case, the library to preload (die_at),
and the simulation with its launcher. Each case checks what the simulation has seen."""

import glob
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
import uuid

case, preload, *simulation = sys.argv[1:]
SMALL = {"field": "T", "resolution": [40, 30], "colors": {"range": [0, 1]}, "isolation": "process"}
RANKS = int(simulation[simulation.index("-n") + 1]) if "-n" in simulation else 1
LAST = RANKS - 1
PATIENCE = 250
# A sanitizer's library, which must be the first.
PRELOADED = "".join(library + ":" for library in os.environ.get("LD_PRELOAD", "").split(":") if library)
ENGINE = 2
SCRIPT = 3


def is_of_run(path, name):
    """Whether an environment in /proc is that of a process of the run with this name."""
    try:
        with open(path, "rb") as file:
            return b"VDI_TEST_RUN=" + name.encode() in file.read()
    except OSError:
        return False


def apart(name, programs=("vdi_catalyst_process", "mpirun", "orterun", "prterun", "prte", "mpiexec", "mpiexec.hydra")):
    """The numbers of the run's processes that make its frames, as they are: worker, supervisor, launcher."""
    found = {"work": [], "serve": [], "launcher": []}
    for path in glob.glob("/proc/[0-9]*/environ"):
        folder = os.path.dirname(path)
        try:
            with open(folder + "/cmdline") as file:
                words = file.read().split("\0")
        except OSError:
            continue
        if not is_of_run(path, name) or os.path.basename(words[0]) not in programs:
            continue
        if words[1] in found:
            found[words[1]].append(int(os.path.basename(folder)))
        elif "serve" in words:
            found["launcher"].append(int(os.path.basename(folder)))
    return found


class Run:
    """The output of a simulation: the code of each step, the microseconds that it took, and lines of the adaptor."""

    def __init__(self, what, steps, meanwhile=None, **environment):
        """Calls `meanwhile` with the run's name while the simulation runs."""
        text = what if isinstance(what, str) else json.dumps({**SMALL, **what})
        self.name = uuid.uuid4().hex
        start = time.monotonic()
        process = subprocess.Popen([*simulation, text, str(steps)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                   env={**os.environ, "VDI_TEST_RUN": self.name, **environment})
        try:
            if meanwhile:
                meanwhile(self.name)
            said, told = process.communicate(timeout=PATIENCE)
        finally:
            process.kill()
        self.seconds = time.monotonic() - start
        print(said, told, "%.1f s" % self.seconds, flush=True)
        assert process.returncode == 0, process.returncode
        # Open MPI 5 sometimes puts a line of the standard error into the standard output.
        self.lines = [line for line in (told + said).splitlines() if line.startswith("vdi_catalyst: ")]
        self.steps = [[int(word) for word in found] for found in
                      re.findall(r"^step \d+ (\d+) (\d+) (\d+)$", said, re.M)]
        self.codes = [step[0] for step in self.steps]
        self.end = int(re.search(r"^finalize (\d+)", said, re.M).group(1))
        assert len(self.codes) == steps, self.codes
        assert not self.left_behind(), self.left_behind()

    def left_behind(self):
        """Processes of the run that still exist some seconds after it."""
        for _ in range(100):
            left = [path for path in glob.glob("/proc/[0-9]*/environ") if is_of_run(path, self.name)]
            if not left:
                return []
            time.sleep(0.1)
        return left


def dying(stage, how="kill", rank=LAST, **environment):
    """Newer Open MPIs overwrite mmap, with the patcher that is off here. The preloaded library would no longer be called."""
    return {"LD_PRELOAD": PRELOADED + preload + ":libvulkan.so.1", "VDI_TEST_DIE": "%s:%d:%s" % (stage, rank, how),
            "OMPI_MCA_memory": "^patcher", **environment}


def made():
    return sorted(glob.glob("*.vdi"))


def one_line(run, pattern):
    assert len(run.lines) == 1 and re.search(pattern, run.lines[0]), run.lines


def dies(stage, during, how="kill", cause=r"was killed by signal 9 \(Killed\)", rank=LAST):
    """The adaptor prints one line and makes no more frames. Later steps fail at once, or aren't
    wanted."""
    run = Run({}, 8, VDI_TEST_PAUSE="300", **dying(stage, how, rank))
    one_line(run, "rank %d: the process that makes frames %s while it (%s).*no more frames" % (rank, cause, during))
    first = run.codes.index(ENGINE)
    assert run.codes == first * [0] + (8 - first) * [ENGINE] or \
        run.codes == first * [0] + [ENGINE] + (7 - first) * [0], run.codes
    assert run.seconds < 60


def start():
    for stage, during in (("start", "started"), ("initialize", "started")):
        process = subprocess.run([*simulation, json.dumps(SMALL), "1"], capture_output=True, text=True, timeout=PATIENCE,
                                 env={**os.environ, **dying(stage, VDI_TEST_RUN="none")})
        print(process.stdout, process.stderr)
        lines = [line for line in process.stderr.splitlines() if line.startswith("vdi_catalyst: ")]
        assert "initialize %d " % ENGINE in process.stdout and len(lines) == 1, lines
        assert "while it %s" % during in lines[0], lines


def waiting():
    dies("waiting", "waited for a step|took over step 0")


def taking():
    dies("taking", "made the frame of step 0")


def generating():
    dies("generating", "made the frame of step 0", "exit", "ended with exit status 7")


def writing():
    dies("writing", "made the frame of step", rank=0)
    assert not [name for name in os.listdir(".") if name.endswith(".vdi") and os.path.getsize(name) == 0]


def finalizing():
    run = Run({"every": 4}, 8, **dying("finalizing"))
    one_line(run, "rank %d: the process that makes frames was killed by signal 9 .* while it ended the run" % LAST)
    assert set(run.codes) == {0} and run.end == ENGINE, run.codes
    assert len(made()) == 2, made()


def copying():
    """The process dies while the simulation copies its values to it."""
    run = Run({"every": 2}, 8, VDI_TEST_SIZE="96", VDI_TEST_KILL="4")
    one_line(run, "rank %d: the process that makes frames was killed by signal 9 .*; no more frames" % LAST)
    assert ENGINE in run.codes or run.end == ENGINE, run.codes


def restart():
    """A new process makes the next frame, and earlier frames stay."""
    open("once", "w").close()
    run = Run({"isolation": {"restart": True}, "log": "run.jsonl"}, 8, VDI_TEST_PAUSE="500",
              **dying("writing", rank=0, VDI_TEST_DIE_ONCE=os.path.abspath("once")))
    told = [line for line in run.lines if " frames made, " not in line]
    assert len(told) == 1 and re.search("was killed by signal 9 .*; it starts again for the next frame", told[0]), told
    assert run.codes.count(ENGINE) == 1 and set(run.codes) == {0, ENGINE} and run.end == 0, run.codes
    assert not os.path.exists("once")
    # Frames that the simulation didn't wait for aren't reported as its wait.
    records = [json.loads(line) for line in open("run.jsonl")]
    starts = [record for record in records if record["event"] == "start"]
    assert len(starts) == 2 and all(start["isolated"] for start in starts) and records[-1]["isolated"], records
    assert any("; frames in separate processes took " in line for line in run.lines), run.lines
    # At most the frame that was being made and the one after it are lost.
    assert len(made()) >= 6 and made()[-1] == "vdi_000007.vdi", made()


def stopped():
    """Steps are left out while it is stopped, and the simulation continues. The cause is reported, whichever rank has it."""
    for stage, rank in (("writing", 0), ("taking", LAST)):
        run = Run({"output": stage + "_{timestep}.vdi"}, 10, **dying(stage, "stop", rank=rank))
        first = run.codes.index(SCRIPT)
        assert "rank %d: left out: the process that makes frames was stopped" % rank in run.lines[0], run.lines
        assert all(code == SCRIPT for code in run.codes[first:]), run.codes
        assert all("again, rank %d: left out: the process that" % rank in line for line in run.lines[1:-2]), run.lines
        assert "in all, %d steps were left out" % (10 - first) in run.lines[-2], run.lines
        assert run.end == ENGINE and "rank %d: the process that makes frames was stopped" % rank in run.lines[-1], run.lines
        assert "killing it" in run.lines[-1] and run.seconds < 60, run.lines


def slow():
    """At the end, the simulation waits for each frame that is still being made, and without a limit if viewers may steer. The
    limit is 300 s of a clock that hurries. A frame is made in more than 6 s."""
    slowly = dying("writing", "sleep", rank=0)
    run = Run({"output": "v_{timestep}.vdi"}, 3, VDI_TEST_HURRY="30", **slowly)  # two frames in 12 s, within 10 s each
    assert set(run.codes) == {0} and run.end == 0 and made() == ["v_0.vdi", "v_1.vdi", "v_2.vdi"], made()
    run = Run({"output": "s_{timestep}.vdi", "stream": {"steer": True}}, 1, VDI_TEST_HURRY="100", **slowly)
    assert run.codes == [0] and run.end == 0 and "s_0.vdi" in made(), made()
    run = Run({"output": "w_{timestep}.vdi"}, 1, VDI_TEST_HURRY="100", **slowly)  # within 3 s
    assert run.codes == [0] and run.end == ENGINE and "doesn't end the run; killing it" in run.lines[-1], run.lines


def impatient():
    """Without patience, no step waits: frames are left out, and all others are made."""
    run = Run({"isolation": {"patience": 0}, "resolution": [400, 300], "log": "run.jsonl"}, 30)
    assert set(run.codes) == {0} and run.end == 0, run.codes
    told = [re.search(r"(\d+) steps were left out", line) for line in run.lines]
    left_out = sum(int(found.group(1)) for found in told if found)
    assert len(made()) + left_out == 30 and left_out > 0, (len(made()), left_out)
    assert "left out: two earlier" in run.lines[0], run.lines
    records = [json.loads(line) for line in open("run.jsonl")]
    steps = {event: [record["step"] for record in records if record["event"] == event] for event in ("frame", "left_out")}
    assert len(steps["left_out"]) == left_out and sorted(steps["frame"] + steps["left_out"]) == list(range(30)), steps
    assert all(record["cause"].startswith("two earlier") for record in records if record["event"] == "left_out"), records
    assert records[-1]["event"] == "end" and records[-1]["left_out"] == left_out, records[-1]


def no_room():
    """If a rank finds no memory to share, the step fails on all ranks, and the next one is tried."""
    run = Run({"every": 2}, 6, VDI_TEST_SIZE="64", VDI_TEST_FILE_LIMIT="100000")
    assert run.codes == [SCRIPT, 0, SCRIPT, 0, 0, 0] and run.end == 0 and made() == ["vdi_000004.vdi"], run.codes
    assert "not enough memory for 3 MiB to share with the process" in run.lines[0] and "again" in run.lines[1], run.lines


def unreadable():
    """If a process can't map a step's pages, that step fails on all ranks, and the process makes the others' frames."""
    for rank in {0, LAST}:
        open("once", "w").close()
        run = Run({"output": "r%d_{timestep}.vdi" % rank}, 6, VDI_TEST_SIZE="32", VDI_TEST_PAUSE="300",
                  **dying("mapping", "fail", rank, VDI_TEST_DIE_ONCE=os.path.abspath("once")))
        one_line(run, "step 0: rank %d: not enough memory for 1 MiB to share with the process.*annot allocate memory" % rank)
        assert sorted([*run.codes, run.end]) == 6 * [0] + [SCRIPT], run.codes
        assert made() == ["r%d_%d.vdi" % (rank, step) for step in range(1, 6)], made()
        for name in made():
            os.remove(name)


def unnoted():
    """If the first process can't map the pages with steps that were left out, the log lacks them, and frames continue."""
    run = Run({"isolation": {"patience": 0}, "resolution": [400, 300], "log": "run.jsonl"}, 20, VDI_TEST_SIZE="32",
              **dying("noting", "fail", 0))
    assert set(run.codes) == {0} and run.end == 0 and made(), run.codes
    assert any("some skipped steps could not be logged: not enough memory" in line for line in run.lines), run.lines


def unequal():
    """Where ranks have different numbers of arrays, a rank without the array counts as one whose blocks lack it."""
    for how in ("process", "none"):
        run = Run({"field": "W", "output": how + "_{timestep}.vdi"}, 3, VDI_TEST_UNEQUAL="1", VDI_ISOLATION=how)
        assert run.codes == [0, 0, 0] and run.end == 0 and not run.lines, run.lines
    for step in range(3):
        assert open("process_%d.vdi" % step, "rb").read() == open("none_%d.vdi" % step, "rb").read()
    # A message about an array that all lack lists the others.
    for how in ("process", "none"):
        run = Run({"field": "X"}, 1, VDI_TEST_UNEQUAL="1", VDI_ISOLATION=how)
        assert "no array is named 'X'; the arrays are: cells 'T', cells 'W'" in run.lines[0], run.lines


def launcher():
    """A launcher that is missing or fails is reported in one line, with its own output."""
    for wish in ("no-such-launcher -n {ranks}", "false {hosts}"):
        process = subprocess.run([*simulation, json.dumps(SMALL), "1"], capture_output=True, text=True, timeout=PATIENCE,
                                 env={**os.environ, "VDI_ISOLATION_LAUNCHER": wish})
        print(process.stdout, process.stderr)
        lines = [line for line in process.stderr.splitlines() if line.startswith("vdi_catalyst: ")]
        assert "initialize %d " % ENGINE in process.stdout and len(lines) == 1, lines
        assert "their launcher said: " in lines[0], lines
    assert "no-such-launcher" in subprocess.run(
        [*simulation, json.dumps(SMALL), "1"], capture_output=True, text=True, timeout=PATIENCE,
        env={**os.environ, "VDI_ISOLATION_LAUNCHER": "no-such-launcher"}).stderr


def environment():
    """The environment overrides the text, and its values are checked."""
    run = Run({"every": 2}, 3, VDI_ISOLATION="none", **dying("taking"))
    assert run.codes == [0, 0, 0] and run.end == 0 and not run.lines, run.lines
    process = subprocess.run([*simulation, json.dumps(SMALL), "1"], capture_output=True, text=True, timeout=PATIENCE,
                             env={**os.environ, "VDI_ISOLATION": "thread"})
    assert "VDI_ISOLATION is 'thread'; it may be process, restart or none" in process.stderr, process.stderr


def ended():
    """A simulation that is killed leaves no process behind."""
    name = uuid.uuid4().hex
    process = subprocess.Popen([*simulation, json.dumps(SMALL), "10000"], stdout=subprocess.PIPE, text=True,
                               env={**os.environ, "VDI_TEST_RUN": name, "VDI_TEST_PAUSE": "100"}, start_new_session=True)
    while not process.stdout.readline().startswith("step 2"):
        assert process.poll() is None
    run = Run.__new__(Run)
    run.name = name
    for path in glob.glob("/proc/[0-9]*/environ"):
        if is_of_run(path, name) and "vdi_catalyst_process" not in os.readlink(os.path.dirname(path) + "/exe"):
            if os.path.basename(os.readlink(os.path.dirname(path) + "/exe")) == os.path.basename(simulation[-1]):
                os.kill(int(path.split("/")[2]), 9)
    process.wait(timeout=30)
    assert not run.left_behind(), run.left_behind()


def until_gone(file):
    """Waits until a worker has removed the file, which it does in a frame."""
    end = time.monotonic() + PATIENCE
    while os.path.exists(file):
        assert time.monotonic() < end
        time.sleep(0.01)


def signals():
    """A batch system's signals to workers, supervisors and launcher, within a frame and after it, do nothing."""
    step_signals = [signal.SIGHUP, signal.SIGINT, signal.SIGQUIT, signal.SIGUSR1, signal.SIGUSR2, signal.SIGALRM,
                    signal.SIGTERM, signal.SIGXCPU, signal.SIGTSTP]

    def send(name):
        until_gone("once")
        for _ in range(5):
            found = apart(name)
            assert len(found["work"]) == len(found["serve"]) == RANKS and len(found["launcher"]) == (RANKS > 1), found
            for number in step_signals:
                for process in found["work"] + found["serve"]:
                    os.kill(process, number)
                for process in found["launcher"] if number != signal.SIGHUP else []:
                    os.kill(process, number)
            time.sleep(0.2)

    open("once", "w").close()
    run = Run({}, 12, send, VDI_TEST_PAUSE="300", **dying("writing", "sleep", 0, VDI_TEST_DIE_ONCE=os.path.abspath("once")))
    assert not run.lines and set(run.codes) == {0} and run.end == 0, (run.lines, run.codes)
    assert len(made()) == 12, made()


def supervisor():
    """If the supervisor is killed, and the worker with it, the message says so."""
    def send(name):
        until_gone("once")
        os.kill(apart(name)["serve"][0], signal.SIGKILL)

    open("once", "w").close()
    run = Run({}, 8, send, VDI_TEST_PAUSE="300", **dying("writing", "sleep", 0, VDI_TEST_DIE_ONCE=os.path.abspath("once")))
    one_line(run, r"the process that makes frames was killed together with the one that supervises it, .*; no more frames")
    assert ENGINE in run.codes or run.end == ENGINE, run.codes


def script():
    """The programs and children that a script starts take signals as usual. If it ends the process, that costs one line."""
    run = Run(os.path.join(HERE, "isolation_script.py"), 5, VDI_TEST_PAUSE="300", VDI_ISOLATION="process")
    one_line(run, "rank 0: the process that makes frames ended with exit status 7 while it made the frame of step 2; no more")
    assert open("children").read() == "[-15, -15, 15]", open("children").read()
    assert ENGINE in run.codes or run.end == ENGINE, run.codes


HERE = os.path.dirname(os.path.abspath(__file__))
with tempfile.TemporaryDirectory() as folder:
    os.chdir(folder)
    globals()[case]()
    os.chdir("/")
