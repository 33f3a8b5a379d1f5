"""Runs inside the real ParaView (--script): loads the plugin, shows a volume of two arrays and four time steps, and says
"ready". From then on it answers the calls of beside.py. The data are made once, so the tests
measure the time of the VDI alone."""

import os
import sys

from paraview import simple

sys.path.insert(0, os.path.join(os.path.dirname(os.environ["VDI_TEST_SOURCE"]), "window"))
from inside import OUTPUT, show_and_answer  # noqa: E402

SIZE = 96

INFORMATION = """
executive, info = self.GetExecutive(), self.GetOutputInformation(0)
size = %d
info.Set(executive.WHOLE_EXTENT(), 0, size - 1, 0, size - 1, 0, size - 1)
info.Remove(executive.TIME_STEPS())
for step in range(4):
    info.Append(executive.TIME_STEPS(), float(step))
info.Remove(executive.TIME_RANGE())
info.Append(executive.TIME_RANGE(), 0.0)
info.Append(executive.TIME_RANGE(), 3.0)
""" % SIZE

DATA = """
import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk
info = self.GetOutputInformation(0)
time = info.Get(self.GetExecutive().UPDATE_TIME_STEP()) if info.Has(self.GetExecutive().UPDATE_TIME_STEP()) else 0.0
size = %d
image = self.GetImageDataOutput()
image.SetDimensions(size, size, size)
if not hasattr(self, "made"):
    z, y, x = np.meshgrid(*[np.linspace(-1, 1, size, dtype=np.float32)] * 3, indexing="ij")
    self.made = {}
    for step in range(4):
        waves = np.sin(9 * x + step) + np.sin(8 * y - step) * np.cos(7 * z)
        self.made[step] = [np.exp(-2 * (x * x + y * y + z * z)) * (2 + waves), 1000 + 500 * waves * (1 - x * x)]
for name, values in zip(("small", "temperature"), self.made[int(time)]):
    array = numpy_to_vtk(values.ravel(), deep=1)
    array.SetName(name)
    image.GetPointData().AddArray(array)
image.GetPointData().SetActiveScalars("small")
image.GetInformation().Set(image.DATA_TIME_STEP(), time)
""" % SIZE


def filter_now():
    return simple.FindSource("VolumetricDepthImage1")


def output_now():
    """The filter's output, without an update: its array's name, its time, and whether there's a VDI."""
    made = filter_now()
    fields = made.GetClientSideObject().GetOutputDataObject(0).GetFieldData()
    parameters = fields.GetArray("VDI.parameters")
    array = next((name for name in ("small", "temperature") if fields.GetArray(name)), None)
    made.SMProxy.UpdatePropertyInformation()
    outdated = made.SMProxy.GetProperty("Outdated").GetElement(0) == 1
    return {"array": array, "time": parameters.GetValue(2) if parameters else None, "outdated": outdated,
            "codes": fields.GetArray("VDI.codes").GetNumberOfTuples() if parameters else 0}


def bar_title():
    """The words beside the VDI's colours."""
    bar = simple.GetScalarBar(filter_now().LookupTable, simple.GetActiveView())
    return " ".join(word for word in (bar.Title, bar.ComponentTitle) if word)


def fetched():
    """Whether a script gets a VDI."""
    data = simple.servermanager.Fetch(filter_now())
    return data.GetFieldData().GetArray("VDI.codes") is not None


def edit_opacity(peak):
    """Edits the opacity of the array that is shown."""
    opacity = simple.GetOpacityTransferFunction(output_now()["array"])
    points = list(opacity.Points)
    points[-3] = peak
    opacity.Points = points


def prepare_films():
    """VDIs that are made quickly, and pictures without ParaView's axes, which differ from one to the next."""
    filter_now().SamplingRate = 1
    simple.GetActiveView().OrientationAxesVisibility = 0


def save_film():
    simple.SaveAnimation(os.path.join(OUTPUT, "film.png"), simple.GetActiveView(), ImageResolution=[320, 240],
                         FrameWindow=[0, 3], SuffixFormat=".%04d")


def save_step(step):
    """Saves a picture of the step's VDI, which is made beforehand; returns that VDI's time."""
    simple.GetAnimationScene().AnimationTime = float(step)
    filter_now().UpdatePipeline(float(step))
    time = output_now()["time"]
    simple.SaveScreenshot(os.path.join(OUTPUT, "step_%d.png" % step), simple.GetActiveView(), ImageResolution=[320, 240])
    return time


noted = []  # by note_frames: times of the view, and of the VDI that it shows then


def note_frames():
    view = simple.GetActiveView()
    view.SMProxy.AddObserver("EndEvent", lambda *_: noted.append([view.ViewTime, output_now()["time"]]))


def is_played():
    return simple.GetAnimationScene().SMProxy.GetProperty("AnimationTime").GetElement(0) < 3.0


show_and_answer(INFORMATION, DATA, "small", globals())
