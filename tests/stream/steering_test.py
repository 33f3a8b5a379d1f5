"""A viewer drives a simulation. Arguments: the script, or "json" for a run without one; vdi; the number of ranks; mpirun
and what follows it on its command line."""
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from viewer import Viewer  # noqa: E402

script, tool, ranks, *launch = sys.argv[1:]
RANKS = int(ranks)
ISOLATED = os.environ.get("VDI_ISOLATION") == "process"
CAMERA = {"position": [18, 20, 60], "focal_point": [18, 6, 6]}
RUN = {"field": "V", "camera": CAMERA, "resolution": [96, 54], "output": "v_{timestep:06d}.vdi", "log": "run.jsonl",
       "colors": {"range": [0, 1], "opacities": [[0, 0], [1, 1]]}, "stream": {"steer": True}}
PRESETS = ["bands", "haze"] if script == "json" else ["X Ray", "Viridis"]  # ParaView 5's names are longer
PATIENCE = 150


def check(holds, what):
    if not holds:
        sys.exit("FAILED  %s" % (what,))


def lines(path):
    """The complete lines of a file."""
    text = path.read_text()
    return text[:text.rfind("\n") + 1].splitlines()


def link_of(simulation, link):
    end = time.monotonic() + PATIENCE
    while not link.exists():
        check(simulation.poll() is None and time.monotonic() < end, "no link")
        time.sleep(0.1)
    address, token = link.read_text().strip().split("#token=")
    return int(address.split(":")[2].strip("/")), token


def listen(viewer, kind, holds=lambda message: True):
    """The next message of type `kind` for which `holds` is true. Acknowledges and skips parts of levels."""
    while True:
        message = viewer.message()
        if isinstance(message, tuple):
            frame, number, offset, part = message
            viewer.send(type="ack", frame=frame, level=number, bytes=offset + len(part))
        elif message["type"] == kind and holds(message):
            return message


def steering(viewer, holds):
    return listen(viewer, "steering", holds)


def level(viewer, holds=lambda message: True):
    return listen(viewer, "level", holds)


def values(message):
    return {one["name"]: one["value"] for one in message["parameters"]}


def enter(port, token):
    viewer = Viewer(port, timeout=PATIENCE)
    viewer.hello(token)
    return viewer


def drive(port, token, folder):
    driver, other = enter(port, token), enter(port, token)
    check(listen(driver, "welcome")["steer"], "steering is allowed")
    start = steering(driver, lambda message: message["generator"] is not None)
    check(start["driver"] is None and start["period"] == 1 and not start["paused"], start)
    check(start["generator"]["resolution"] == [96, 54] and start["generator"]["range"] == [0, 1], start)
    check([(one["name"], one["whole"], one["value"], one["low"], one["high"]) for one in start["parameters"]] ==
          [("level", False, 0.5, 0, 1), ("waves", True, 3, 1, 9), ("stop", True, 0, 0, 1)], start)
    other.send(type="steer", parameters={"level": 0.9})
    check("doesn't drive" in listen(other, "denied")["cause"], "only the viewer that drives steers")
    driver.send(type="drive")
    me = steering(driver, lambda message: message["driver"] is not None)
    check(me["driver"] == me["you"], me)
    check(steering(other, lambda message: message["driver"] is not None)["driver"] == me["you"], "others see who drives")
    other.send(type="drive")
    check("drives" in listen(other, "denied")["cause"], "one viewer drives")
    driver.send(type="steer", parameters={"level": 1.5})
    check("from 0 to 1" in listen(driver, "denied")["cause"], "bounds hold")

    # All settings of one message take effect at the same step.
    camera = {"position": [60.0, 20.0, 30.0], "focalPoint": [18.0, 6.0, 6.0], "viewUp": [0.0, 1.0, 0.0], "viewAngle": 25.0}
    driver.send(type="steer", camera=camera, parameters={"level": 0.8125, "waves": 5}, resolution=[120, 60], supersegments=7,
                sampling_rate=2, preset=PRESETS[0], range=[0.25, 0.75])
    now = steering(driver, lambda message: values(message)["waves"] == 5)
    check(now["generator"]["resolution"] == [120, 60] and now["generator"]["supersegments"] == 7, now)
    check((start["generator"]["sampling_rate"], now["generator"]["sampling_rate"]) == (0, 2), now)
    check(now["generator"]["range"] == [0.25, 0.75] and values(now)["level"] == 0.8125, now)
    check(steering(other, lambda message: values(message)["waves"] == 5)["driver"] == me["you"], "others see what is in force")
    level(driver, lambda announced: announced["width"] == 120)

    # While the simulation waits, its last step is made again for a new view, and no other step comes.
    driver.send(type="steer", paused=True)
    steering(driver, lambda message: message["paused"])
    time.sleep(0.5)
    before = lines(folder / "parameters_0.txt")
    preset = next(name for name in now["generator"]["presets"] if name.startswith(PRESETS[1]))
    driver.send(type="steer", resolution=[64, 48], preset=preset)
    now = steering(driver, lambda message: message["generator"]["resolution"] == [64, 48])
    check(now["generator"]["range"] == [0.25, 0.75], "another colour map has the range that there is: %s" % now)
    again = level(driver, lambda announced: announced["width"] == 64)
    # An isolated simulation may be two steps ahead of the frame that waits.
    ahead = int(before[-1].split()[0]) - again["step"]
    check(0 <= ahead <= (2 if ISOLATED else 0), "the step that waits is made again, and not %d steps later" % ahead)
    driver.send(type="steer", parameters={"level": 0.125})
    steering(driver, lambda message: values(message)["level"] == 0.125)
    check(lines(folder / "parameters_0.txt") == before, "the simulation waits")
    # When a driver leaves, the simulation continues, and the next viewer may drive.
    driver.close()
    steering(other, lambda message: message["driver"] is None and not message["paused"])
    other.send(type="drive")
    other.send(type="steer", period=4)
    steering(other, lambda message: message["period"] == 4)
    steps = [level(other)["step"] for _ in range(4)][1:]
    check(all((b - a) % 4 == 0 for a, b in zip(steps, steps[1:])), "a VDI every four steps: %s" % steps)
    other.send(type="steer", parameters={"stop": 1})
    return me["you"], again["step"], camera


def files_of(folder):
    """The output of vdi info for each step's file."""
    def told_of(path):
        return subprocess.run([tool, "info", path], check=True, capture_output=True, text=True, timeout=PATIENCE).stdout
    return {int(path.stem[2:]): told_of(path) for path in sorted(folder.glob("v_*.vdi"))}


def in_files(folder, at, paused_at):
    """Each file is the VDI of its step, by the settings then in force. Views made during a pause are for viewers only."""
    files = files_of(folder)
    check("96 x 54" in files[at] and "(18, 20, 60)" in files[at] and "at most 25 " in files[at], files[at])
    after = files[at + 1]
    check("120 x 60" in after and "(60, 20, 30)" in after and "at most 7 " in after and "from 0.25 to 0.75" in after, after)
    check("120 x 60" in files[paused_at] and "64 x 48" in files[paused_at + 1], files[paused_at + 1])
    steps = sorted(files)
    check(steps[-1] % 4 == 0 and steps[-1] - steps[-2] == 4, "the last files are every fourth step's: %s" % steps[-5:])
    frames = [json.loads(line) for line in lines(folder / "run.jsonl")]
    logged = [frame["step"] for frame in frames if frame["event"] == "frame" and frame["files"]]
    check(logged == steps, "the run's log has the files")


def told(folder, driver, paused_at, camera):
    """Checks which values each rank was given, and when."""
    parameters = [lines(folder / ("parameters_%d.txt" % rank)) for rank in range(RANKS)]
    check(all(one == parameters[0] for one in parameters), "all ranks have the same parameters at the same steps")
    log = [json.loads(line) for line in lines(folder / "vdi-steering.jsonl")]
    changes = [(entry["viewer"], *sorted(entry["steer"])) for entry in log if "steer" in entry]
    check(changes[0] == (driver, "camera", "parameters", "preset", "range", "resolution", "sampling_rate", "supersegments"),
          changes)
    check(all(entry["time"] == 0.5 * entry["step"] for entry in log), "the log has steps and times")
    given = {int(step): (float(value), int(waves)) for step, value, waves in (line.split() for line in parameters[0])}
    at = log[0]["step"]
    in_force = [entry for entry in log if "in_force" in entry]
    after = in_force[0]["step"] if ISOLATED else at
    check(given[after] == (0.5, 3) and given[after + 1] == (0.8125, 5), "parameters change after the step that the log names")
    after = in_force[1]["step"] if ISOLATED else paused_at
    check(given[after][0] == 0.8125 and given[after + 1][0] == 0.125,
          "a parameter that changes while the simulation waits is in force after that step")
    values_in_force = [entry["in_force"] for entry in in_force]
    check(values_in_force == ([{"level": 0.8125, "waves": 5}, {"level": 0.125}, {"stop": 1}] if ISOLATED else []),
          "the log says when an isolated simulation has the values: %s" % values_in_force)
    if script == "json":
        in_files(folder, at, paused_at)
        return
    views = [[json.loads(line) for line in lines(folder / ("view_%d.txt" % rank))] for rank in range(RANKS)]
    check(all(one == views[0] for one in views), "all ranks have the same properties at the same steps")
    seen = {view["step"]: view for view in views[0]}
    check(seen[at]["position"] == [18.0, 20.0, 60.0] and seen[at]["supersegments"] == 25,
          "the view changes after the step that the log names")
    after = seen[at + 1]
    check(after["position"] == camera["position"] and after["angle"] == 25.0 and after["supersegments"] == 7, after)
    check((seen[at]["rate"], after["rate"]) == (0, 2), "the sampling rate changes, too")
    check(after["resolution"] == [120, 60] and after["colours"] == after["opacities"] == [0.25, 0.75], after)
    check(after["first"] == [1.0, 1.0, 1.0], "X Ray begins with white: %s" % after["first"])


with tempfile.TemporaryDirectory() as name:
    root = pathlib.Path(name)
    what = json.dumps(RUN) if script == "json" else script
    program = subprocess.Popen([*launch, what], env={**os.environ, "VDI_OUTPUT": name}, cwd=name)
    try:
        told_by_viewers = drive(*link_of(program, root / "vdi-stream.link"), root)
        check(program.wait(PATIENCE) == 0, "the simulation ended with %s" % program.returncode)
        told(root, *told_by_viewers)
    finally:
        if program.poll() is None:
            program.terminate()
            program.wait(PATIENCE)
