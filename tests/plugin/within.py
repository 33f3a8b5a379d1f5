"""Updates requested in the middle of another update, as by timers of ParaView's window, which run while a progress bar
moves. They used to wait for the update that had to wait for them."""

import numpy as np
from pvtest import *  # noqa: F403
from paraview import simple

SIZE = [96, 72]


def filter_of(wavelet, azimuth):
    image = simple.VolumetricDepthImage(Input=wavelet)
    image.SelectInputScalars = ["POINTS", "RTData"]
    image.Resolution = SIZE
    image.CameraPosition, image.CameraFocalPoint = [60 * np.sin(azimuth), 0, 60 * np.cos(azimuth)], [0, 0, 0]
    return image


def picture(image):
    """The pixels of the filter's output as it is, without an update."""
    return np.array(vtk_to_numpy(image.GetClientSideObject().GetOutputDataObject(0).GetPointData().GetArray("RGBA")))


def within_update(image, action):
    """Calls `action` once, in the middle of the filter's next update. Returns its result in a list."""
    results = []
    client = image.GetClientSideObject()

    def act(*_):
        if not results and client.GetProgress() > 0.2:  # VTK tells of 0 before the filter begins
            results.append(None)
            results[0] = action()

    tag = client.AddObserver("ProgressEvent", act)
    image.UpdatePipeline()
    client.RemoveObserver(tag)
    check(len(results) == 1, "the update has shown its progress")
    return results


wavelet = simple.Wavelet(WholeExtent=[-16, 16] * 3)
first, second = filter_of(wavelet, 0.0), filter_of(wavelet, 1.0)
for image in (first, second):
    image.UpdatePipeline()
before = [picture(first), picture(second)]

told = []
for image in (first, second):
    image.GetClientSideObject().AddObserver(1000 + 5646, lambda *_: told.append(1))


def update(image):
    image.GetClientSideObject().Modified()  # VTK would find it up to date
    image.GetClientSideObject().Update()
    return picture(image)


# Another filter of the same volume, whose colours have changed meanwhile.
first.LookupTable.RescaleTransferFunction(40, 200)
given, = within_update(first, lambda: update(second))
check(np.array_equal(given, before[1]), "an update within another one gives the last picture")
check(len(told) == 1, "it says so")
check(not np.array_equal(picture(first), before[0]), "the update itself has the new colours")
second.SMProxy.InvokeCommand("Release")
second.SMProxy.MarkDirty(second.SMProxy)
second.UpdatePipeline()
check(not np.array_equal(picture(second), before[1]), "the next one has them, too")

# The filter itself.
first.LookupTable.RescaleTransferFunction(40, 250)
within_update(first, lambda: update(first))
after = picture(first)
first.SMProxy.InvokeCommand("Release")
first.UpdatePipeline()
check(np.array_equal(picture(first), after), "an update within the filter's own one changes nothing")
single = filter_of(wavelet, 0.0)
single.UpdatePipeline()
check(np.array_equal(picture(single), after), "its VDI is that of a filter on its own")
