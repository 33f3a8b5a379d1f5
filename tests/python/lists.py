"""A .vdi file's lists as NumPy arrays, and pictures of them, compared with the tool's output for the same file.

Arguments: the tool, a folder."""

import gc
import os
import subprocess
import sys
import threading

import numpy as np
from skimage import io

import pv_vdi

TOOL, FOLDER = sys.argv[1:]
failures = []


def check(good, what):
    print(("ok      " if good else "FAILED  ") + what, flush=True)
    if not good:
        failures.append(what)


def path(name):
    return os.path.join(FOLDER, name)


def tool(*arguments):
    return subprocess.run([TOOL, *arguments], check=True, capture_output=True, text=True).stdout


def refused(action, words):
    """Whether it raises our error, which has all of these words."""
    try:
        action()
    except pv_vdi.Error as error:
        return all(word in str(error) for word in words)
    return False


def flattened(vdi):
    """The picture from V_O, [height][width][4], row 0 on top: each list's supersegments in front of one another."""
    picture = np.zeros((vdi.height * vdi.width, 4))
    segments, offsets = vdi.segments, vdi.offsets.astype(np.int64)
    counts = np.diff(offsets)
    for depth in range(counts.max()):
        lists = np.flatnonzero(counts > depth)
        segment = segments[offsets[lists] + depth]
        left = 1.0 - picture[lists, 3]
        for channel, name in enumerate(["red", "green", "blue", "opacity"]):
            picture[lists, channel] += left * segment[name]
    return picture.reshape(vdi.height, vdi.width, 4)[::-1]


def difference(colors, picture):
    """The largest of a channel, in 1/255, between premultiplied colours and an RGB picture over black."""
    return np.abs(255.0 * colors[..., :3] - io.imread(picture)[..., :3]).max()


def check_file(precision):
    name = path(precision + ".vdi")
    tool("generate", "--field", "turbulence", "--size", "24x20x16", "--resolution", "81x60", "--supersegments", "8",
         "--precision", precision, "-o", name, "--flat", path("flat.png"))
    vdi = pv_vdi.read(name)
    check(vdi.precision == precision and vdi.size == (81, 60) and len(vdi.offsets) == 81 * 60 + 1, "the shape: " + precision)
    check(vdi.offsets[-1] == len(vdi.segments) > 1000, "there are as many supersegments as the offsets say")
    check((vdi.segments["front"] < vdi.segments["back"]).all(), "each supersegment ends behind where it begins")
    check(difference(flattened(vdi), path("flat.png")) <= 1.0, "the composited lists are the picture")

    colors, depths = vdi.render()
    check(colors.shape == (60, 81, 4) and colors.dtype == np.float32 and depths.shape == (60, 81), "the picture's shape")
    first = np.full(81 * 60, np.inf, np.float32)
    some = np.flatnonzero(np.diff(vdi.offsets.astype(np.int64)))
    first[some] = vdi.segments["front"][vdi.offsets[some]]
    seen = colors[..., 3] > 0.01
    check(np.allclose(depths[seen], first.reshape(60, 81)[::-1][seen], rtol=1e-3), "depths are those of the lists' fronts")
    tool("render", name, "-o", path("turned.png"), "--azimuth", "20", "--resolution", "70x50")
    turned, _ = vdi.render(vdi.camera.azimuth(20.0), (70, 50))
    check(difference(turned, path("turned.png")) <= 1.0, "a turned view is the tool's")

    vdi.write(path("again.vdi"))
    with open(name, "rb") as one, open(path("again.vdi"), "rb") as other:
        check(one.read() == other.read(), "writing gives the same bytes")
    return vdi


os.makedirs(FOLDER, exist_ok=True)
check_file("full")
vdi = check_file("compact")
check(vdi.metadata["array"]["name"] == "turbulence" and len(vdi.metadata["transferFunction"]["colors"]) > 1,
      "the metadata name the array and its colours")
check(vdi.camera.parallel_scale is None and vdi.camera.azimuth(0.0) == vdi.camera, "the camera is a perspective one")

offsets, segments = vdi.offsets, vdi.segments
total = float(segments["opacity"].sum())
check(not offsets.flags.writeable and not segments.flags.writeable, "the arrays are read only")
pictures = []
threads = [threading.Thread(target=lambda: pictures.append(vdi.render(vdi.camera.azimuth(10.0))[0])) for _ in range(3)]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
check(len(pictures) == 3 and all((picture == pictures[0]).all() for picture in pictures), "threads render side by side")
del vdi
gc.collect()
check(offsets[-1] == len(segments) and float(segments["opacity"].sum()) == total, "arrays outlive their VDI")

check(refused(lambda: pv_vdi.read(path("none.vdi")), ["none.vdi"]), "a file that is missing is named")
with open(path("full.vdi"), "rb") as file:
    whole = file.read()
with open(path("cut.vdi"), "wb") as file:
    file.write(whole[:len(whole) // 2])
check(refused(lambda: pv_vdi.read(path("cut.vdi")), ["cut.vdi", "invalid .vdi file"]), "a file that is cut off is named")
vdi = pv_vdi.read(path("full.vdi"))
inside = pv_vdi.Camera((0, 0, 0), (0, 0, 0))
check(refused(lambda: vdi.render(inside), ["focal"]), "a camera without direction is refused")
check(refused(lambda: vdi.render(size=(0, 5)), ["0"]), "a picture without pixels is refused")
check(refused(lambda: vdi.render(reconstruction="sharp"), ["smooth"]), "an unknown reconstruction is refused")
sys.exit(1 if failures else 0)
