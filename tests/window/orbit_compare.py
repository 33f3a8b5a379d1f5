"""Compares the notes of orbit_notes.py on the view with the tool's picture for the view's camera, and
the window with the notes. Arguments: a picture of the whole screen; "opened", if the camera
is to be the one that the VDI was made from."""

import json
import os
import subprocess
import sys

sys.path.insert(0, os.environ["VDI_TEST_SOURCE"])

import numpy as np  # noqa: E402
import pvtest  # noqa: E402
from pvtest import check  # noqa: E402

with open(os.path.join(pvtest.OUTPUT, "camera.json")) as file:
    note = json.load(file)
print(note)
expected_path = os.path.join(pvtest.OUTPUT, "expected.png")
command = [os.environ["VDI_TOOL"], "render", os.path.join(pvtest.OUTPUT, "input.vdi"), "-o", expected_path,
           "--resolution", "{}x{}".format(*note["size"])]
opened = sys.argv[2] == "opened"
for name in ("position", "focal-point", "view-up") if not opened else ():
    command += ["--view-angle", str(note["view-angle"])] if name == "position" else []
    command += ["--" + name] + [repr(value) for value in note[name]]
subprocess.run(command, check=True)
seen = pvtest.read_png(os.path.join(pvtest.OUTPUT, "view.png"))
expected = pvtest.read_png(expected_path)
legend = int(0.84 * seen.shape[1])  # where the view's colour bar begins; the tool draws none
likeness = pvtest.ssim(seen[:, :legend], expected[:, :legend])
print("the view, against the tool's picture: SSIM {:.4f}".format(likeness))
check(expected.std() > 10 and likeness > 0.99, "the view shows what the tool renders for its camera")
check(note["mode"] == "3D", "the view stays in 3-D")
check(note["representations"] == ["VDI"], "what was opened is shown as a VDI")
# A slow machine makes few of them in a drag of 1.5 s.
check(opened or note["interactive frames"] > 1, "there are frames while the mouse moves")

# The view's place on the screen is unknown: take the place where its picture fits best.
screen = pvtest.read_png(sys.argv[1]).astype(float).mean(axis=2)
view = seen.astype(float).mean(axis=2)
freedom = (screen.shape[0] - view.shape[0] + 1, screen.shape[1] - view.shape[1] + 1)
check(min(freedom) > 0, "the view fits the screen")


def correlation(picture, pattern):
    """The correlation at each place of the pattern."""
    transform = np.fft.rfft2(picture) * np.conj(np.fft.rfft2(pattern, picture.shape))
    return np.fft.irfft2(transform, picture.shape)[:freedom[0], :freedom[1]]


squares = correlation(screen ** 2, np.ones_like(view)) - 2 * correlation(screen, view)
row, column = np.unravel_index(squares.argmin(), squares.shape)
there = screen[row:row + view.shape[0], column:column + view.shape[1]]
difference = np.abs(there - view).mean()
print("the window shows that picture at {}, {}: mean difference {:.3f} of 255".format(column, row, difference))
check(difference < 1, "the window shows the view's picture")
pvtest.finish()
