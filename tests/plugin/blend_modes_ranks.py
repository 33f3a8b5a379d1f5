"""Maximum and minimum intensities and isosurfaces on several ranks: the picture is that of one rank, which is written
first."""

import os
import sys

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from pvtest import *  # noqa: E402,F403

mode = sys.argv[1]
source = blocks_source("random")
set_colors("scalars", 0, 1)
view = make_view([160, 120], [1.9, 1.4, 2.1], [0.5, 0.5, 0.5])
image = vdi_filter(source, view, "POINTS", "scalars", 0.05, PictureOnly=1, IsosurfaceValues=[0.4, 0.6, 0.8])
for name in ("Maximum Intensity", "Minimum Intensity", "Isosurface"):
    image.BlendMode = name
    if name == "Minimum Intensity":  # low scalars, which are transparent otherwise
        simple.GetOpacityTransferFunction("scalars").Points = [0, 0.8, 0.5, 0, 1, 0.8, 0.5, 0]
    seen = picture(image)
    path = "blend_mode_%s.png" % name.replace(" ", "_")
    if mode == "write":
        check(seen.max() > 100 and (seen.max(axis=2) > 8).mean() > 0.1, name + ": there is something to see")
        write_png(path, seen)
    else:
        off = np.abs(seen.astype(int) - read_png(os.path.join(OUTPUT, path)).astype(int)).max(axis=2)
        # A ray that just touches a surface crosses it or doesn't, as rounding has it.
        most = 0.001 if name == "Isosurface" else 0.0
        check((off > 2).mean() <= most, "%s: the picture of several ranks equals one rank's, worst channel off by %d, "
              "%.4f of the pixels by more than 2" % (name, off.max(), (off > 2).mean()))
finish()
