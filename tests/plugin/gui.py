"""Runs inside the real ParaView (--script, which sets no __file__): uses the plugin as a person would, then leaves the file
gui.done with "ok" or what went wrong. tests/plugin/gui.sh takes the picture of the window and ends the program."""

import os
import sys
import traceback

sys.path.insert(0, os.environ["VDI_TEST_SOURCE"])
OUTPUT = os.environ["VDI_TEST_OUTPUT"]


def screenshot(view, name):
    import pvtest
    from paraview import simple
    path = os.path.join(OUTPUT, name)
    simple.SaveScreenshot(path, view, ImageResolution=[480, 320])
    return pvtest.read_png(path)


def use():
    import pvtest
    from paraview import simple

    view = simple.GetActiveViewOrCreate("RenderView")
    view.OrientationAxesVisibility = 0
    wavelet = simple.Wavelet()
    wavelet.UpdatePipeline()
    pvtest.set_colors("RTData", 37, 277)
    image = simple.VolumetricDepthImage(Input=wavelet)
    image.Resolution = [480, 320]
    image.CameraPosition, image.CameraFocalPoint = [45, 32, 52], [0, 0, 0]
    image.ScalarOpacityUnitDistance = 3
    image.UpdatePipeline()
    rendered = simple.RenderVDI(Input=image)
    rendered.UseOriginalCamera = 1
    rendered.Azimuth = 15
    display = simple.Show(image, view)
    display.SetRepresentationType("Slice")
    simple.ColorBy(display, ("POINTS", "RGBA"))
    display.MapScalars = 0
    simple.SetActiveSource(image)
    simple.ResetCamera(view)
    simple.Render(view)
    for proxy, what in ((image, "the filter's picture"), (rendered, "the VDI from 15 degrees")):
        shown = pvtest.picture(proxy)
        pvtest.check(shown is not None and shown.max() > 60 and shown.max(axis=2).std() > 10, what + " shows something")
    shown = screenshot(view, "gui_view.png")
    simple.Hide(image, view)
    share = pvtest.wrong_share(shown, screenshot(view, "gui_empty.png"), shown)
    print("the picture takes {:.2%} of the view".format(share))
    pvtest.check(share > 0.01, "Show puts the picture into the view")
    simple.Show(image, view)
    simple.Render(view)
    return pvtest.failures


try:
    failures = use()
    message = "ok" if not failures else "; ".join(failures)
except Exception:
    message = traceback.format_exc()
with open(os.path.join(OUTPUT, "gui.done"), "w") as done:
    done.write(message)
