"""Another array, component or input brings its own colours at once, whatever updates the filter
next."""

import gc
import os

import numpy as np
from paraview import servermanager
from paraview.modules.vtkRemotingServerManager import vtkSMProxyManager, vtkSMUndoStack, vtkSMUndoStackBuilder
from pvtest import *  # noqa: F403

SIZE = [96, 72]
FIELD = servermanager.GetAssociationFromString("FIELD")

# x is in [-1, 1] along the first axis; `scale` moves the second ball's values.
SCRIPT = """
import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk
n = 17
image = self.GetImageDataOutput()
image.SetDimensions(n, n, n)
image.SetSpacing({spacing}, {spacing}, {spacing})
z, y, x = np.meshgrid(*[np.linspace(-1, 1, n)] * 3, indexing="ij")
field = 1 - np.sqrt((x * x + y * y + z * z) / 3)
arrays = {{"a": field * {scale}, "temperature": 1000 + 1000 * field, "flat": np.zeros_like(field) + 5, "Q criterion": -field}}
for name, values in arrays.items():
    array = numpy_to_vtk(values.ravel().copy(), deep=True)
    array.SetName(name)
    image.GetPointData().AddArray(array)
colors = (np.stack([field, 1 - field, x * x], axis=3) * 255).astype(np.uint8)
vectors = dict(velocity=np.stack([x, 2 * y, -3 * z], axis=3), rgb=colors, complex=np.stack([x, y], axis=3))
for name, values in vectors.items():
    array = numpy_to_vtk(values.reshape(-1, values.shape[3]).copy(), deep=True)
    array.SetName(name)
    image.GetPointData().AddArray(array)
"""

EXTENT = """
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline as Pipeline
self.GetExecutive().GetOutputInformation(0).Set(Pipeline.WHOLE_EXTENT(), 0, 16, 0, 16, 0, 16)
"""


def source_of(scale=1.0, spacing=1.0):
    ball = simple.ProgrammableSource(OutputDataSetType="vtkImageData")
    ball.ScriptRequestInformation = EXTENT
    ball.Script = SCRIPT.format(scale=scale, spacing=spacing)
    ball.UpdatePipeline()
    return ball


def range_of(proxy):
    return [round(x, 4) for x in list(proxy.RGBPoints[0::4])[::len(proxy.RGBPoints) // 4 - 1]]


def saved_map(image, name):
    """A reader of the file that Save Data writes."""
    path = os.path.join(OUTPUT, name)
    simple.SaveData(path, proxy=image)
    return simple.OpenDataFile(path)


def fresh_picture(ball, name, view, **properties):
    """The picture of a new filter, which has never had another array."""
    image = vdi_filter(ball, view, "POINTS", name, 0, **properties)
    seen = picture(image)
    simple.Delete(image)
    return seen


ball = source_of()
view = make_view(SIZE, [40, 30, 50], [8, 8, 8])
first_display = simple.Show(ball, view)
first_display.SetRepresentationType("Volume")
simple.ColorBy(first_display, ("POINTS", "a"))
simple.Render(view)
view.CameraPosition, view.CameraFocalPoint = [40, 30, 50], [8, 8, 8]

image = simple.VolumetricDepthImage(Input=ball)
image.SelectInputScalars = ["POINTS", "a"]
shown = simple.Show(image, view)
simple.Hide(ball, view)
simple.Render(view)
check(image.LookupTable == first_display.LookupTable, "the first array has the view's map")

image.SelectInputScalars = ["POINTS", "temperature"]
check(image.LookupTable == simple.GetColorTransferFunction("temperature"), "another array takes its own map at once")
check(range_of(image.LookupTable) == [1000, 2000],
      "another array's map has that array's range: %s" % range_of(image.LookupTable))
simple.Render(view)
on_screen = screenshot(view, None, SIZE)
check(np.unique(on_screen.reshape(-1, 3), axis=0).shape[0] > 50, "another array isn't shown as a box of one colour")
write_png("arrays_temperature.png", on_screen)
expected = fresh_picture(ball, "temperature", view, ScalarOpacityUnitDistance=image.ScalarOpacityUnitDistance)
check(np.abs(picture(image).astype(int) - expected).max() <= 1, "another array looks as in a new filter")
check(np.abs(picture(saved_map(image, "arrays.vdi")).astype(int) - expected).max() <= 1,
      "the saved file holds the other array's picture")

colors, _ = set_colors("temperature", 1200, 1800)
image.SelectInputScalars = ["POINTS", "a"]
check(image.LookupTable == first_display.LookupTable, "the first array has its map again")
image.SelectInputScalars = ["POINTS", "temperature"]
check(range_of(image.LookupTable) == [1200, 1800], "control points that were set stay")

own = simple.GetColorTransferFunction("own")
own.RGBPoints = [0, 1, 0, 0, 2000, 0, 1, 0]
image.LookupTable = own
image.SelectInputScalars = ["POINTS", "a"]
check(image.LookupTable == own, "a map that a script has set stays for another array")
image.LookupTable = None
image.SelectInputScalars = ["POINTS", "flat"]
check(image.LookupTable is None, "a script's choice of no map stays for another array")
picture(image)
check(image.LookupTable is None, "a script's choice of no map survives an update")
simple.Delete(image)

# If a script makes a filter before its input has data, the window's panel blanks the filter's choice.
image = simple.VolumetricDepthImage(Input=ball, SelectInputScalars=["POINTS", "temperature"], Resolution=SIZE)
expected, table = picture(image), image.LookupTable
for blank in (["POINTS", ""], ["CELLS", ""]):
    image.SelectInputScalars = blank
    check(list(image.SelectInputScalars) == ["POINTS", "temperature"] and image.LookupTable == table,
          "a filter whose choice of an array is blanked keeps array and map: %s, %s"
          % (list(image.SelectInputScalars), image.LookupTable))
    check(np.abs(picture(image).astype(int) - expected).max() <= 1, "a filter whose choice is blanked shows the same")
simple.Delete(image)

# Vectors.
image = simple.VolumetricDepthImage(Input=ball, SelectInputScalars=["POINTS", "velocity"])
check(image.Component == -1, "by default vectors show their magnitude")
picture(image)
check(range_of(image.LookupTable) == [0, round(14 ** 0.5, 4)],
      "the map has the magnitude's range: %s" % range_of(image.LookupTable))
image.Component = 2
picture(image)
check(range_of(image.LookupTable) == [-3, 3], "a component has its own range %s" % range_of(image.LookupTable))
check(image.LookupTable.VectorMode == "Component" and image.LookupTable.VectorComponent == 2, "the map names the component")
image.Component = -1
check(image.LookupTable.VectorMode == "Magnitude" and range_of(image.LookupTable)[0] == 0, "the map names the magnitude again")
image.SelectInputScalars = ["POINTS", "rgb"]
check(range_of(image.LookupTable)[1] > 255, "an RGB array shows its magnitude %s" % range_of(image.LookupTable))
expected = fresh_picture(ball, "rgb", view, ScalarOpacityUnitDistance=image.ScalarOpacityUnitDistance)
check(np.abs(picture(image).astype(int) - expected).max() <= 1, "an RGB array looks as in a new filter")
simple.Delete(image)

# Another input.
other = source_of(scale=10.0, spacing=2.0)
second = simple.Show(other, view)
second.SetRepresentationType("Volume")
simple.ColorBy(second, ("POINTS", "a"), separate=True)
simple.Render(view)
simple.Hide(other, view)
image = simple.VolumetricDepthImage(Input=ball)
image.SelectInputScalars = ["POINTS", "a"]
picture(image)
before = image.ScalarOpacityUnitDistance
check(before == first_display.ScalarOpacityUnitDistance, "the volume's unit distance was taken")
image.Input = other
check(image.LookupTable == second.LookupTable != first_display.LookupTable, "another input brings its map")
check(image.ScalarOpacityUnitDistance == second.ScalarOpacityUnitDistance != before, "another input brings its unit distance")
image.ScalarOpacityUnitDistance = 0.75
image.Input = ball
check(image.ScalarOpacityUnitDistance == 0.75, "a unit distance that was set stays when the input changes")
check(image.LookupTable == first_display.LookupTable, "the map is the first input's again")

# The queries of ParaView's range buttons, its histogram and its legends.
simple.Hide(ball, view)
simple.Hide(other, view)
image.SelectInputScalars = ["POINTS", "temperature"]
shown = simple.Show(image, view)
simple.Render(view)
check(list(shown.ColorArrayName) == ["FIELD", "temperature"] and shown.LookupTable == image.LookupTable, "the VDI has a legend")
offered = shown.SMProxy.GetProperty("ColorArrayName").GetDomain("array_list")
names = [offered.GetString(i) for i in range(offered.GetNumberOfStrings())]
check(names == sorted(["a", "temperature", "flat", "Q criterion", "velocity", "rgb", "complex"]),
      "the toolbar offers the input's arrays, and no internal one %s" % names)
shown.SetScalarBarVisibility(view, True)
bar = simple.GetScalarBar(image.LookupTable, view)
check(bar.Visibility == 1 and bar.Title == "temperature", "the scalar bar says what it shows")
simple.HideUnusedScalarBars(view)
check(bar.Visibility == 1, "the scalar bar stays where the volume is hidden")
image.LookupTable.RescaleTransferFunction(0, 1)
shown.RescaleTransferFunctionToDataRange(False, True)
check(range_of(image.LookupTable) == [1000, 2000],
      "Rescale to data range sets the array's range: %s" % range_of(image.LookupTable))
table = image.LookupTable.SMProxy.ComputeDataHistogramTable(10)
bins = np.array([table.GetColumn(1).GetValue(i) for i in range(table.GetNumberOfRows())])
radius = np.sqrt(np.sum(np.square(np.meshgrid(*[np.linspace(-1, 1, 17)] * 3)), axis=0) / 3)
expected = np.histogram(2000 - 1000 * radius, 10, (1000, 2000))[0]
check(np.abs(bins / bins.sum() - expected / expected.sum()).max() < 0.03, "the histogram is that of the volume %s" % bins)
image.SelectInputScalars = ["POINTS", "a"]
simple.Render(view)
check(shown.LookupTable == image.LookupTable and list(shown.ColorArrayName) == ["FIELD", "a"], "the legend follows the array")
check(simple.GetScalarBar(image.LookupTable, view).Visibility == 1 and bar.Visibility == 0,
      "the new array's scalar bar replaces the other")

# The toolbar's box of arrays.
before = image.LookupTable
shown.SetScalarColoring("velocity", FIELD)
shown.RescaleTransferFunctionToDataRange(True, False)
check(list(image.SelectInputScalars) == ["POINTS", "velocity"], "an array chosen in the toolbar is the filter's")
check(shown.LookupTable == before and range_of(before) == [0, 1], "the legend stays that of the shown VDI meanwhile")
simple.Render(view)
check(shown.LookupTable == image.LookupTable != before and list(shown.ColorArrayName) == ["FIELD", "velocity"],
      "the legend follows the chosen array")
simple.ColorBy(shown, ("POINTS", "a"))
simple.ColorBy(shown, ("CELLS", "a"))
simple.Render(view)
check(list(image.SelectInputScalars) == ["POINTS", "a"] and list(shown.ColorArrayName) == ["FIELD", "a"],
      "a script chooses an array likewise; one that the input lacks changes nothing")

# The toolbar's box of components changes the map, and then fits it to the range that the VDI has.
image.SelectInputScalars = ["POINTS", "velocity"]
simple.Render(view)
bar = simple.GetScalarBar(image.LookupTable, view)
for name, component, ends in (("Z", 2, [-3, 3]), ("X", 0, [-1, 1]), ("Magnitude", -1, [0, round(14 ** 0.5, 4)])):
    shown.SetScalarColoring("velocity", FIELD, component)
    shown.RescaleTransferFunctionToDataRange(False, False)
    check(image.Component == component and range_of(image.LookupTable) == ends,
          "the VDI shows the component that its map names: %s, %s" % (image.Component, range_of(image.LookupTable)))
    check(bar.ComponentTitle == name, "the scalar bar names component %s: %s" % (name, bar.ComponentTitle))
    expected = fresh_picture(ball, "velocity", view, Component=component,
                             ScalarOpacityUnitDistance=image.ScalarOpacityUnitDistance)
    check(np.abs(picture(image).astype(int) - expected).max() <= 1, "component %s looks as in a new filter" % name)
image.Component = 1
check(bar.ComponentTitle == "Y", "the scalar bar follows Component: %s" % bar.ComponentTitle)
image.LookupTable.VectorMode = "Magnitude"
check(image.Component == -1, "Component follows a script's map: %s" % image.Component)
image.LookupTable.AutomaticRescaleRangeMode = "Never"
before = range_of(image.LookupTable)
image.LookupTable.VectorMode = "Component"
check(image.Component == 1 and range_of(image.LookupTable) == before, "a map that must keep its range keeps it")
image.LookupTable.AutomaticRescaleRangeMode = "Grow and update on 'Apply'"
image.SelectInputScalars = ["POINTS", "a"]
image.Component = -1
simple.Render(view)
shown.SetRepresentationType("Outline")
check(not shown.ColorArrayName[1], "a VDI that is shown as Outline isn't coloured by the array")
image.SelectInputScalars = ["POINTS", "velocity"]
image.Component = 1
opened = saved_map(image, "arrays_velocity.vdi")
path = os.path.join(OUTPUT, "arrays_velocity.vdi")
simple.Hide(image, view)
file_shown = simple.Show(opened, view)
simple.Render(view)
colors = file_shown.LookupTable
check(list(file_shown.ColorArrayName) == ["FIELD", "velocity"], "an opened file has the legend of its array")
check(range_of(colors) == range_of(image.LookupTable) and colors.VectorMode == "Component" and colors.VectorComponent == 1,
      "an opened file's map has the range and the component of the array: %s" % range_of(colors))
check(colors != image.LookupTable, "an opened file has a map of its own")
file_shown.SetScalarBarVisibility(view, True)
check(simple.GetScalarBar(colors, view).Title == "velocity", "an opened file has a scalar bar of its array")
simple.Delete(file_shown)
simple.Delete(opened)

# The range over all time steps comes from the input, without a VDI of each step.
steps = simple.ProgrammableSource(OutputDataSetType="vtkImageData")
steps.ScriptRequestInformation = EXTENT + """
information = self.GetExecutive().GetOutputInformation(0)
information.Set(Pipeline.TIME_STEPS(), [0.0, 1.0, 2.0], 3)
information.Set(Pipeline.TIME_RANGE(), [0.0, 2.0], 2)
"""
steps.Script = """
import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline as Pipeline
time = self.GetExecutive().GetOutputInformation(0).Get(Pipeline.UPDATE_TIME_STEP())
image = self.GetImageDataOutput()
image.SetDimensions(17, 17, 17)
array = numpy_to_vtk(np.linspace(-time, 10 + time, 17 ** 3), deep=True)
array.SetName("grows")
image.GetPointData().AddArray(array)
"""
moving = simple.VolumetricDepthImage(Input=steps, SelectInputScalars=["POINTS", "grows"])
moving_shown = simple.Show(moving, view)
simple.Render(view)
check(range_of(moving.LookupTable) == [0, 10], "the map has the first step's range: %s" % range_of(moving.LookupTable))
moving_shown.RescaleTransferFunctionToDataRangeOverTime()
check(range_of(moving.LookupTable) == [-2, 12],
      "Rescale over all time steps sets the range of them all: %s" % range_of(moving.LookupTable))
simple.Delete(moving_shown)
simple.Delete(moving)
image.SelectInputScalars = ["POINTS", "a"]

# The phase of complex numbers, for which ParaView has no component.
image.SelectInputScalars = ["POINTS", "complex"]
for component in (-1, 1):
    image.Component = component
    image.Component = -2
    ends, mode = range_of(image.LookupTable), image.LookupTable.VectorMode
    check(ends == [-round(np.pi, 4), round(np.pi, 4)] and mode == "Magnitude",
          "the phase has its range at once, after component %d: %s, %s" % (component, ends, mode))
shown = simple.Show(image, view)
shown.SetRepresentationType("VDI")
simple.Render(view)
image.LookupTable.RescaleTransferFunction(0, 1)
shown.RescaleTransferFunctionToDataRangeOverTime()
ends = range_of(image.LookupTable)
check(ends[0] < -3 and ends[1] == round(np.pi, 4), "the phase has its range over all time steps %s" % ends)
image.LookupTable.RescaleTransferFunction(0, 1)
shown.RescaleTransferFunctionToDataRange(False, True)
ends = range_of(image.LookupTable)
check(ends[0] < -3 and ends[1] == round(np.pi, 4), "Rescale to data range keeps the phase's negative values: %s" % ends)
table = image.LookupTable.SMProxy.ComputeDataHistogramTable(2)
bins = [table.GetColumn(1).GetValue(i) for i in range(2)]
check(0.8 < bins[0] / bins[1] < 1.25, "the phase's histogram has about as many negative values as positive ones: %s" % bins)
image.SelectInputScalars, image.Component = ["POINTS", "Q criterion"], -1

# A filter loaded from a state file, which names the map without the space.
state = os.path.join(OUTPUT, "arrays.pvsm")
simple.SaveState(state)
simple.ResetSession()
simple.LoadState(state)
again = [each for each in simple.GetSources().values() if each.SMProxy.GetXMLName() == "VolumetricDepthImage"][0]
picture(again)
again.SelectInputScalars = ["POINTS", "temperature"]
check(again.LookupTable == simple.GetColorTransferFunction("temperature"), "a state's filter takes another array's map, too")

# A filter restored by Undo after Delete.
stack, builder = vtkSMUndoStack(), vtkSMUndoStackBuilder()
builder.SetUndoStack(stack)
vtkSMProxyManager.GetProxyManager().SetUndoStackBuilder(builder)
undone = simple.VolumetricDepthImage(registrationName="undone", Input=again.Input)
undone.SelectInputScalars, undone.Resolution = ["POINTS", "a"], [16, 12]
undone.UpdatePipeline()
builder.Begin("Delete")
simple.Delete(undone)
del undone  # otherwise the proxy would live on
gc.collect()
builder.EndAndPushToStack()
check(simple.FindSource("undone") is None, "a filter is deleted")
stack.Undo()
servermanager.ProxyManager().UpdateRegisteredProxies(1)
undone = simple.FindSource("undone")
undone.SelectInputScalars = ["POINTS", "temperature"]
check(undone.LookupTable == simple.GetColorTransferFunction("temperature"),
      "after the undo, the filter takes another array's map")
vtkSMProxyManager.GetProxyManager().SetUndoStackBuilder(None)
finish()
