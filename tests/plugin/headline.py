"""Blocks assigned to ranks at random: our picture on N ranks is that of one rank, whatever
ParaView's own rendering does.

Usage: headline.py write|compare. `write` (1 rank) makes the pictures to compare with; `compare` (several ranks) compares
and leaves headline.png: one rank, ours on several, ParaView's on several."""

import os
import sys

import numpy as np
from pvtest import *  # noqa: F403

VARIANTS = {  # name: (layout, kind, cell data, parallel scale)
    "random": ("random", "float32", False, None),
    "uint16_cells_parallel": ("random", "uint16", True, 0.75),
}
mode = sys.argv[1]
for name, (layout, kind, as_cells, scale) in VARIANTS.items():
    association = "CELLS" if as_cells else "POINTS"
    high = {"float32": 1.0, "uint8": 200.0, "uint16": 60000.0}[kind]
    source = blocks_source(layout, kind=kind, as_cells=as_cells)
    set_colors("scalars", 0, high)
    view = make_view([240, 180], [1.9, 1.4, 2.1], [0.5, 0.5, 0.5], scale)
    image = vdi_filter(source, view, association, "scalars", 0.05)
    ours = picture(image)
    rendered = simple.RenderVDI(Input=image)
    rendered.UseOriginalCamera = 1
    from_vdi = picture(rendered)
    theirs = None
    if mode == "write" or name == "random":
        theirs = paraview_volume(source, view, association, "scalars", 0.05)
    path = "one_rank_%s.png" % name
    if mode == "write":
        check(ours.max() > 100 and (ours.max(axis=2) > 8).mean() > 0.1, name + ": there is something to see")
        write_png(path, ours)
        similar = ssim(ours, theirs)
        check(similar > 0.97, "%s: one rank agrees with ParaView's volume rendering, SSIM %.4f" % (name, similar))
        write_png("one_rank_%s_both.png" % name, np.hstack([ours, theirs]))
    else:
        truth = read_png(os.path.join(OUTPUT, path))
        worst = np.abs(ours.astype(int) - truth).max()
        # Straight colour and opacity are bytes, each within 1 of one rank's: over black that makes 2.
        check(worst <= 2, "%s: the flat picture equals one rank's, worst channel off by %d" % (name, worst))
        # Colour and alpha are rounded separately, so a difference of a twentieth of a step can become two steps.
        off = np.abs(from_vdi.astype(int) - truth)
        check(off.max() <= 2 and off.mean() < 0.05,
              "%s: the VDI rendered from its own viewpoint equals one rank's picture, off by %d at most, "
              "%.4f on average" % (name, off.max(), off.mean()))
        if theirs is not None:
            print("%s: wrong by more than 16/255 of the object's pixels: ours %.2f %%, ParaView's own %.2f %%"
                  % (name, 100 * wrong_share(ours, truth), 100 * wrong_share(theirs, truth)), flush=True)
            check(wrong_share(theirs, truth) > 0.02, "ParaView's own rendering shows the fault that this test is about")
            write_png("headline.png", np.hstack([truth, ours, theirs]))
    simple.Delete(view)
    for proxy in (rendered, image, source):
        simple.Delete(proxy)
finish()
