"""Runs inside the real ParaView (--script, which sets no __file__): uses the plugin as a person
would, checks the window's own reactions, and leaves the file gui.done with "ok" or the faults.
tests/plugin/gui.sh takes the picture of the window and ends the program."""

import os
import sys
import time
import traceback

sys.path.insert(0, os.environ["VDI_TEST_SOURCE"])
OUTPUT = os.environ["VDI_TEST_OUTPUT"]


def show_slice(source, view):
    """Shows the source's flat picture in its own colours."""
    from paraview import simple
    display = simple.Show(source, view)
    display.SetRepresentationType("Slice")
    simple.ColorBy(display, ("POINTS", "RGBA"))
    display.MapScalars = 0


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
    cropping = image.SMProxy.GetProperty("Cropping")
    cropping.SetUncheckedElement(0, 1)  # as the panel does before Apply
    pvtest.check(list(image.CroppingBox) == [-10, 10] * 3,
                 "a tick at Cropping shows the input's bounds: %s" % list(image.CroppingBox))
    cropping.ClearUncheckedElements()
    rendered = simple.RenderVDI(Input=image)
    rendered.UseOriginalCamera = 1
    rendered.Azimuth = 15
    show_slice(image, view)
    simple.SetActiveSource(image)
    simple.ResetCamera(view)
    simple.Render(view)
    for proxy, what in ((image, "the filter's picture"), (rendered, "the VDI from 15 degrees")):
        shown = pvtest.picture(proxy)
        pvtest.check(shown is not None and shown.max() > 60 and shown.max(axis=2).std() > 10, what + " shows something")
    shown = pvtest.screenshot(view, "gui_view.png", [480, 320])
    simple.Hide(image, view)
    share = pvtest.wrong_share(shown, pvtest.screenshot(view, "gui_empty.png", [480, 320]), shown)
    print("the picture takes {:.2%} of the view".format(share))
    pvtest.check(share > 0.01, "Show puts the picture into the view")
    simple.Show(image, view)
    simple.Render(view)
    return view, image, rendered


class Later:
    """Steps after the end of the script, in the window's event loop. Each step is called repeatedly
    until it returns True, for at most 30 seconds."""

    def __init__(self, view, steps):
        self.steps, self.since, self.looks = steps, time.monotonic(), False
        self.interactor = view.GetInteractor()
        self.observer = self.interactor.AddObserver("TimerEvent", self.look)
        self.timer = self.interactor.CreateRepeatingTimer(100)

    def look(self, *_):
        import pvtest
        if self.looks:  # a step lets the window handle its events
            return
        self.looks = True
        try:
            what, step = self.steps[0]
            good = step()
            if not good and time.monotonic() < self.since + 30:
                return
            pvtest.check(good, what)
            self.steps, self.since = self.steps[1:], time.monotonic()
            if self.steps:
                return
            message = "; ".join(pvtest.failures) or "ok"
        except Exception:
            message = traceback.format_exc()
        finally:
            self.looks = False
        self.interactor.DestroyTimer(self.timer)
        self.interactor.RemoveObserver(self.observer)
        leave(message)


def leave(message):
    with open(os.path.join(OUTPUT, "gui.done"), "w") as done:
        done.write(message)


def is_idle(image):
    """Whether no VDI is being made for the window."""
    image.SMProxy.UpdatePropertyInformation()
    return image.SMProxy.GetProperty("Held").GetElement(0) == 0


def approach(view, image):
    """Moves the view straight towards the middle of the volume. From there, the part that Cropping leaves is seen from another
    side, by 22 degrees."""
    from paraview import simple
    image.Cropping, image.CroppingBox = 1, [6, 10, -10, -6, 6, 10]
    image.AutoAngle, image.Auto = 10, 1
    view.InteractionMode = "3D"
    view.CameraPosition, view.CameraFocalPoint = [0.35 * x for x in image.CameraPosition], [8, -8, 8]
    simple.Render(view)
    return list(view.CameraPosition)


def show_alone(view, image, rendered):
    """Shows the output of Render VDI in place of the image."""
    from paraview import simple
    image.Auto, image.Cropping, image.Resolution = 0, 0, [480, 320]
    image.CameraPosition, image.CameraFocalPoint = [45, 32, 52], [0, 0, 0]
    simple.Hide(image, view)
    show_slice(rendered, view)
    simple.ResetCamera(view)
    simple.Render(view)
    return True


def colors_of(rendered):
    """The colours that the filter has, without an update."""
    from vtkmodules.util.numpy_support import vtk_to_numpy
    return vtk_to_numpy(rendered.GetClientSideObject().GetOutputDataObject(0).GetPointData().GetArray("RGBA")).astype(int)


def edit(image, rendered):
    """Turns the colours around. Returns the picture before."""
    before = colors_of(rendered)
    image.LookupTable.RGBPoints = [37, 0.9, 0.1, 0.1, 157, 0.9, 0.9, 0.2, 277, 0.1, 0.2, 0.9]
    return before


def has_changed(rendered, before):
    now = colors_of(rendered)
    return now.shape == before.shape and abs(now - before).max() > 30


try:
    view, image, rendered = use()
    near = approach(view, image)
    before = []
    later = Later(view, [
        ("Auto goes by the angle at the middle of what Cropping leaves",
         lambda: max(abs(a - b) for a, b in zip(image.CameraPosition, near)) < 1e-3 and is_idle(image)),
        ("Render VDI is shown alone", lambda: show_alone(view, image, rendered)),
        ("the window has nothing left to do", lambda: time.monotonic() > later.since + 1.5),
        ("a colour is edited", lambda: before.append(edit(image, rendered)) is None),
        ("a view of Render VDI alone follows the edit", lambda: has_changed(rendered, before[0]))])
except Exception:
    leave(traceback.format_exc())
