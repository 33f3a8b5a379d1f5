"""A source that's distributed by ParaView itself: N ranks against one.

Usage: distributed.py write|compare. `write` (1 rank) makes the pictures to compare with. Nothing is updated before the VDI
asks for it, since an earlier update would hide a wrong request."""

import os
import sys

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from pvtest import *  # noqa: E402,F403

mode = sys.argv[1]


def vdi_of_wavelet(association):
    source = simple.Wavelet()
    if association == "CELLS":
        source = simple.PointDatatoCellData(Input=source)
    image = simple.VolumetricDepthImage(Input=source)
    image.SelectInputScalars = [association, "RTData"]
    image.Resolution = [160, 120]
    image.CameraPosition = [60, 45, 75]
    return image


for association in ("POINTS", "CELLS"):
    path = "distributed_%s.png" % association
    saved = os.path.join(OUTPUT, "distributed_%s_%s.vdi" % (association, mode))
    simple.SaveData(saved, proxy=vdi_of_wavelet(association))
    read = picture(simple.OpenDataFile(saved))
    live = picture(vdi_of_wavelet(association))
    check((live.max(axis=2) > 8).mean() > 0.03, association + ": there is something to see")
    check(np.abs(live.astype(int) - read).max() <= 1, association + ": what is saved is what is shown")
    if mode == "write":
        write_png(path, live)
    else:
        worst = np.abs(live.astype(int) - read_png(os.path.join(OUTPUT, path))).max()
        check(worst <= 1, "%s: the ranks' picture is that of one rank, worst channel off by %d" % (association, worst))
finish()
