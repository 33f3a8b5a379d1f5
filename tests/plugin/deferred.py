"""Views that are deferred as in ParaView's window, but without the window. Such a view shows the
last VDI until the next one is prepared, new blocks included. All other consumers get the requested
VDI. On any number of ranks."""

import time

import numpy as np
from pvtest import STEPS, check, finish, set_colors, simple
from vtkmodules.util.numpy_support import vtk_to_numpy


def codes(image):
    """The codes of the VDI that the filter has, without an update."""
    array = image.GetClientSideObject().GetOutputDataObject(0).GetFieldData().GetArray("VDI.codes")
    return None if array is None else vtk_to_numpy(array).copy()


def made_at(image):
    """The time of the VDI that the filter has, without an update."""
    return image.GetClientSideObject().GetOutputDataObject(0).GetFieldData().GetArray("VDI.parameters").GetValue(2)


def same(one, other):
    return one is not None and other is not None and one.shape == other.shape and bool((one == other).all())


def asked(image, name):
    """An information property. Scripts of programmable filters import NumPy's names here, `number` among them."""
    image.SMProxy.UpdatePropertyInformation()
    return image.SMProxy.GetProperty(name).GetElement(0)


def prepare(image):
    """Prepares the VDI as the window does, until it is complete."""
    image.SMProxy.InvokeCommand("Prepare")
    end = time.monotonic() + 60
    while 0 <= asked(image, "Preparation") < 100 and time.monotonic() < end:
        image.SMProxy.InvokeCommand("ServePreparation")
        time.sleep(0.02)
    return asked(image, "Preparation")


def release_and_render(image, view):
    image.SMProxy.InvokeCommand("Release")
    image.SMProxy.MarkDirty(image.SMProxy)
    simple.Render(view)


SCALED = """
time = self.GetOutputInformation(0).Get(self.GetExecutive().UPDATE_TIME_STEP())
output.PointData.append(inputs[0].PointData["RTData"] * (1.0 - 0.3 * time), "RTData")
output.VTKObject.GetInformation().Set(output.VTKObject.DATA_TIME_STEP(), time)
"""

wavelet = simple.Wavelet(WholeExtent=[-16, 16] * 3)
wavelet.UpdatePipeline()
set_colors("RTData", 37, 277)
image = simple.VolumetricDepthImage(Input=wavelet, Resolution=[96, 64])
image.CameraPosition, image.CameraFocalPoint = [60, 40, 70], [0, 0, 0]
view = simple.GetActiveViewOrCreate("RenderView")
simple.Show(image, view)
simple.Render(view)
first = codes(image)
image.SMProxy.InvokeCommand("DeferViews")

wavelet.XFreq = 20  # other blocks
simple.Render(view)
check(asked(image, "Outdated") == 1 and same(codes(image), first), "a deferred view shows the VDI made last")
check(prepare(image) == 100, "the VDI that a deferred view asks for is prepared")
release_and_render(image, view)
second = codes(image)
check(asked(image, "Outdated") == 0 and second is not None and not same(second, first),
      "a prepared VDI is shown after the release")

wavelet.XFreq = 30
simple.Render(view)
check(asked(image, "Outdated") == 1, "other blocks are asked for")
image.SMProxy.InvokeCommand("Hold")  # gives up what is prepared, as an edit does
release_and_render(image, view)
check(asked(image, "Outdated") == 1, "a VDI that was given up stays asked for")
image.UpdatePipeline()
check(asked(image, "Outdated") == 0, "an update by another caller makes the VDI that was asked for")
third = codes(image)
check(third is not None and not same(third, second), "the update makes the VDI of the new blocks")

image.Supersegments = 8
simple.Render(view)
check(asked(image, "Outdated") == 1 and same(codes(image), third), "a property is asked for, too")
image.SMProxy.InvokeCommand("Prepare")
image.UpdatePipeline()
check(asked(image, "Outdated") == 0 and not same(codes(image), third), "an update waits for what is being prepared")

image.SMProxy.InvokeCommand("DeferNoViews")
for frequency, deferred in ((20, second), (30, third)):
    wavelet.XFreq = frequency
    image.Supersegments = 25
    image.UpdatePipeline()
    check(np.shape(deferred) == np.shape(codes(image)) and same(deferred, codes(image)),
          "the same VDI is made in place, at frequency %d" % frequency)

# With each request, ParaView's own filters hand the same AMR blocks over in another data set. The source gives each rank
# all blocks, and two ranks may not have the same ones.
if simple.servermanager.ActiveConnection.GetNumberOfDataPartitions() == 1:
    image.SMProxy.InvokeCommand("DeferViews")
    image.Input = simple.AMRGaussianPulseSource()
    image.SelectInputScalars = ["CELLS", "Gaussian-Pulse"]
    simple.Render(view)
    check(prepare(image) == 100, "the VDI of AMR data is prepared")
    release_and_render(image, view)
    check(asked(image, "Outdated") == 0, "the prepared VDI of AMR data is shown")
    image.SMProxy.InvokeCommand("DeferNoViews")
    image.SelectInputScalars = ["POINTS", "RTData"]

# Time steps: the view asks for them, and only its update tells others.
steps = simple.ProgrammableFilter(Input=wavelet, CopyArrays=0, RequestInformationScript=STEPS, Script=SCALED)
image.Input = steps
view.ViewTime = 0.0
simple.Render(view)
first = codes(image)
image.SMProxy.InvokeCommand("DeferViews")
updates = []
view.SMProxy.AddObserver("UpdateDataEvent", lambda *_: updates.append(asked(image, "Outdated")))
view.ViewTime = 1.0
simple.Render(view)
check(updates == [1] and same(codes(image), first), "a view shows the previous step, and its update says so")
check(prepare(image) == 100, "the step is prepared")
release_and_render(image, view)
second = codes(image)
check(updates == [1, 0] and second is not None and not same(second, first), "a prepared step is shown after the release")
check(second is None or made_at(image) == 1.0, "the prepared step's VDI has the time of the step")
image.SMProxy.InvokeCommand("DeferNoViews")
for time_step, deferred in ((0.0, first), (1.0, second)):
    image.UpdatePipeline(time_step)
    check(same(deferred, codes(image)), "the same VDI is made in place, at time %g" % time_step)
finish()
