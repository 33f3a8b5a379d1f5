"""A rank of several loses its Vulkan device while a VDI is made (lose_device.c). All ranks start anew,
and the VDI is made in the same update. Where every device is lost the filter fails, and the next update
works again."""

import os
import sys

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from pvtest import *  # noqa: E402,F403

LOSE = os.environ["VDI_TEST_LOSE_DEVICE"]
if os.path.isdir(LOSE):
    os.rmdir(LOSE)
image = simple.VolumetricDepthImage(Input=simple.Wavelet())
image.SelectInputScalars = ["POINTS", "RTData"]
image.Resolution = [160, 120]
image.CameraPosition = [60, 45, 75]
before = picture(image)
check((before.max(axis=2) > 8).mean() > 0.03, "there is something to see")


def made_anew(supersegments):
    image.Supersegments = supersegments
    return picture(image)


open(LOSE, "w").close()
after = made_anew(24)
check(not os.path.exists(LOSE), "a rank loses its device")
worst = np.abs(after.astype(int) - before).max()
check(worst <= 1, "and the VDI is there in the same update, worst channel off by %d" % worst)
worst = np.abs(made_anew(23).astype(int) - before).max()
check(worst <= 1, "and so is the next one")

os.mkdir(LOSE)
try:
    failed = made_anew(22) is None
except RuntimeError:
    failed = True
check(failed, "where every device is lost, the filter fails")
os.rmdir(LOSE)
worst = np.abs(made_anew(21).astype(int) - before).max()
check(worst <= 1, "and works again on new devices")
finish()
