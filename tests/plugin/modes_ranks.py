"""Colour maps that lack channels or have steps, maximum and minimum intensities and isosurfaces on several ranks: the picture
is that of one rank, which is written first."""

import os
import sys

import numpy as np
from pvtest import *  # noqa: F403

MODE = sys.argv[1]
MAPS = {
    "no red": [0, 0, 0, 1, 0.5, 0, 0.2, 1, 1, 0, 1, 0.3],
    "blue": [0, 0, 0, 1, 0.5, 0, 0, 0.1, 1, 0, 0, 0.8],
    "bands": [0, 1, 0, 0, 0.4, 1, 0, 0, 0.4, 0, 1, 0, 0.7, 0, 1, 0, 0.7, 0, 0, 1, 1, 0, 0, 1],
}
LACKS = {"no red": [0], "blue": [0, 1], "bands": []}


def compare(name, seen, most=0.0):
    """Writes one rank's picture, or compares several ranks' with it. Up to a share `most` of the pixels may differ."""
    path = "mode_%s.png" % name.replace(" ", "_")
    if MODE == "write":
        check(seen.max() > 100 and (seen.max(axis=2) > 8).mean() > 0.1, name + ": there is something to see")
        write_png(path, seen)
    else:
        off = np.abs(seen.astype(int) - read_png(os.path.join(OUTPUT, path)).astype(int)).max(axis=2)
        check((off > 2).mean() <= most, "%s: the picture of several ranks equals one rank's, worst channel off by %d, "
              "%.4f of the pixels by more than 2" % (name, off.max(), (off > 2).mean()))


source = blocks_source("random")
view = make_view([160, 120], [1.9, 1.4, 2.1], [0.5, 0.5, 0.5])

colors, _ = set_colors("scalars", 0, 1)
image = vdi_filter(source, view, "POINTS", "scalars", 0.05)
for name, points in MAPS.items():
    colors.RGBPoints = points
    seen = picture(image)
    check(seen[..., LACKS[name]].sum() == 0, name + ": none of a channel that the colour map lacks")
    compare(name, seen)

_, opacity = set_colors("scalars", 0, 1)
image = vdi_filter(source, view, "POINTS", "scalars", 0.05, PictureOnly=1, IsosurfaceValues=[0.4, 0.6, 0.8])
for name in ("Maximum Intensity", "Minimum Intensity", "Isosurface"):
    image.BlendMode = name
    if name == "Minimum Intensity":  # low scalars, which are transparent otherwise
        opacity.Points = [0, 0.8, 0.5, 0, 1, 0.8, 0.5, 0]
    # A ray that just touches a surface crosses it or doesn't, as rounding has it.
    compare(name, picture(image), 0.001 if name == "Isosurface" else 0.0)
finish()
