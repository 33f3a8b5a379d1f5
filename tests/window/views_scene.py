"""Runs inside the real ParaView (--script): loads the plugin, shows a volume of vectors, and says "ready". From then on it
answers what views.py asks of it."""

import os
import sys

from paraview import simple

sys.path.insert(0, os.path.join(os.path.dirname(os.environ["VDI_TEST_SOURCE"]), "window"))
from inside import kept, show_and_answer  # noqa: E402

DATA = """
import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk
size = 48
image = self.GetImageDataOutput()
image.SetDimensions(size, size, size)
z, y, x = np.meshgrid(*[np.linspace(-1, 1, size, dtype=np.float32)] * 3, indexing="ij")
fall = np.exp(-2 * (x * x + y * y + z * z))
vectors = np.stack([fall * np.sin(5 * x), 2 * fall * np.cos(4 * y), 3 * fall * np.sin(6 * z)], axis=3)
for name, values in (("velocity", vectors.reshape(-1, 3)), ("density", 5 * np.sin(4 * x.reshape(-1)) ** 2)):
    array = numpy_to_vtk(values, deep=1)
    array.SetName(name)
    image.GetPointData().AddArray(array)
"""

INFORMATION = """
executive, info = self.GetExecutive(), self.GetOutputInformation(0)
info.Set(executive.WHOLE_EXTENT(), 0, 47, 0, 47, 0, 47)
"""


def filter_now():
    return simple.FindSource("VolumetricDepthImage1")


def shown_component():
    """The component of which the output has more values than the ends of a range: that of a VDI."""
    values = filter_now().GetClientSideObject().GetOutputDataObject(0).GetFieldData().GetArray("velocity")
    if values is None or values.GetNumberOfTuples() < 3:
        return None
    return [component for component in range(3) if values.GetRange(component) != (0.0, 0.0)]


def coloring():
    """The filter's component, the ends of its map, what the scalar bar names, and whether the VDI is still to be made."""
    made = filter_now()
    made.SMProxy.UpdatePropertyInformation()
    points = list(made.LookupTable.RGBPoints)
    bars = [simple.GetScalarBar(made.LookupTable, view) for view in simple.GetViews() if view.GetXMLName() == "RenderView"]
    return {"component": made.Component, "ends": [round(points[0], 3), round(points[-4], 3)],
            "title": bars[0].ComponentTitle, "shown": shown_component(),
            "outdated": made.SMProxy.GetProperty("Outdated").GetElement(0) == 1}


def legend():
    """The filter's array, whether the legend has its map, the titles of the scalar bars that the view shows, and whether the
    VDI is still to be made."""
    made, view = filter_now(), simple.GetActiveView()
    made.SMProxy.UpdatePropertyInformation()
    shown = simple.GetRepresentation(made, view)
    bars = [each.Title for each in view.Representations
            if each.GetXMLName() == "ScalarBarWidgetRepresentation" and each.Visibility]
    return {"array": made.SelectInputScalars[1], "map": [shown.LookupTable == made.LookupTable, bars],
            "outdated": made.SMProxy.GetProperty("Outdated").GetElement(0) == 1}


def opacity():
    return list(filter_now().LookupTable.ScalarOpacityFunction.Points)


def set_rate(rate):
    filter_now().SamplingRate = rate


def let_input_change(changes):
    """From now on the input is out of date after each update; or no longer. Asks for another VDI."""
    source, image = [each.GetClientSideObject() for each in (simple.FindSource("Scene"), filter_now())]
    if changes:
        kept.append(image.AddObserver("EndEvent", lambda *_: source.Modified()))
    else:
        image.RemoveObserver(kept.pop())
    set_rate(1 if changes else 2)
    simple.Render()


def camera():
    return [round(x, 3) for x in filter_now().CameraPosition]


def show_twice():
    """Shows the VDI in a second view, to the right of the first."""
    simple.GetLayout().SplitHorizontal(0, 0.5)
    view = simple.CreateView("RenderView")
    simple.AssignViewToLayout(view=view, layout=simple.GetLayout(), hint=2)
    simple.Show(filter_now(), view)
    view.ResetCamera()
    simple.SetActiveView(view)
    simple.SetActiveSource(filter_now())
    simple.RenderAllViews()


show_and_answer(INFORMATION, DATA, "velocity", globals())
