"""Colour maps that lack channels or have steps, on several ranks: the picture is that of one rank, which is written
first."""

import os
import sys

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from pvtest import *  # noqa: E402,F403

MAPS = {
    "no red": [0, 0, 0, 1, 0.5, 0, 0.2, 1, 1, 0, 1, 0.3],
    "blue": [0, 0, 0, 1, 0.5, 0, 0, 0.1, 1, 0, 0, 0.8],
    "bands": [0, 1, 0, 0, 0.4, 1, 0, 0, 0.4, 0, 1, 0, 0.7, 0, 1, 0, 0.7, 0, 0, 1, 1, 0, 0, 1],
}
LACKS = {"no red": [0], "blue": [0, 1], "bands": []}

mode = sys.argv[1]
source = blocks_source("random")
colors, opacity = set_colors("scalars", 0, 1)
view = make_view([160, 120], [1.9, 1.4, 2.1], [0.5, 0.5, 0.5])
image = vdi_filter(source, view, "POINTS", "scalars", 0.05)
for name, points in MAPS.items():
    colors.RGBPoints = points
    seen = picture(image)
    path = "color_map_%s.png" % name.replace(" ", "_")
    check(seen[..., LACKS[name]].sum() == 0, name + ": none of a channel that the colour map lacks")
    if mode == "write":
        check(seen.max() > 100 and (seen.max(axis=2) > 8).mean() > 0.1, name + ": there is something to see")
        write_png(path, seen)
    else:
        worst = np.abs(seen.astype(int) - read_png(os.path.join(OUTPUT, path)).astype(int)).max()
        check(worst <= 2, "%s: the picture of several ranks equals one rank's, worst channel off by %d" % (name, worst))
finish()
