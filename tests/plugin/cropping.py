"""Cropped volumes against ParaView's own, whose box the first update takes; clipping planes; missing blend modes."""

import numpy as np
import vtkmodules.vtkRenderingVolume  # noqa: F401  # so that mappers of volumes have their methods
from pvtest import *  # noqa: F403

# Values are [z][y][x] of cells, because VTK misplaces the faces of cropped point data by up to half a voxel.
SHAPE, SPACING, ORIGIN = (50, 70, 60), [1.2, 1.0, 1.5], [-10, 5, 20]


def waves_source():
    return source_of_values(waves(SHAPE, SPACING), "field", SPACING, ORIGIN, as_cells=True)


def drawn_box(view):
    """The box by which ParaView crops the view's only volume, however it applies scale and
    origin."""
    volumes = view.GetClientSideObject().GetRenderer().GetVolumes()
    volumes.InitTraversal()
    return np.array(volumes.GetNextProp().GetMapper().GetCroppingRegionPlanes())


source, center = waves_source()
set_colors("field", 20, 250, peak=0.6)
view = make_view([160, 160], list(center + [70, 60, 130]), list(center))
SCALE, SHIFT = [0.6, 0.5, 0.7], [10.3, 20.1, 15.7]
for name, shade in (("unshaded", 0), ("shaded", 1)):
    theirs = paraview_volume(source, view, "CELLS", "field", 2.0, Shade=shade, UseCropping=1, CroppingOrigin=SHIFT,
                             CroppingScale=SCALE)
    simple.SetActiveView(view)
    image = vdi_filter(source, view, "CELLS", "field", 2.0, Resolution=[0, 0])
    ours = picture(image)
    box = drawn_box(view)
    check(image.Cropping == 1 and np.allclose(image.CroppingBox, box), name + ": the first update takes the volume's box")
    check(image.Shade == shade, name + ": the first update takes the volume's shading")
    off = np.abs(ours.astype(float) - theirs).mean()
    check(theirs.max() > 100 and ssim(ours, theirs) >= 0.99 and off < 1.5,
          "%s: SSIM with ParaView's own %.4f, mean difference %.2f" % (name, ssim(ours, theirs), off))
    vdi_bounds = np.array(image.GetDataInformation().GetBounds())
    write_png("cropping_%s.png" % name, np.hstack([ours, theirs]))

# Without a box, Cropping begins with the whole input.
alone = simple.GetRepresentation(source, view)
alone.UseCropping = 0
uncropped = vdi_filter(source, view, "CELLS", "field", 2.0)
expected = picture(uncropped)
uncropped.Cropping = 1
seen = picture(uncropped)
check(seen is not None and expected.max() > 100 and np.abs(seen.astype(int) - expected).max() <= 1,
      "Cropping without a box shows the whole input")
check(np.allclose(uncropped.GetDataInformation().GetBounds(), source.GetDataInformation().GetBounds()),
      "Cropping without a box leaves the outline")
alone.UseCropping = 1

# Properties that were set before the first update stay, and so do those that belong to them.
representation = simple.GetRepresentation(source, view)
representation.BlendMode = "Isosurface"
own_box, own_lights = [0, 20, 10, 40, 25, 60], [0, 0, 1, 1, 0.5, 0.5]
own = vdi_filter(source, view, "CELLS", "field", 2.0, Resolution=[0, 0], CroppingBox=own_box, Diffuse=0.5,
                 IsosurfaceValues=[150], Lights=own_lights)
own.UpdatePipeline()
check(own.Cropping == 0 and list(own.CroppingBox) == own_box, "a box that was set before the first update stays")
check(own.Shade == 0 and own.Diffuse == 0.5, "the shading stays as it was before the first update")
check(own.BlendMode == "Composite" and list(own.IsosurfaceValues) == [150],
      "the blending stays as it was before the first update")
check(list(own.Lights) == own_lights, "the lights stay as they were before the first update")
representation.BlendMode = "Composite"

# The same box by planes.
representation.UseCropping = 0
simple.SetActiveView(None)
planes = []
for axis in range(3):
    for side, sign in ((0, 1.0), (1, -1.0)):
        point, normal = [0.0] * 3, [0.0] * 3
        point[axis], normal[axis] = box[2 * axis + side], sign
        planes += point + normal
clipped = picture(vdi_filter(source, view, "CELLS", "field", 2.0, Shade=1, ClippingPlanes=planes))
check(np.abs(clipped.astype(int) - ours).max() <= 2, "six clipping planes show what the box shows")
whole = vdi_filter(source, view, "CELLS", "field", 2.0, Shade=1)
viewed = picture(simple.RenderVDI(Input=whole, UseOriginalCamera=1, ClippingPlanes=planes))
check(ssim(viewed, ours) >= 0.97,
      "clipped views of the whole VDI show about what the box shows: SSIM %.4f" % ssim(viewed, ours))
write_png("cropping_viewed.png", np.hstack([viewed, ours]))

# The representation VDI has such planes, too.
simple.HideAll(view)
display = simple.Show(whole, view)
display.SetRepresentationType("VDI")
display.VDIClippingPlanes = planes
in_view = screenshot(view, None, list(view.ViewSize))
check(np.abs(in_view.astype(int) - viewed).max() <= 2, "a view with clipping planes shows what Render VDI shows")
with Messages("ErrorEvent") as said:
    display.VDIClippingPlanes = planes[:6] + [0, 0, 0, 0, 0, 0]
half = screenshot(view, None, list(view.ViewSize))
check(len(said) == 1 and "normal" in said[0], "a plane without a normal is an error: %s" % " | ".join(said))
expected = picture(simple.RenderVDI(Input=whole, UseOriginalCamera=1, ClippingPlanes=planes[:6]))
check(np.abs(half.astype(int) - expected).max() <= 2, "the other plane still counts")
display.VDIClippingPlanes = []
unclipped = screenshot(view, None, list(view.ViewSize))
expected = picture(simple.RenderVDI(Input=whole, UseOriginalCamera=1))
check(np.abs(unclipped.astype(int) - expected).max() <= 2, "without planes, the view shows the whole VDI")
simple.Hide(whole, view)
simple.Show(source, view)

# Modes that the filter can't show.
simple.SetActiveView(view)
for mode in ("Slice", "Composite"):
    representation.BlendMode = mode
    with Messages("WarningEvent") as said:
        picture(vdi_filter(source, view, "CELLS", "field", 2.0, Resolution=[0, 0]))
    about = [message for message in said if "Blend Mode" in message]
    check(len(about) == (0 if mode == "Composite" else 1), "%s: %d messages that it isn't supported" % (mode, len(about)))
for name, usual, value, words in (("UseSeparateOpacityArray", 0, 1, "Separate Opacity Array"),
                                  ("UseTransfer2D", 0, 1, "2D Transfer Function"),
                                  ("MapScalars", 1, 0, "Map Scalars"),
                                  ("MultiComponentsMapping", 0, 1, "Multi Components Mapping"),
                                  ("VolumetricScatteringBlending", 0, 1, "Volumetric Scattering"),
                                  ("VolumeAnisotropy", 0, 0.5, "Anisotropy"),
                                  ("GlobalIlluminationReach", 0, 0.5, "Global Illumination Reach"),
                                  ("Scale", [1, 1, 1], [1, 1, 2], "Transforming")):
    if name not in representation.ListProperties():
        continue  # not in this version of ParaView
    setattr(representation, name, value)
    with Messages("WarningEvent") as said:
        vdi_filter(source, view, "CELLS", "field", 2.0, Resolution=[0, 0]).UpdatePipeline()
    check(len(said) == 1 and words in said[0], "%s: a message that it isn't supported: %s" % (name, " | ".join(said)))
    setattr(representation, name, usual)
finish()
