"""Our volume rendering against ParaView's own on real data: a brain of the package mricron-data, unshaded, with point and
cell data, 8 and 16 bits and floats, perspective and parallel. The argument "all" adds cases that repeat others."""

import sys

import numpy as np
from pvtest import *  # noqa: F403

ALL = sys.argv[1:] == ["all"]
brain, spacing = brain_of("ch2better", 2)
CASES = {
    "uint8": (np.uint8, 1.0, False, None),
    "uint16_cells": (np.uint16, 200.0, True, None),
    "float_parallel": (np.float32, 0.01, False, 110.0),
}
for name, (kind, scale, as_cells, parallel_scale) in CASES.items():
    source, center = source_of_values((brain * scale).astype(kind), "brain", spacing, as_cells=as_cells)
    association = "CELLS" if as_cells else "POINTS"
    set_colors("brain", 20 * scale, 250 * scale, peak=0.6)
    view = make_view([160, 160], list(center + [210, 170, 330]), list(center), parallel_scale)
    ours = picture(vdi_filter(source, view, association, "brain", 4.0))
    theirs = paraview_volume(source, view, association, "brain", 4.0)
    similar = ssim(ours, theirs)
    check(ours.max() > 100, name + ": the brain is there")
    check(similar >= 0.98, "%s: SSIM with ParaView's own volume rendering %.4f" % (name, similar))
    write_png("brain_%s.png" % name, np.hstack([ours, theirs]))
    simple.Delete(view)

# Direction matrices that mirror and permute the axes, one of them to within rounding: ParaView's picture, also shaded, and
# the picture of the same values in the world's order.
values = waves((14, 18, 22), (1, 1, 1))
DIRECTIONS = {"nearly_identity": [[1, 0, 0], [0, 1 - 1e-12, 0], [1e-12, 0, 1]], "mirrored": [[-1, 0, 0], [0, 1, 0], [0, 0, -1]],
              "permuted": [[0, 0, 1], [1, 0, 0], [0, 1, 0]], "both": [[0, -1, 0], [0, 0, 1], [-1, 0, 0]]}
for as_cells in (False, True):
    association = "CELLS" if as_cells else "POINTS"
    for name, rows in DIRECTIONS.items():
        if as_cells and name != "both" and not ALL:
            continue
        image = image_of(values, "waves", (1.0, 1.5, 0.75), (3, -2, 5), as_cells)
        image.SetExtent(2, image.GetDimensions()[0] + 1, -3, image.GetDimensions()[1] - 4, 5, image.GetDimensions()[2] + 4)
        image.SetDirectionMatrix(*np.ravel(rows).astype(float))
        source = producer_of(image)
        source.UpdatePipeline()
        center = np.array(image.GetCenter())
        matrix = np.rint(rows).astype(int)
        axes, signs = np.abs(matrix).argmax(1), matrix.sum(1)
        reordered = values.transpose(2, 1, 0).transpose(axes)[tuple(slice(None, None, sign) for sign in signs)]
        bounds = image.GetBounds()
        in_order, _ = source_of_values(reordered.transpose(2, 1, 0), "waves", np.array(image.GetSpacing())[axes],
                                       bounds[::2], as_cells)
        set_colors("waves", values.min(), values.max(), peak=0.5)
        view = make_view([150, 120], list(center + [28, 22, 50]), list(center))
        for shade in (0, 1) if ALL else (1,):
            ours = picture(vdi_filter(source, view, association, "waves", 2.0, Shade=shade))
            plain = picture(vdi_filter(in_order, view, association, "waves", 2.0, Shade=shade))
            check(np.abs(ours.astype(int) - plain).max() <= 1, "%s %s, shade %d: the picture of the values in order"
                  % (name, association, shade))
            theirs = paraview_volume(source, view, association, "waves", 2.0, Shade=shade)
            similar = ssim(ours, theirs)
            write_png("directions_%s_%s_%d.png" % (name, association, shade), np.hstack([ours, theirs]))
            check(similar >= (0.95 if shade else 0.98), "%s %s, shade %d: SSIM with ParaView's own %.4f"
                  % (name, association, shade, similar))
        simple.Delete(view)
# One slice of points, and one of cells, is a sheet.
for as_cells in (False, True):
    image = image_of(values[:1], "waves", (1.0, 1.5, 0.75), as_cells=False)
    if as_cells:
        image = image_of(values[0, :-1, :-1][None], "waves", (1.0, 1.5, 0.75), as_cells=True)
        image.SetDimensions(values.shape[2], values.shape[1], 1)
    source = producer_of(image)
    source.UpdatePipeline()
    association = "CELLS" if as_cells else "POINTS"
    view = make_view([120, 100], [28, 32, 40], list(image.GetCenter()))
    check(picture(vdi_filter(source, view, association, "waves", 0.2)).max() > 100, "one slice of %s" % association)
    simple.Delete(view)

# Where a surface is a voxel wide, one sample per voxel shows the same as eight, in volume rendering and in VDIs, without
# wood grain. The functions: opacity that rises from 0 to 0.6 over a voxel of material, and opaque bands 4 % of the range
# wide.
BANDS = [0, 0]
for middle in (50, 112.5, 175):
    BANDS += [middle - 5, 0, middle - 4.99, 1, middle + 4.99, 1, middle + 5, 0]
FUNCTIONS = {"rising": ([20, 0, 250, 0.6], 0.99), "opaque_bands": (BANDS + [250, 0], 0.995)}
source, center = source_of_values(brain.astype(np.uint8), "brain", spacing)
for name, (nodes, least) in FUNCTIONS.items():
    _, opacity = set_colors("brain", 0, 250)
    points = []
    for x, value in zip(nodes[::2], nodes[1::2]):
        points += [x, value, 0.5, 0]
    opacity.Points = points
    view = make_view([240, 240], list(center + [210, 170, 330]), list(center))
    fine = picture(vdi_filter(source, view, "POINTS", "brain", 1.0, SamplingRate=8, PictureOnly=1))
    check(fine.max() > 100, name + ": the brain is there")
    for what, properties in (("volume rendering", {"PictureOnly": 1}), ("a VDI", {})):
        once = picture(vdi_filter(source, view, "POINTS", "brain", 1.0, SamplingRate=1, **properties))
        similar = ssim(once, fine)
        check(similar >= least, "%s: SSIM of %s at one and eight samples a voxel %.4f" % (name, what, similar))
        write_png("brain_%s_%s.png" % (name, what.split()[-1]), np.hstack([once, fine]))
    simple.Delete(view)

# A colour map without red, for floats: the picture has no red, either.
brain, spacing = brain_of("inia19-t1-brain")
source, center = source_of_values((brain / 250).astype(np.float32), "brain", spacing)
colors, opacity = set_colors("brain", 0, 1)
colors.RGBPoints = [0, 0, 0, 1, 0.5, 0, 0.2, 1, 1, 0, 1, 0.3]
opacity.Points = [0, 0, 0.5, 0, 0.1, 0, 0.5, 0, 1, 0.5, 0.5, 0]
extent = 0.9 * np.linalg.norm(np.array(brain.shape[::-1]) * spacing)
view = make_view([160, 160], list(center + extent * np.array([0.6, 0.5, 1.9])), list(center))
ours = picture(vdi_filter(source, view, "POINTS", "brain", 1.0))
theirs = paraview_volume(source, view, "POINTS", "brain", 1.0)
similar = ssim(ours, theirs)
check(ours[..., 1:].max() > 100, "no red: the brain is there")
check(ours[..., 0].max() == 0 and theirs[..., 0].max() == 0, "no red: a mean red of %.4f, ParaView's is %.4f"
      % (ours[..., 0].mean() / 255, theirs[..., 0].mean() / 255))
check(similar >= 0.999, "no red: SSIM with ParaView's own volume rendering %.4f" % similar)
write_png("brain_no_red.png", np.hstack([ours, theirs]))


# The default rate shows what eight samples per voxel show, and what ParaView shows, where hues change fast.
def hue(share):
    return [float(np.clip(abs((share * 6 + shift) % 6 - 3) - 1, 0, 1)) for shift in (0, 4, 2)]


def whole_brain(name):
    values, spacing = brain_of(name)
    source, center = source_of_values(values.astype(np.float32), "brain", spacing)
    size = np.linalg.norm(np.array(values.shape[::-1]) * spacing)
    return source, center, float(np.percentile(values[values > 0], 99.5)), size


def sphere():
    z, y, x = np.mgrid[0:64, 0:64, 0:64] - 31.5
    values = 100 * np.clip(20.3 - np.sqrt(x * x + y * y + z * z) + 0.5, 0, 1)
    source, center = source_of_values(values.astype(np.float32), "brain")
    return source, center, 100.0, 85.0


DATA = {"ch2bet": lambda: whole_brain("ch2bet"), "inia19": lambda: whole_brain("inia19-t1-brain"), "sphere": sphere}
for data, make in DATA.items() if ALL else [("sphere", sphere)]:
    source, center, top, size = make()
    for name, count, middle, end in (("8_hues", 8, 0.15, 0.6), ("16_hues", 16, 0.15, 0.6), ("dense", 8, 0.8, 0.9)):
        colors, opacity = set_colors("brain", 0, top)
        colors.RGBPoints = sum([[top * i / (count - 1)] + hue(i * (5 if count > 8 else 1) % count / count)
                                for i in range(count)], [])
        opacity.Points = [0, 0, 0.5, 0, top / 2, middle, 0.5, 0, top, end, 0.5, 0]
        view = make_view([160, 160], list(center + np.array([0.5, 0.4, 0.8]) * 1.6 * size), list(center))
        theirs = paraview_volume(source, view, "POINTS", "brain", 1.0)  # may stretch the function over the data
        fine = picture(vdi_filter(source, view, "POINTS", "brain", 1.0, SamplingRate=8, PictureOnly=1))
        check(fine.max() > 100, "%s %s: something is there" % (data, name))
        for what, properties in (("volume rendering", {"PictureOnly": 1}), ("a VDI", {})):
            image = vdi_filter(source, view, "POINTS", "brain", 1.0, **properties)
            seen = picture(image)
            image.UpdatePropertyInformation()
            report = image.SMProxy.GetProperty("Report").GetElement(0)
            rate = report.split("samples per voxel: ")[1].split()[0]
            similar, to_theirs, fine_to_theirs = ssim(seen, fine), ssim(seen, theirs), ssim(fine, theirs)
            # Volume itself is coarse where hues change fast, so the picture need only be as near to it as the fine one.
            check(similar >= 0.995 and to_theirs >= fine_to_theirs - 0.004,
                  "%s %s: SSIM of %s at the default rate, %s, and eight %.4f; to ParaView's %.4f, at eight %.4f"
                  % (data, name, what, rate, similar, to_theirs, fine_to_theirs))
            write_png("%s_%s_%s.png" % (data, name, what.split()[-1]), np.hstack([seen, fine, theirs]))
        simple.Delete(view)
finish()
