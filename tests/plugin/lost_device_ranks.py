"""One of several ranks loses its Vulkan device while a VDI is made (lose_device.c). All ranks start
anew, and the VDI is made in the same update. Where every device is lost the filter fails, and the
next update works again."""

import os

import numpy as np
from pvtest import *  # noqa: F403

LOSE = os.environ["VDI_TEST_LOSE_DEVICE"]
if os.path.isdir(LOSE):
    os.rmdir(LOSE)
wavelet = simple.Wavelet()


def filter_at(*position):
    return filter_with(wavelet, "POINTS", "RTData", Resolution=[160, 120], CameraPosition=position)


image, sharing = filter_at(60, 45, 75), filter_at(-60, 45, 75)
before, before_of_other = picture(image), picture(sharing)
check((before.max(axis=2) > 8).mean() > 0.03, "there is something to see")


def made_anew(supersegments, image=image):
    image.Supersegments = supersegments
    return picture(image)


def report(image):
    image.SMProxy.UpdatePropertyInformation()
    return [line.split() for line in image.SMProxy.GetProperty("Report").GetElement(0).splitlines()[1:4]]


memory = [float(row[-1]) for row in report(sharing)]


open(LOSE, "w").close()
after = made_anew(24)
check(not os.path.exists(LOSE), "a rank loses its device")
worst = np.abs(after.astype(int) - before).max()
check(worst <= 1, "the update that loses a device makes the VDI, worst channel off by %d" % worst)
worst = np.abs(made_anew(23).astype(int) - before).max()
check(worst <= 1, "the next update after a lost device makes the VDI")
worst = np.abs(made_anew(24, sharing).astype(int) - before_of_other).max()
check(worst <= 1, "a filter that shared the volume makes its VDI, worst channel off by %d" % worst)
rows = report(sharing)
check(np.all([float(row[3]) == 0 for row in rows]), "the filter that shared the volume shares the new one")
check(np.all([float(row[-1]) <= 1.1 * was for row, was in zip(rows, memory)]),
      "the filter that shared the volume lets the old one go")

os.mkdir(LOSE)
try:
    failed = made_anew(22) is None
except RuntimeError:
    failed = True
check(failed, "where every device is lost, the filter fails")
os.rmdir(LOSE)
worst = np.abs(made_anew(21).astype(int) - before).max()
check(worst <= 1, "the filter works again on new devices")
finish()
