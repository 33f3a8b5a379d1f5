"""Maximum and minimum intensities and isosurfaces against ParaView's own pictures, which the first update takes over; VDIs
refuse them."""

import numpy as np
from pvtest import *  # noqa: F403

SHAPE, SPACING = (50, 70, 60), [1.2, 1.0, 1.5]
UNIT = 7.0  # no mode but Composite depends on it


def waves_source(name, as_cells):
    return source_of_values(waves(SHAPE, SPACING), name, SPACING, as_cells=as_cells)


def set_blend(representation, number, values):
    """Sets the mode by number, because ParaView's panel doesn't offer each mode for each kind of data."""
    representation.SMProxy.GetProperty("BlendMode").SetElement(0, number)
    representation.SMProxy.UpdateVTKObjects()
    if values:
        representation.IsosurfaceValues = values


# vtkVolumeMapper's number, Shade, isovalues.
MODES = {
    "Maximum Intensity": (1, 0, []),
    "Minimum Intensity": (2, 0, []),
    "Isosurface": (5, 0, [90, 150, 200]),
    "Isosurface, shaded": (5, 1, [90, 150, 200]),
}
# A ray that just touches a surface hits or misses it, depending on the depths of its samples, so pixels at the edges of
# surfaces may differ completely. ParaView shades a surface by the gradient at the sample behind it.
LEAST = {"Maximum Intensity": 0.99, "Minimum Intensity": 0.99, "Isosurface": 0.96, "Isosurface, shaded": 0.95}
for association, names in (("POINTS", MODES), ("CELLS", ("Maximum Intensity", "Isosurface, shaded"))):
    source, center = waves_source("waves", association == "CELLS")
    view = make_view([240, 240], list(center + [70, 60, 130]), list(center))
    for name in names:
        number, shade, values = MODES[name]
        colors, opacity = set_colors("waves", 0, 250)
        opacity.Points = [0, 0.9, 0.5, 0, 80, 0.3, 0.5, 0, 150, 0.5, 0.5, 0, 250, 0.9, 0.5, 0]
        paraview_volume(source, view, association, "waves", UNIT, keep_range=True, Shade=shade)
        shown = simple.GetRepresentation(source, view)
        set_blend(shown, number, values)
        theirs = paraview_volume(source, view, association, "waves", UNIT, keep_range=True, Shade=shade)
        simple.SetActiveView(view)
        image = vdi_filter(source, view, association, "waves", UNIT, PictureOnly=1, Resolution=[0, 0])
        ours = picture(image)
        what = "%s of %s" % (name, association.lower())
        check(image.BlendMode == name.split(",")[0], what + ": the first update takes the mode, " + str(image.BlendMode))
        check(list(image.IsosurfaceValues) == values and image.Shade == shade,
              what + ": the first update takes the values and the shading")
        off = np.abs(ours.astype(float) - theirs).mean()
        check(theirs.max() > 100 and ssim(ours, theirs) >= LEAST[name] and off < 2 and wrong_share(ours, theirs) < 0.05,
              "%s: SSIM with ParaView's own %.4f, mean difference %.2f" % (what, ssim(ours, theirs), off))
        write_png("blend_%s.png" % what.replace(",", "").replace(" ", "_"), np.hstack([ours, theirs]))
        simple.Delete(image)
        set_blend(shown, 0, [])

# Modes that a VDI can't hold.
simple.SetActiveView(None)
image = vdi_filter(source, view, "CELLS", "waves", UNIT)
image.IsosurfaceValues = [150]
for mode in ("Maximum Intensity", "Minimum Intensity", "Isosurface"):
    image.BlendMode = "Composite"  # ends the failure of the mode before, which is said once
    image.UpdatePipeline()
    image.BlendMode = mode
    with Messages("ErrorEvent", "WarningEvent") as said:
        image.UpdatePipeline()
    about = [message for message in said if "only composite blending" in message]
    check(len(about) == 1 and len(said) == 1 and "Picture Only" in about[0],
          "%s: a VDI refuses it in one message: %s" % (mode, " | ".join(said)))
image.BlendMode = "Composite"
with Messages("ErrorEvent", "WarningEvent") as said:
    seen = picture(image)
check(seen.max() > 100 and not said, "Composite makes a VDI again after the other modes")
finish()
