"""The recipes of docs/recipes.md: each has the text of a file in python_pipelines/, which runs.

Several recipes share a run. The tests run the recipes with fewer pixels. The environment has PVBATCH,
PVPYTHON, MPIEXEC, SCREEN (a command that runs another one with a display), PV_PLUGIN_CONFIG_FILE
and PYTHONPATH.
"""

import atexit
import csv
import functools
import json
import os
import shlex
import shutil
import sys
import tempfile

import skimage.io
from documents import SOURCE, TOOL, main, made, run, tests, write

RUNS = tempfile.mkdtemp()
atexit.register(shutil.rmtree, RUNS)
SIMULATION, PARAVIEW = (os.path.join(SOURCE, "tests", "docs", name) for name in ("recipe_simulation.py",
                                                                                 "recipe_paraview.py"))


def path_of(name):
    return os.path.join(SOURCE, "python_pipelines", name)


def text_of(path):
    with open(path) as file:
        return file.read()


def sets_range(name, text):
    if name.endswith(".json"):
        return "range" in json.loads(text).get("colors", {})
    return "RescaleTransferFunction(" in text or '"colors": {"range":' in text


def recipe(name, runs, part="recipes"):
    """Registers a function as the test of a recipe's file. It is called in the folder in which `runs` has
    run the recipe. Its part is "recipes", or "recipes_long" in long runs."""
    recipe_text = text_of(path_of(name))

    def register(function):
        @tests(part, "docs/recipes.md", recipe_text)
        @functools.wraps(function)
        def test(text):
            assert text == recipe_text, "the page has more than the file"
            # Without a range, a restarted run would have that of its own first frame.
            assert name == "follow.py" or sets_range(name, text), "no range of colours"
            os.chdir(runs(name))
            function()
        return function
    return register


def run_on(ranks, *command):
    """Runs a command on some ranks, without a display, in the current folder."""
    environment = {name: value for name, value in os.environ.items() if name != "DISPLAY"}
    run(os.environ["MPIEXEC"], "--oversubscribe", "-n", str(ranks), *command, env=environment)


def folder_of(name):
    path = os.path.join(RUNS, name)
    os.makedirs(path, exist_ok=True)
    return path


def smaller(name):
    """Copies a script to the current folder with fewer pixels, and returns the copy's path."""
    text = text_of(path_of(name))
    assert text.count("640, 360") == 1, "%s has %d resolutions of 640, 360" % (name, text.count("640, 360"))
    write(name, text.replace("640, 360", "160, 90"))
    return os.path.abspath(name)


@functools.cache
def saved_state():
    os.chdir(folder_of("state"))
    run(os.environ["PVBATCH"], PARAVIEW, "state", smaller("save_state.py"))
    return os.getcwd()


@functools.cache
def run_documents():
    """All JSON files, one after the other in one program, on one rank to save time. The second run of
    restart.json begins where a checkpoint of the first may have been."""
    runs = []
    for name, first, end in (("cameras.json", 0, 11), ("cinema.json", 0, 1), ("condition.json", 0, 31),
                             ("budget.json", 0, 31), ("colors.json", 30, 31), ("restart.json", 0, 21),
                             ("restart.json", 15, 41)):
        folder = folder_of(name)
        document = json.loads(text_of(path_of(name)))
        document["resolution"] = [64, 36]
        if name == "colors.json":
            shutil.copy(os.path.join(saved_state(), document["colors"]["file"]), folder)
        runs.append([folder, document, first, end])
    os.chdir(RUNS)
    write("runs.json", json.dumps(runs))
    run_on(1, sys.executable, SIMULATION, "json", "runs.json")


def of_documents(name):
    run_documents()
    return folder_of(name)


@functools.cache
def run_scripts():
    """The scripts and the saved state, in one simulation on two ranks."""
    state = os.path.join(saved_state(), "state.py")
    os.chdir(folder_of("scripts"))
    scripts = [smaller("picture.py"), smaller("live.py"), state]
    run_on(2, sys.executable, SIMULATION, "scripts", *scripts)
    return os.getcwd()


def of_scripts(_):
    return run_scripts()


def picture(path):
    """The pixels [y][x][3] of a picture, which must show something."""
    pixels = skimage.io.imread(path)[..., :3].astype(int)
    share = (abs(pixels - pixels[0, 0]).max(axis=2) > 8).mean()
    assert share > 0.01, "%s: %.3f of the pixels show something" % (path, share)
    return pixels


def picture_of(vdi):
    """The picture of a .vdi file from its viewpoint."""
    run(TOOL, "render", vdi, "-o", "picture.png")
    return picture("picture.png")


def differ(pictures):
    for first, second in zip(pictures, pictures[1:]):
        assert abs(first - second).max() > 16, "two pictures are the same"


def events():
    return [json.loads(line) for line in text_of("run.jsonl").splitlines()]


@recipe("cameras.json", of_documents)
def cameras():
    for step in (0, 10):
        names = ["%s/vdi_%06d" % (camera, step) for camera in ("front", "top", "near")]
        assert all(os.path.getsize(name + ".vdi") > 0 for name in names)
        differ([picture(name + ".png") for name in names])


@recipe("cinema.json", of_documents)
def cinema():
    with open("views.cdb/data.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    places = {(float(row["phi"]), float(row["theta"])) for row in rows}
    assert len(places) == 36 and {theta for _, theta in places} == {-30, 0, 30}, places
    for row in rows:
        picture(os.path.join("views.cdb", row["FILE"]))


@recipe("condition.json", of_documents)
def condition():
    assert made("*") == ["hot_000020.vdi", "hot_000030.vdi"], made("*")


@recipe("budget.json", of_documents)
def budget():
    told = [(event["event"], event["step"]) for event in events() if "step" in event]
    assert told == [("frame", 0), ("left_out", 10), ("left_out", 20), ("left_out", 30)], told
    assert made("*.vdi") == ["vdi_000000.vdi"], made("*.vdi")


@recipe("colors.json", of_documents)
def colors():
    pixels = picture("colors_000030.png")
    greenest = (pixels[..., 1] - pixels[..., [0, 2]].max(axis=2)).max()
    assert greenest > 10, "viridis has green, Cool to Warm doesn't: %s" % greenest


@recipe("restart.json", of_documents)
def restart():
    assert made("*.vdi") == ["vdi_%06d.vdi" % step for step in range(0, 41, 10)], made("*.vdi")
    steps = [event["step"] for event in events() if event["event"] == "frame"]
    assert steps == [0, 10, 20, 20, 30, 40], steps


@recipe("picture.py", of_scripts)
def picture_of_script():
    for step in (0, 5):
        differ([picture("%s_%06d.png" % (name, step)) for name in ("front", "turned")])
    assert (picture("front_000000.png")[0, 0] == 255).all(), "the background is white"


@recipe("live.py", of_scripts)
def live():
    """tests/stream/simulation_test.py checks the frames that viewers get."""
    assert text_of("link").startswith("http://127.0.0.1:"), text_of("link")
    assert not os.path.exists("vdi-stream.link"), "the link ends with the run"


@recipe("save_state.py", of_scripts)
def state():
    saved = text_of(os.path.join(saved_state(), "state.py"))
    assert "VolumetricDepthImage(" in saved and "0.45" in saved, saved
    assert made("state_*") == ["state_%06d.vdi" % step for step in (0, 5)], made("state_*")
    picture_of("state_000005.vdi")


def of_grid(name):
    os.chdir(folder_of(name))
    run_on(2, sys.executable, SIMULATION, "grid", smaller(name), path_of("tetrahedra.py"))
    return os.getcwd()


@recipe("unstructured.py", of_grid)
def unstructured():
    picture_of("vdi_000030.vdi")


def of_tetrahedra(name):
    os.chdir(folder_of(name))
    run_on(3, sys.executable, smaller(name))
    run_on(3, sys.executable, SIMULATION, "lattice", path_of(name))
    return os.getcwd()


@recipe("tetrahedra.py", of_tetrahedra, "recipes_long")
def tetrahedra():
    differ([picture_of("bar_%06d.vdi" % step) for step in (0, 1)])


def of_part(name):
    os.chdir(folder_of(name))
    run_on(3, sys.executable, smaller(name))
    return os.getcwd()


@recipe("subcommunicator.py", of_part, "recipes_long")
def subcommunicator():
    picture_of("part_000001.vdi")


def of_follow(name):
    os.chdir(folder_of(name))
    os.mkdir("later")
    for step, field in ((0, "sphere"), (10, "turbulence")):
        run(TOOL, "generate", "--field", field, "--size", "16x16x16", "--resolution", "64x36", "-o",
            "later/a_%06d.vdi" % step)
    run(*shlex.split(os.environ["SCREEN"]), os.environ["PVPYTHON"], PARAVIEW, "follow", path_of(name))
    return os.getcwd()


@recipe("follow.py", of_follow)
def follow():
    differ([picture("first.png"), picture("second.png")])


main()
