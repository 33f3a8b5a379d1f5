"""Shaded volumes: compares our volume rendering, and our VDI from its viewpoint, with ParaView's
own pictures. Also tests which display properties and lights the first update takes. The argument "all" adds cases that
repeat others."""

import sys

import numpy as np
from pvtest import *  # noqa: F403


def wavelet():
    source = simple.Wavelet(WholeExtent=[-20, 20, -20, 20, -20, 20])
    source.UpdatePipeline()
    image = source.GetClientSideObject().GetOutputDataObject(0)
    values = vtk_to_numpy(image.GetPointData().GetScalars()).reshape(41, 41, 41).astype(float)
    return (values - values.min()) * 250 / (values.max() - values.min())


def waves(shape, spacing):
    z, y, x = np.meshgrid(*[np.arange(n) * s for n, s in zip(shape, spacing[::-1])], indexing="ij")
    return 125 + 125 * np.sin(0.11 * x + np.sin(0.07 * y)) * np.cos(0.08 * z + 0.05 * x) * np.cos(0.06 * y)


ALL = sys.argv[1:] == ["all"]
FLAT = [1.0, 0.7, 3.0]
# Values, spacing, type, of cells, parallel scale, representation's properties.
CASES = {
    "brain_u8": (*brain_of("ch2better", 2), np.uint8, False, None, {}),
    "brain_f32": (*brain_of("inia19-t1-brain", 2), np.float32, False, None, {"Diffuse": 0.7}),
    "wavelet_f32": (wavelet(), [1.0] * 3, np.float32, False, 22.0, {}),
    "flat_f32": (waves((30, 120, 90), FLAT), FLAT, np.float32, False, None, {}),
    "flat_u16_cells": (waves((30, 120, 90), FLAT), FLAT, np.uint16, True, None, {}),
}
for name, (values, spacing, kind, as_cells, parallel_scale, properties) in CASES.items():
    if not ALL and name in ("brain_f32", "flat_f32"):
        continue
    source, center = source_of_values(values.astype(kind), "field", spacing, as_cells=as_cells)
    association = "CELLS" if as_cells else "POINTS"
    set_colors("field", 20, 250, peak=0.6)
    extent = max(n * s for n, s in zip(values.shape[::-1], spacing))
    direction = np.array([0.45, 0.36, 0.7]) * 2.4 * extent
    view = make_view([160, 160], list(center + direction), list(center), parallel_scale)
    unit = 2 * min(spacing)
    theirs = paraview_volume(source, view, association, "field", unit, Shade=1, **properties)
    if name == "brain_u8":
        unshaded = paraview_volume(source, view, association, "field", unit)
        check(ssim(theirs, unshaded) < 0.99, name + ": shading shows %.4f" % ssim(theirs, unshaded))
    representation = simple.GetRepresentation(source, view)
    representation.Shade = 0
    # Shading that is set by hand, and shading that the first update takes.
    volume = picture(vdi_filter(source, view, association, "field", unit, PictureOnly=1, Shade=1, **properties))
    representation.Shade = 1
    simple.SetActiveView(view)
    taking = vdi_filter(source, view, association, "field", unit, Resolution=[0, 0])
    vdi = picture(taking)
    check(taking.Shade == 1 and taking.Diffuse == properties.get("Diffuse", 1.0) and len(taking.Lights) == 0,
          name + ": the first update takes the volume's shading")
    for what, ours in (("volume rendering", volume), ("a VDI", vdi)):
        similar = ssim(ours, theirs)
        off = np.abs(ours.astype(float) - theirs).mean(axis=(0, 1))
        check(similar >= 0.99, "%s: SSIM of %s with ParaView's own %.4f, mean differences %s" % (
            name, what, similar, off.round(2)))
        check(off.max() < 1.5, "%s: %s has ParaView's colours" % (name, what))
    write_png("shading_%s.png" % name, np.hstack([vdi, theirs]))
    simple.Delete(view)

# Another view's lights: one headlight, which lets ambient light show too; two lights of colours; none.
source, center = source_of_values(waves((40, 40, 40), [3.0] * 3).astype(np.float32), "field", [3.0] * 3)
for name in ("headlight", "two_lights", "no_light"):
    view = make_view([120, 120], list(center + [160, 120, 250]), list(center))
    view.UseLight = 0
    if name == "headlight":
        simple.AddLight(view=view).Coords = "Headlight"
    if name == "two_lights":
        first, second = simple.AddLight(view=view), simple.AddLight(view=view)
        first.Coords, first.Position, first.FocalPoint = "Camera", [1, 2, 0.5], [0, 0, 0]
        first.DiffuseColor, first.Intensity = [1, 0.4, 0.2], 0.8
        second.Coords, second.Position, second.FocalPoint = "Scene", [-300, 0, 100], [0, 0, 0]
        second.DiffuseColor = [0.1, 0.3, 0.6]
    theirs = paraview_volume(source, view, "POINTS", "field", 6.0, Shade=1, Ambient=0.2, Diffuse=0.6)
    simple.SetActiveView(view)
    ours = picture(vdi_filter(source, view, "POINTS", "field", 6.0, Resolution=[0, 0]))
    off = np.abs(ours.astype(int) - theirs).mean()
    check(theirs.max() > 60 or name == "no_light", name + ": something is seen")
    check(off < 1.5 and ssim(ours, theirs) >= 0.99,
          "%s: SSIM with ParaView's own %.4f, mean difference %.2f" % (name, ssim(ours, theirs), off))
    write_png("shading_%s.png" % name, np.hstack([ours, theirs]))
    simple.Delete(view)
finish()
