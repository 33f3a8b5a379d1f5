"""A field in the layouts of real codes. Its pictures are the same as those of an array in order,
and the host copies none of the layouts. Arguments: the case (same, ranks, ghosts, isolated, memory),
and the program layouts.c with its launcher."""

import io
import json
import os
import subprocess
import sys
import tempfile

from skimage import io as images

case, *simulation = sys.argv[1:]
ALONE = simulation[:-2] + ["1"] + simulation[-1:]
LAYOUTS = ["packed", "dof2", "z_fastest", "padded"]
CAMERA = {"position": [2.6, 2.0, 3.1], "focal_point": [0.5, 0.5, 0.5]}
RANGE = {"range": [-1.5, 1.5], "opacities": [[-1.5, 0.0], [0.3, 0.05], [1.5, 0.8]]}


def run(field, cells, steps=1, launcher=None, **document):
    """Returns the pictures, the record of each step's frame, and the bytes of the field."""
    document = {"field": field, "camera": CAMERA, "colors": RANGE, "resolution": [80, 60], "existing": "overwrite",
                "output": {"png": "v_{timestep}.png"}, "log": "run.jsonl", **document}
    process = subprocess.run([*(launcher or simulation), json.dumps(document), str(cells), field, str(steps)],
                             env={**os.environ, "VDI_OUTPUT": os.getcwd()}, capture_output=True, text=True, timeout=200)
    print(process.stderr)
    assert process.returncode == 0, (field, process.returncode)
    frames = [record for record in map(json.loads, open("run.jsonl")) if record["event"] == "frame"]
    assert len(frames) == steps, frames
    pictures = [open("v_%d.png" % step, "rb").read() for step in range(steps)]
    return pictures, frames, int(process.stdout.split()[-1])


def differences(one, other):
    """The differences between two pictures, in 1/255."""
    one, other = (images.imread(io.BytesIO(picture)).astype(int) for picture in (one, other))
    assert one.max() > 80
    return abs(one - other)


def difference(one, other):
    """The largest difference between two pictures, in 1/255."""
    return differences(one, other).max()


def same():
    """One rank suffices, except for an array that some ranks lack."""
    def alone(field, steps=1, **document):
        return run(field, 30, steps, ALONE, **document)[0]
    expected = alone("packed", 2)
    assert expected[0] != expected[1]
    for layout in LAYOUTS[1:]:
        assert alone(layout, 2) == expected, layout
    # The phase of complex numbers is the array of their angles, and their magnitude is 2 everywhere.
    angle = alone("angle")
    assert alone("complex", component="phase") == angle
    assert alone("complex") != angle
    wide = {"range": [-1.5e12, 1.5e12], "opacities": [[-1.5e12, 0.0], [0.3e12, 0.05], [1.5e12, 0.8]]}
    assert alone("integers", colors=wide) == alone("integers_as_f64", colors=wide)
    # The same function, sampled half a cell away. With an offset of the wrong sign or axis it would lie a cell away.
    beside = differences(expected[0], alone("staggered")[0]).mean()
    assert 0 < beside < 0.6, beside
    # A rank without an array of the name counts as one whose block lacks it.
    partial = run("partial", 30)[0]
    assert difference(expected[0], partial[0]) > 20
    assert run("elsewhere", 30)[0] == partial
    condition = {"min": "elsewhere", "below": 0}
    assert run("elsewhere", 30, association="cells", when=condition, isolation="process")[0] == partial


def ranks():
    """Values off the middles of cells, where the corners of eight blocks meet: several ranks make the picture of one."""
    for field in ("packed", "z_fastest", "staggered", "staggered_thrice"):
        most = difference(run(field, 32, launcher=ALONE)[0][0], run(field, 32)[0][0])
        print("%s: ranks differ by at most %d/255" % (field, most))
        assert most <= 2, field


def ghosts():
    """Ghost layers that nobody has set, between blocks and at edges and corners: whatever they hold, the picture is the
    same, and several ranks make the picture of one. Colours over an automatic range would show a value that counts in it."""
    pictures = {}
    for field, colors in (("star_mirror", RANGE), ("star_periodic", "Cool to Warm")):
        pictures[field] = [run(field, 24, launcher=launcher, colors=colors)[0][0] for launcher in (ALONE, simulation)]
        most = difference(*pictures[field])
        print("%s: ranks differ by at most %d/255" % (field, most))
        assert most <= 1, field
    for garbage in ("star_periodic_huge", "star_periodic_zero"):
        assert run(garbage, 24, colors=colors)[0][0] == pictures["star_periodic"][1], garbage
    assert run("star_periodic_huge", 24, launcher=ALONE, colors=colors)[0][0] == pictures["star_periodic"][0]
    assert run("star_mirror", 24, colors=colors)[0][0] != pictures["star_periodic"][1], "the layers don't show"


def isolated():
    """Separate processes get what an array's strides, offset and ghost layers say: they make the same files."""
    for field in ("padded", "staggered_thrice", "star_mirror"):
        assert run(field, 24, 2, isolation="process")[0] == run(field, 24, 2)[0], field


def memory():
    """A copy would take the field's bytes once more. mpirun must not bind the rank to a core, where the device would
    read values in order directly, and those of other layouts from a staging buffer."""
    peaks, uploads = {}, {}
    for layout in LAYOUTS:
        _, frames, size = run(layout, 160, 3)
        peaks[layout] = frames[-1]["host_peak_bytes"]
        uploads[layout] = min(frame["stages"]["upload"]["slowest"] for frame in frames)
    for layout in LAYOUTS:
        print("%s: %.1f MiB more than packed, of a field of %.1f MiB; upload %.1f ms, %.2f of packed" % (
            layout, (peaks[layout] - peaks["packed"]) / 2 ** 20, size / 2 ** 20, uploads[layout],
            uploads[layout] / uploads["packed"]))
        assert peaks[layout] - peaks["packed"] < size / 4, layout


with tempfile.TemporaryDirectory() as folder:
    os.chdir(folder)
    {"same": same, "ranks": ranks, "ghosts": ghosts, "isolated": isolated, "memory": memory}[case]()
