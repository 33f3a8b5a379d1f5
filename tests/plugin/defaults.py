"""The filters' defaults, and their messages when a script asks for something that doesn't exist."""

import os
import re

import numpy as np
from paraview import servermanager
from pvtest import *  # noqa: F403
from vtkmodules.vtkRenderingCore import vtkRenderer

SIZE = [64, 48]


def field(center, scale=1.0):
    """A ball of points 'ball', cells 'layers' and points 'velocity' on [0, 4]^3 about `center`."""
    n = 17
    image = vtkImageData()
    image.SetDimensions(n, n, n)
    image.SetSpacing(0.25, 0.25, 0.25)
    image.SetOrigin(*(np.array(center) - 2))
    z, y, x = np.meshgrid(*[np.linspace(-2, 2, n)] * 3, indexing="ij")
    ball = scale * np.clip(4 - x * x - y * y - z * z, 0, None)

    def add(attributes, name, values):
        array = numpy_to_vtk(values, deep=True)
        array.SetName(name)
        attributes.AddArray(array)

    add(image.GetPointData(), "ball", ball.ravel())
    add(image.GetPointData(), "velocity", np.stack([ball.ravel() - 1, np.full(n ** 3, 50.0), 0 * ball.ravel()], axis=1))
    add(image.GetCellData(), "layers", np.repeat(np.arange(16.0), 256))
    return image


def filter_of(source, association="POINTS", name="ball", **properties):
    return filter_with(source, association, name, Resolution=SIZE, **properties)


source = producer_of(field([7, 0, -3]))
proxies = []

# An unset camera is ParaView's.
image = filter_of(source)
seen = picture(image)
renderer = vtkRenderer()
renderer.ResetCamera(5, 9, -2, 2, -5, -1)
camera = renderer.GetActiveCamera()
as_reset = filter_of(source, CameraPosition=list(camera.GetPosition()), CameraFocalPoint=list(camera.GetFocalPoint()))
check(seen.max() > 60, "without a camera there is something to see")
check(seen[0].max() == 0 and seen[-1].max() == 0 and seen[:, 0].max() == 0,
      "without a camera, all of the scene is in the picture")
check(np.abs(seen.astype(int) - picture(as_reset)).max() <= 1,
      "without a camera, the scene is where vtkRenderer.ResetCamera puts it")
check(list(image.CameraPosition) == list(image.CameraFocalPoint),
      "without a camera, the properties stay those of a camera not set")
parallel = picture(filter_of(source, CameraParallelProjection=1))
check(parallel.max() > 60 and parallel[0].max() == 0,
      "without a camera, the scene is in the picture in parallel projection, too")
made = filter_of(source, CameraPosition=[15, 4, 4], CameraFocalPoint=[7, 0, -3])
check(np.abs(picture(simple.RenderVDI(Input=made)).astype(int) - picture(made)).max() <= 2,
      "RenderVDI without a camera looks from where the VDI was made")

# Viewpoints from which the picture isn't true.
for what, position, focal_point, word in (
        ("inside the scene", [7.1, 0, -3], [7, 0, -4], "inside"),
        ("that looks past it", [15, 4, 4], [15, 40, 4], "doesn't see"),
        ("behind it", [-1, -4, -10], [7, 0, -3], "degrees")):
    rendered = simple.RenderVDI(Input=made, CameraPosition=position, CameraFocalPoint=focal_point)
    with Messages("WarningEvent") as texts:
        rendered.UpdatePipeline()
        first = [text for text in texts if word in text]
        rendered.CameraPosition = [p + 0.01 for p in position]
        rendered.UpdatePipeline()
    check(len(first) == 1, "a viewpoint %s gets a warning" % what)
    check(len([text for text in texts if word in text]) == 1, "a viewpoint %s gets only one warning" % what)
with Messages("WarningEvent") as texts:
    simple.RenderVDI(Input=made, UseOriginalCamera=1, Azimuth=20).UpdatePipeline()
check(not texts, "a viewpoint near the VDI's own gets none")

# Fill values that nobody has named stretch the map.
filled = field([7, 0, -3])
filled.GetPointData().GetArray("ball").SetName("filled")
vtk_to_numpy(filled.GetPointData().GetArray("filled"))[::40] = 1e20
for missing, count in (([], 1), ([1e20], 0)):
    stretched = filter_of(producer_of(filled), name="filled", MissingValues=missing)
    with Messages("WarningEvent") as texts:
        for angle in (30, 20):
            stretched.CameraViewAngle = angle
            stretched.UpdatePipeline()
    about = [text for text in texts if "'filled'" in text and "less than 1/256" in text]
    check(len(about) == count, "a range of fill values, named %s, gets %d warnings: %s" % (missing, count, texts))
    simple.Delete(stretched)

# Arrays that don't exist, or exist only with the other association.
for association, name, words in (
        ("CELLS", "ball",
         ["no array of cells is named 'ball'", "['POINTS', 'ball']", "'velocity' (3 components)", "of cells: 'layers'"]),
        ("POINTS", "layers", ["no array of points is named 'layers'", "['CELLS', 'layers']", "'ball'"]),
        ("POINTS", "bell", ["no array of points is named 'bell'", "'ball'", "of cells: 'layers'"])):
    wrong = filter_of(source, association, name)
    for attempt in ("first", "second"):
        with Messages("ErrorEvent") as texts:
            wrong.UpdatePipeline(0.0)
        missing = [word for word in words if word not in "".join(texts)]
        check(not missing, "%s of %s: the %s error says what there is %s" % (name, association, attempt, missing))
        check(len(texts) == 1, "%s of %s: the %s error is the only one: %d" % (name, association, attempt, len(texts)))
        check(not errors_of_update(wrong),
              "%s of %s: the %s error isn't repeated as long as the array stays wrong" % (name, association, attempt))
        wrong.SelectInputScalars = ["POINTS", "ball"]
        check(not errors_of_update(wrong), "after a wrong array, another one is fine")
        wrong.SelectInputScalars = [association, name]
check(not errors_of_update(filter_of(source, "CELLS", "layers")), "an array of cells is fine")


# Colour maps: the default keeps its first range, whatever updates the filter; set points stay.
def range_of(name):
    points = list(simple.GetColorTransferFunction(name).RGBPoints)
    opacities = list(simple.GetOpacityTransferFunction(name).Points)
    return [round(v, 4) for v in (points[0], points[-4], opacities[0], opacities[-4])]


def saved(proxy, name):
    path = os.path.join(OUTPUT, name)
    simple.SaveData(path, proxy=proxy)
    return picture(simple.OpenDataFile(path))


def renamed(image, name):
    array = image.GetPointData().GetArray("ball")
    array.SetName(name)
    return image


moving = producer_of(renamed(field([0, 0, 0]), "kept"))
written = filter_of(moving, name="kept")
first = saved(written, "kept_0.vdi")
check(range_of("kept") == [0, 4, 0, 4], "a map that nobody set has the range of the array, also when only a writer updates")
moving.GetClientSideObject().SetOutput(renamed(field([0, 0, 0], scale=0.5), "kept"))
moving.MarkModified(moving.SMProxy)
second = saved(written, "kept_1.vdi")
check(range_of("kept") == [0, 4, 0, 4] and np.abs(first.astype(int) - second).max() > 30,
      "a map that nobody set keeps its range when the values get smaller")
written.UpdatePipeline()
check(range_of("kept") == [0, 4, 0, 4], "a map that nobody set keeps its range when the filter is updated")
written.LookupTable = None
before = picture(written)
moving.GetClientSideObject().SetOutput(renamed(field([0, 0, 0], scale=0.25), "kept"))
moving.MarkModified(moving.SMProxy)
check(np.abs(picture(written).astype(int) - before).max() > 8, "the stand-in for no map keeps its range too")

for name, low, high in (("set", -2.0, 9.0), ("unit", 0.0, 1.0)):
    colors, opacity = set_colors(name, low, high)
    given = producer_of(renamed(field([0, 0, 0]), name))
    filter_of(given, name=name).UpdatePipeline()
    check(range_of(name) == [low, high, low, high], "points set on [%g, %g] stay there" % (low, high))
preset = simple.GetColorTransferFunction("preset")
preset.ApplyPreset("Cool to Warm", True)
simple.GetOpacityTransferFunction("preset").Points = [0, 0, 0.5, 0, 2, 1, 0.5, 0]
filter_of(producer_of(renamed(field([0, 0, 0]), "preset")), name="preset").UpdatePipeline()
check(range_of("preset") == [0, 4, 0, 2], "a preset waits for the range, opacities set with it don't move")
check(not errors_of_update(filter_of(source, "POINTS", "velocity", Component=0)), "a component is rendered")
check(range_of("velocity") == [-1, 3, -1, 3], "the map of a component has the component's range, not the magnitude's")

# A VDI's output has field arrays, one of them with the name of the array. They aren't offered.
made = simple.VolumetricDepthImage(Input=source, Resolution=[16, 12])
made.UpdatePipeline()
simple.SetActiveSource(made)
second = simple.VolumetricDepthImage(Input=source)
check(second.SelectInputScalars[0] == "POINTS" and list(second.SelectInputScalars) == list(made.SelectInputScalars),
      "a filter that is made while a VDI is active begins with an array of the input: %s" % second.SelectInputScalars)
simple.SetActiveSource(None)

# Data without arrays.
bare = vtkImageData()
bare.SetDimensions(5, 5, 5)
said = errors_of_update(simple.VolumetricDepthImage(Input=producer_of(bare)))
check(said.count("ERROR") == 1 and "the data have no arrays" in said, "data without arrays get one message: " + said)

# The panel hides properties that have no effect on a VDI, by names that this ParaView's representation has.
source_file = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "plugin", "VolumetricDepthImages",
                           "Panel", "pqVDIDisplayWidgets.cxx")
with open(source_file) as file:
    idle = re.findall(r'"(\w+)"', re.search(r"idle\{(.*?)\};", file.read(), re.DOTALL).group(1))
representation = servermanager.ProxyManager().NewProxy("representations", "VDIImageRepresentation")
unknown = {name for name in idle if representation.GetProperty(name) is None}
of_other_versions = {"Position", "Translation", "UseNanColorForMissingArrays"}  # ParaView 6 renamed and added some
check(len(idle) > 20 and unknown <= of_other_versions,
      "the VDI's representation has the properties that the panel hides, all but %s" % sorted(unknown))
finish()
