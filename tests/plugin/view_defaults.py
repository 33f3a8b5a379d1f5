"""VolumetricDepthImage takes settings from the active view, and traces and states make it anew."""

import os

import numpy as np
from paraview import smtrace
from pvtest import *  # noqa: F403

OPACITY = [80, 0, 0.5, 0, 300, 0.1, 0.5, 0, 550, 0.9, 0.5, 0]
SIZE, POSITION, UP = [160, 120], [40, 30, 50], [0.1, 0.9, 0.2]


def taken(image):
    return [list(image.CameraPosition), list(image.CameraFocalPoint), list(image.CameraViewUp), image.CameraViewAngle,
            image.CameraParallelProjection, image.CameraParallelScale, list(image.Resolution),
            image.ScalarOpacityUnitDistance, list(image.SelectInputScalars)]


def session():
    """A wavelet with a second array, shown as a volume coloured by that one."""
    wavelet = simple.Wavelet(WholeExtent=[-8, 8, -8, 8, -8, 8])
    twice = simple.Calculator(Input=wavelet, Function="2*RTData", ResultArrayName="twice")
    view = make_view(SIZE, POSITION, [1, 0, -1])
    view.CameraViewUp, view.CameraViewAngle = UP, 25
    representation = simple.Show(twice, view)
    representation.SetRepresentationType("Volume")
    simple.ColorBy(representation, ("POINTS", "twice"))
    representation.ScalarOpacityUnitDistance = 2.5
    simple.GetOpacityTransferFunction("twice").Points = OPACITY
    simple.Render(view)
    view.CameraPosition, view.CameraFocalPoint, view.CameraViewUp, view.CameraViewAngle = POSITION, [1, 0, -1], UP, 25
    return twice, view, representation


# A filter without a view has nothing to take.
alone = simple.VolumetricDepthImage(Input=simple.Wavelet())
alone.Resolution = [32, 24]
alone.UpdatePipeline()
check(list(alone.CameraPosition) == [0, 0, 0], "without a view no camera is set")
unplaced = simple.CreateView("RenderView")
other = simple.VolumetricDepthImage(Input=simple.Wavelet())
other.Resolution = [32, 24]
other.UpdatePipeline()
check(list(other.CameraPosition) == [0, 0, 0], "no camera is taken from a view whose camera nobody has placed")
explicit = simple.VolumetricDepthImage(Input=simple.Wavelet(WholeExtent=[-8, 8, -8, 8, -8, 8]), Resolution=[32, 24],
                                       ScalarOpacityUnitDistance=np.sqrt(3))
check(np.abs(picture(explicit).astype(int) - picture(simple.VolumetricDepthImage(
    Input=simple.Wavelet(WholeExtent=[-8, 8, -8, 8, -8, 8]), Resolution=[32, 24]))).max() <= 1,
      "without a view the unit distance is that of ParaView's volumes")
simple.ResetSession()

smtrace.start_trace()
source, view, representation = session()
image = simple.VolumetricDepthImage(registrationName="vdi", Input=source)
check(list(image.SelectInputScalars) == ["POINTS", "twice"], "a new filter has the array that is active")
image.UpdatePipeline()
check(taken(image)[:2] == [POSITION, [1, 0, -1]] and image.CameraViewAngle == 25
      and np.allclose(image.CameraViewUp, view.GetActiveCamera().GetViewUp()), "the first update takes the view's camera")
check(list(image.Resolution) == SIZE, "the first update takes the view's size")
check(image.ScalarOpacityUnitDistance == 2.5, "the first update takes the volume's unit distance")
check(image.LookupTable == representation.LookupTable, "the first update takes the volume's colour map")
view.CameraPosition = [50, 0, 0]
image.UpdatePipeline()
check(list(image.CameraPosition) == POSITION, "the second update takes nothing")
simple.Hide(source, view)
first, values = picture(image), taken(image)
check(first.max() > 60 and first.std() > 10, "the filter shows something")
write_png("view_defaults.png", first)
trace = smtrace.stop_trace()

kept = simple.VolumetricDepthImage(Input=source, CameraPosition=[0, 60, 1], Resolution=[64, 48], SelectInputScalars=[
    "POINTS", "RTData"])
kept.UpdatePipeline()
check(list(kept.CameraPosition) == [0, 60, 1] and list(kept.Resolution) == [64, 48]
      and list(kept.SelectInputScalars) == ["POINTS", "RTData"], "what a script has set stays")

# Comparative views, by their first one.
comparing = simple.CreateView("ComparativeRenderView")
simple.Show(source, comparing).SetRepresentationType("Volume")
simple.Render(comparing)
comparing.CameraPosition, comparing.CameraFocalPoint = [0, 20, 70], [0, 1, 0]
simple.SetActiveView(comparing)
compared = simple.VolumetricDepthImage(Input=source, SelectInputScalars=["POINTS", "twice"])
compared.UpdatePipeline()
check(list(compared.CameraPosition) == [0, 20, 70], "the camera is taken from a comparative view %s"
      % list(compared.CameraPosition))
check(simple.Show(compared, comparing).Representation == "VDI", "comparative views show VDIs as such")
simple.Delete(compared)
simple.Delete(comparing)
simple.SetActiveView(view)

state_file = os.path.join(OUTPUT, "view_defaults.pvsm")
simple.Delete(kept)
simple.SaveState(state_file)
for what, load in (("trace", lambda: exec(trace, {})), ("state", lambda: simple.LoadState(state_file))):
    simple.ResetSession()
    load()
    # Traces record settings of the window, not of scripts.
    simple.GetOpacityTransferFunction("twice").Points = OPACITY
    again = simple.FindSource("vdi")
    check(again is not None, "a %s makes the filter again" % what)
    different = [a for a, b in zip(taken(again), values) if a != b]
    check(not different, "the filter of the %s has the same values; different: %s" % (what, different))
    check(np.abs(picture(again).astype(int) - first).max() <= 1, "the filter of the %s has the same picture" % what)


def percent_of(proxy):
    proxy.SMProxy.UpdatePropertyInformation()
    return proxy.GetProperty("Preparation").GetData()


def held_of(proxy):
    proxy.SMProxy.UpdatePropertyInformation()
    return proxy.GetProperty("Held").GetData()


# Edits count at once in scripts; a window holds the filter.
again.SMProxy.InvokeCommand("Hold")
simple.GetOpacityTransferFunction("twice").Points = [80, 0, 0.5, 0, 550, 0, 0.5, 0]
check(np.abs(picture(again).astype(int) - first).max() <= 1, "while it is held, the filter keeps what it has")
again.SMProxy.InvokeCommand("Prepare")
while 0 <= percent_of(again) < 100:
    pass
check(percent_of(again) == 100, "the preparation gets to its end")
check(np.abs(picture(again).astype(int) - first).max() <= 1, "the prepared VDI waits for the release")
again.SMProxy.InvokeCommand("Release")
again.SMProxy.MarkDirty(again.SMProxy)
check(picture(again).max() == 0, "the release takes the prepared VDI")
simple.GetOpacityTransferFunction("twice").Points = [80, 0, 0.5, 0, 550, 1, 0.5, 0]
check(picture(again).max() > 60, "after the release, edits count at once again")
again.SMProxy.InvokeCommand("Prepare")
check(percent_of(again) == -1, "a VDI that exists already isn't prepared")

# A file gets the VDI of the current properties and maps, not the one that the window shows.
again.SMProxy.InvokeCommand("Hold")
simple.GetOpacityTransferFunction("twice").Points = [80, 0, 0.5, 0, 550, 0.5, 0.5, 0]
written = os.path.join(OUTPUT, "view_defaults.vdi")
for what in ("while edits rest", "while a VDI is made"):
    simple.SaveData(written, proxy=again)
    check(held_of(again) == 0, "writing ends the hold " + what)
    image_now = picture(simple.OpenDataFile(written))
    simple.SetActiveSource(again.Input)
    fresh = simple.VolumetricDepthImage(Input=again.Input, SelectInputScalars=["POINTS", "twice"])
    fresh.SMProxy.Copy(again.SMProxy)
    fresh.LookupTable = again.LookupTable
    check(np.array_equal(image_now, picture(fresh)), "a file is of the colours that are set " + what)
    again.SMProxy.InvokeCommand("Hold")
    simple.GetOpacityTransferFunction("twice").Points = [80, 0, 0.5, 0, 550, 0.7, 0.5, 0]
    again.SMProxy.InvokeCommand("Prepare")
again.SMProxy.InvokeCommand("Release")

# An edit cancels the work that the previous one began, and doesn't wait for it.
again.Supersegments, again.Resolution, again.SamplingRate = 40, [1200, 900], 4
simple.GetOpacityTransferFunction("twice").Points = [80, 0, 0.5, 0, 550, 0.4, 0.5, 0]
again.SMProxy.InvokeCommand("Prepare")
check(0 <= percent_of(again) < 100, "a large VDI takes a while to prepare")
again.SMProxy.InvokeCommand("Hold")
while 0 <= percent_of(again) < 100:
    pass
check(percent_of(again) == -1, "a preparation ends once another edit holds the filter")
again.SMProxy.InvokeCommand("Release")
again.Supersegments, again.Resolution, again.SamplingRate = 25, SIZE, 0
picture(again)

simple.GetOpacityTransferFunction("twice").Points = [80, 0, 0.5, 0, 550, 0.3, 0.5, 0]
again.SMProxy.InvokeCommand("Prepare")
simple.GetOpacityTransferFunction("twice").Points = [80, 0, 0.5, 0, 550, 0, 0.5, 0]
check(picture(again).max() == 0, "what was prepared of older points isn't taken")
finish()
