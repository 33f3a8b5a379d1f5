"""A client on each rank (pvbatch --symmetric), as in Catalyst. An update that fails must fail on all ranks each time,
and properties that differ among ranks are an error. Otherwise the test would hang and reach its time limit. With the
argument views, a view is drawn, too."""

import sys

from paraview.modules.vtkRemotingCore import vtkProcessModule
from pvtest import *  # noqa: F403

rank = vtkProcessModule.GetProcessModule().GetPartitionId()


def filter_of(source, name="RTData", **properties):
    return filter_with(source, "POINTS", name, **{"Resolution": [64, 48], **properties})


def range_of(proxy):
    return [round(proxy.RGBPoints[0], 4), round(proxy.RGBPoints[-4], 4)]


# Only rank 0 has a block.
VECTORS = """
import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkParallelCore import vtkMultiProcessController
if vtkMultiProcessController.GetGlobalController().GetLocalProcessId() == 0:
    image = vtkImageData()
    image.SetDimensions(9, 9, 9)
    x = np.linspace(0, 1, 729)
    for name, last in (("velocity", 3), ("force", 5)):
        array = numpy_to_vtk(np.stack([x, -2 * x, last * x], axis=1), deep=True)
        array.SetName(name)
        image.GetPointData().AddArray(array)
    self.GetOutputDataObject(0).SetBlock(0, image)
"""

wavelet = simple.Wavelet(WholeExtent=[-8, 8, -8, 8, -8, 8])
nothing = filter_of(simple.TrivialProducer(registrationName="gird"))
check(errors_of_update(nothing), "rank %d: an input without data is an error" % rank)
for attempt in ("second", "third"):
    check(not errors_of_update(nothing), "rank %d: an input without data isn't reported a %s time" % (rank, attempt))
image = filter_of(wavelet, "RTDate")
check("no array of points is named 'RTDate'" in errors_of_update(image), "rank %d: a missing array is an error" % rank)
check(not errors_of_update(image), "rank %d: a missing array isn't reported twice" % rank)
image.SelectInputScalars = ["POINTS", "RTData"]
check(not errors_of_update(image), "rank %d: with an array that exists, the filter works" % rank)

for name, values in (("FillGhosts", (0, 1)), ("PictureOnly", (0, 1)), ("Component", (0, -1)), ("Supersegments", (4, 5)),
                     ("SelectInputScalars", (["POINTS", "RTData"], ["CELLS", "RTData"])),
                     ("Resolution", ([64, 48], [48, 64])), ("CameraViewAngle", (30, 31))):
    setattr(image, name, values[rank > 0])
    text = errors_of_update(image)
    check("different values" in text, "rank %d: %s that differs is an error" % (rank, name))
    setattr(image, name, values[0])
    check(not errors_of_update(image), "rank %d: once %s is equal again, the filter works" % (rank, name))

# Another component or array gets its range over all ranks, those without blocks included.
vectors = filter_of(simple.ProgrammableSource(OutputDataSetType="vtkMultiblockDataSet", Script=VECTORS), "velocity")
check(not errors_of_update(vectors), "rank %d: vectors of one rank are rendered" % rank)
vectors.Component = 2
check(not errors_of_update(vectors) and range_of(vectors.LookupTable) == [0, 3],
      "rank %d: a component has its range %s" % (rank, range_of(vectors.LookupTable)))
vectors.SelectInputScalars = ["POINTS", "force"]
check(not errors_of_update(vectors) and range_of(vectors.LookupTable) == [0, 5] and vectors.Component == 2,
      "rank %d: another array's component has its range %s" % (rank, range_of(vectors.LookupTable)))

# A component that the map names, on all ranks at once.
vectors.LookupTable.VectorComponent = 0
check(not errors_of_update(vectors) and range_of(vectors.LookupTable) == [0, 1] and vectors.Component == 0,
      "rank %d: Component follows the map: %d, %s" % (rank, vectors.Component, range_of(vectors.LookupTable)))
vectors.Component = 2
check(not errors_of_update(vectors) and range_of(vectors.LookupTable) == [0, 5], "rank %d: the map follows Component" % rank)

# A component that only one rank's script sets is an error, and no rank waits for those that set
# none.
if rank == 0:
    vectors.Component = 0
with Messages("ErrorEvent") as texts:
    vectors.UpdatePipeline()  # without a time, VTK updates only what has changed
check("different values: Component" in "".join(texts), "rank %d: a vector's component that differs is an error" % rank)
if rank > 0:
    vectors.Component = 1
check(not errors_of_update(vectors), "rank %d: if both have set another one, that isn't reported twice" % rank)
vectors.Component = 0
check(not errors_of_update(vectors) and range_of(vectors.LookupTable) == [0, 1],
      "rank %d: once the component is equal again, it has its range %s" % (rank, range_of(vectors.LookupTable)))

# The first update takes a cropped volume's box. A rank's client knows only the bounds of its own piece.
view = simple.CreateRenderView(ViewSize=[64, 48])
volume = simple.Show(wavelet, view, "UniformGridRepresentation", Representation="Volume")
volume.ColorArrayName = ["POINTS", "RTData"]
volume.UseCropping, volume.CroppingOrigin, volume.CroppingScale = 1, [1, 0, 0], [0.5, 0.5, 0.5]
view.CameraPosition, view.CameraFocalPoint = [0, 0, 60], [0, 0, 0]
simple.SetActiveView(view)
cropped = simple.VolumetricDepthImage(Input=wavelet, SelectInputScalars=["POINTS", "RTData"])
texts = errors_of_update(cropped)
check(not texts and cropped.Cropping == 1, "rank %d: a cropped volume is rendered: %s" % (rank, texts))
check(list(cropped.CroppingBox) == [-3, 5, -4, 4, -4, 4], "rank %d: its box is %s" % (rank, list(cropped.CroppingBox)))

# A view that is drawn next shows another array, component and map, too.
if "views" in sys.argv:
    shown = simple.CreateRenderView(ViewSize=[64, 48])
    simple.Show(vectors, shown)
    simple.Render(shown)
    vectors.Component = 2
    simple.Render(shown)
    check(range_of(vectors.LookupTable) == [0, 5], "rank %d: the view's component has its range %s" % (
        rank, range_of(vectors.LookupTable)))
    vectors.SelectInputScalars = ["POINTS", "velocity"]
    simple.Render(shown)
    check(range_of(vectors.LookupTable) == [0, 3], "rank %d: the view's array has its range %s" % (
        rank, range_of(vectors.LookupTable)))

# Only rank 0 makes the output. It refuses an array's name that is too long for a file.
NAME = "x" * 2 ** 20
named = simple.Calculator(Input=wavelet, Function="RTData", ResultArrayName=NAME)
check("bytes" in errors_of_update(filter_of(named, NAME, LookupTable=image.LookupTable)),
      "rank %d: an output that can't be made is an error" % rank)
check(not errors_of_update(image), "rank %d: another filter goes on after that error" % rank)
finish()
