"""The places of representations other than VDI: Outline is the volume's box, Slice the flat picture in the middle of it.
Reset Camera looks at either. No other representation is offered."""

import numpy as np
import pvtest
from paraview import simple
from pvtest import check

SIZE = [320, 240]
ORIGIN, SPACING = [100, -40, 7], [1, 0.5, 2]
BOUNDS = (100, 140, -40, -20, 7, 87)
CENTER = [120, -30, 47]


def volume():
    """A volume far from the origin, and longest along z."""
    source = simple.ProgrammableSource()
    source.OutputDataSetType = "vtkImageData"
    source.ScriptRequestInformation = """
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline
info = self.GetOutputInformation(0)
info.Set(vtkStreamingDemandDrivenPipeline.WHOLE_EXTENT(), 0, 40, 0, 40, 0, 40)
"""
    source.Script = """
import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk
image = self.GetImageDataOutput()
image.SetOrigin({})
image.SetSpacing({})
image.SetDimensions(41, 41, 41)
z, y, x = np.meshgrid(*[np.linspace(0, 1, 41)] * 3, indexing="ij")
array = numpy_to_vtk((0.3 + 0.7 * x * (1 - z) + 0.2 * y).astype("f4").ravel(), deep=True)
array.SetName("scalars")
image.GetPointData().SetScalars(array)
""".format(ORIGIN, SPACING)
    source.UpdatePipeline()
    return source


def screenshot(view, name):
    return pvtest.screenshot(view, "places_{}.png".format(name), SIZE)


def look(view, camera):
    view.CameraPosition, view.CameraFocalPoint, view.CameraViewUp = camera, CENTER, [0, 1, 0]


def seen_box(rgb):
    """First and last row and column that aren't empty."""
    rows, columns = np.nonzero(rgb.max(axis=2) > 8)
    return [rows.min(), rows.max(), columns.min(), columns.max()]


def offered(display):
    return sorted(display.SMProxy.GetProperty("Representation").GetDomain("list").GetString(i)
                  for i in range(display.SMProxy.GetProperty("Representation").GetDomain("list").GetNumberOfStrings()))


def shown_as(display, view, kind):
    display.SetRepresentationType(kind)
    simple.Render(view)
    view.ResetCamera(False)
    simple.Render(view)
    return np.array(view.GetActiveCamera().GetFocalPoint())


def outline(source, image, view, camera):
    """Compares Outline with ParaView's outline of the volume itself."""
    display = simple.Show(image, view)
    check(offered(display) == ["Outline", "Slice", "VDI"], "a VDI is offered as {}".format(offered(display)))
    for kind in ("VDI", "Outline", "Slice"):
        middle = shown_as(display, view, kind)
        check(np.linalg.norm(middle - CENTER) < 1, "Reset Camera looks at the scene with {}: {}".format(kind, middle))
    display.SetRepresentationType("Outline")
    # Like the VDI, Outline stays in place. ParaView 5.13 renamed Position.
    place = "Translation" if "Translation" in display.ListProperties() else "Position"
    setattr(display, place, [50, 0, 0])
    look(view, camera)
    seen = screenshot(view, "outline")
    setattr(display, place, [0, 0, 0])
    simple.Hide(image, view)
    own = simple.Show(source, view)
    own.SetRepresentationType("Outline")
    own.AmbientColor = own.DiffuseColor = display.AmbientColor
    look(view, camera)
    expected = screenshot(view, "outline_expected")
    check(expected.max() > 100 and np.array_equal(seen, expected), "Outline is the volume's box")
    simple.Hide(source, view)


def flat_picture(image, view, camera, what):
    """Compares Slice with the picture itself, from its viewpoint and from the side."""
    display = simple.Show(image, view)
    look(view, camera)
    expected = pvtest.picture(image)
    display.SetRepresentationType("Slice")
    seen = screenshot(view, what + "_slice")
    off = np.abs(seen.astype(int) - expected).max()
    print("Slice against the picture from its viewpoint, {}: at most {} of 255 off".format(what, off))
    check(expected.std() > 20 and off <= 3, "Slice has the picture's place and its colours, {}".format(what))
    display.Opacity = 0.5
    half = np.abs(2 * screenshot(view, what + "_half").astype(int) - seen).max()
    check(half <= 3, "Opacity 0.5 shows Slice half as opaque, {}".format(what))
    display.Opacity = 1
    # From above, the rectangle is seen edge-on, as a line through the middle.
    position, up = np.array(camera, float), np.array([0.0, 1, 0])
    forward = (CENTER - position) / np.linalg.norm(CENTER - position)
    right = np.cross(forward, up)
    view.CameraPosition = CENTER + 200 * np.cross(right / np.linalg.norm(right), forward) + 5 * forward
    view.CameraViewUp = forward
    above = screenshot(view, what + "_above")
    first, last = seen_box(above)[:2]
    check(last - first < 24 and abs(first + last - SIZE[1]) < 60,
          "Slice stands in the middle of the scene: rows {} to {}".format(first, last))
    simple.Hide(image, view)


def run():
    source = volume()
    pvtest.set_colors("scalars", 0.3, 1.2)
    camera = [220, 10, 160]
    view = pvtest.make_view(SIZE, camera, CENTER)
    view.UseFXAA = 0  # smooths the edges of opaque and translucent geometry
    image = pvtest.vdi_filter(source, view, "POINTS", "scalars", 2)
    simple.Show(image, view)
    simple.Render(view)
    outline(source, image, view, camera)
    flat_picture(image, view, camera, "perspective")
    image.Margin = 0.5  # the lists beyond the picture aren't in it
    flat_picture(image, view, camera, "margin")
    image.Margin = 0
    image.PictureOnly = 1
    bounds = image.GetDataInformation().GetBounds() if image.UpdatePipeline() is None else None
    check(np.allclose(bounds, BOUNDS), "a picture without a VDI has the scene's bounds, too")
    simple.Delete(view)
    view = pvtest.make_view(SIZE, camera, CENTER, parallel_scale=60)
    view.UseFXAA = 0
    image.PictureOnly = 0
    image.CameraParallelProjection, image.CameraParallelScale = 1, 60
    simple.Show(image, view)
    simple.Render(view)
    view.CameraParallelScale = 60
    flat_picture(image, view, camera, "parallel")


run()
pvtest.finish()
