"""A view whose VDI couldn't be made, or whose file couldn't be read, shows the next good one."""

import os
import shutil

import numpy as np

import pvtest
from paraview import simple
from pvtest import check

SIZE, FAILED = [160, 120], "its filter or reader has failed"


def is_made(image):
    """Whether the filter has an output, without an update."""
    return image.GetClientSideObject().GetOutputDataObject(0).GetNumberOfPoints() > 0


def same(one, other):
    return np.abs(one.astype(int) - other).max() <= 1


# A blend mode that VDIs can't hold, in each representation.
wavelet = simple.Wavelet()
for kind in ("VDI", "Outline", "Slice"):
    view = pvtest.make_view(SIZE, [40, 30, 50], [0, 0, 0])
    image = pvtest.vdi_filter(wavelet, view, "POINTS", "RTData", 3)
    simple.Show(image, view).SetRepresentationType(kind)
    simple.Render(view)  # the first picture of a view moves its camera
    view.CameraPosition, view.CameraFocalPoint = [40, 30, 50], [0, 0, 0]
    for attempt in ("first", "second"):
        expected = pvtest.screenshot(view, None, SIZE)
        image.BlendMode = "Maximum Intensity"
        simple.Render(view)
        check(not is_made(image), "{}: the {} update fails".format(kind, attempt))
        if kind == "VDI":
            check(FAILED in pvtest.message_in(view), "the view says that the {} update has failed".format(attempt))
        image.BlendMode = "Composite"
        simple.Render(view)
        check(is_made(image), "{}: the view makes the VDI after the {} failure".format(kind, attempt))
        check(expected.std() > 3 and same(pvtest.screenshot(view, None, SIZE), expected) and not pvtest.message_in(view),
              "{}: the view shows the VDI after the {} failure".format(kind, attempt))
    simple.SaveData(os.path.join(pvtest.OUTPUT, "recovery_{}.vdi".format(kind)), proxy=image)
    simple.Delete(view)

# A single file that is damaged and then repaired.
whole = os.path.join(pvtest.OUTPUT, "recovery_VDI.vdi")
path = shutil.copy(whole, os.path.join(pvtest.OUTPUT, "recovery_file.vdi"))
reader = simple.OpenDataFile(path)
view = pvtest.make_view(SIZE, [40, 30, 50], [0, 0, 0])
simple.Show(reader, view)
simple.Render(view)
view.CameraPosition, view.CameraFocalPoint = [40, 30, 50], [0, 0, 0]
expected = pvtest.screenshot(view, None, SIZE)
for attempt in ("first", "second"):
    os.truncate(path, os.path.getsize(path) // 2)
    simple.ReloadFiles(reader)
    simple.Render(view)
    check(FAILED in pvtest.message_in(view), "the view says that the file can't be read: {} time".format(attempt))
    shutil.copy(whole, path)
    simple.ReloadFiles(reader)
    simple.Render(view)
    check(expected.std() > 5 and same(pvtest.screenshot(view, None, SIZE), expected) and not pvtest.message_in(view),
          "the view shows the file that is whole again: {} time".format(attempt))
pvtest.finish()
