"""Windows, which pvpython has, show the angle between the view and the VDI's viewpoint; screenshots omit it.
representation.py checks that pvbatch omits it, too."""


import numpy as np
import pvtest
from paraview import simple
from pvtest import check

SIZE, CENTER, CAMERA = [320, 240], [0.5, 0.5, 0.5], [0.5, 0.5, 4.0]


def make(name, *options):
    return simple.OpenDataFile(pvtest.make_vdi(
        name, "--field", "turbulence", "--size", "24x24x24", "--resolution", "120x90", "--focal-point", *map(str, CENTER),
        "--view-up", "0", "1", "0", *options))


def turned(degrees, elevation=0, render=simple.Render):
    """The view's text after that turn from CAMERA."""
    view.CameraPosition, view.CameraFocalPoint, view.CameraViewUp = CAMERA, CENTER, [0, 1, 0]
    view.GetActiveCamera().Azimuth(degrees)
    view.GetActiveCamera().Elevation(elevation)
    render(view)
    return pvtest.angle_in(view)


def interactive(view):
    view.SMProxy.InteractiveRender()


def screenshot(name):
    return pvtest.screenshot(view, "angle_{}.png".format(name), SIZE)


def said(degrees):
    return "{}\u00b0 from the VDI's viewpoint".format(degrees)


def one_vdi():
    check(turned(0) == "" and turned(4) == "" and turned(0, -4) == "", "nothing is said from near the viewpoint")
    for degrees in (6, 47, 90, -133):
        check(turned(degrees) == said(abs(degrees)), "a view that is turned by {} degrees says so".format(degrees))
    check(turned(0, 30) == said(30), "a view from 30 degrees above says so")
    check(turned(20, render=interactive) == said(20) and turned(23, render=interactive) == said(23),
          "each frame of a moving camera says its own angle")
    view.CameraParallelProjection = 1
    check(turned(47) == said(47) and turned(2) == "", "a view in parallel projection says its angle, too")
    view.CameraParallelProjection = 0


def other_messages():
    view.CameraPosition, view.CameraFocalPoint = [0.7, 0.5, 0.4], CENTER
    simple.Render(view)
    check("From inside" in pvtest.message_in(view) and pvtest.angle_in(view) == "",
          "a view from inside says only that, and no angle")
    view.CameraPosition, view.CameraFocalPoint = [3, 0.5, 3], [6, 0.5, 6]
    simple.Render(view)
    check("out of sight" in pvtest.message_in(view) and pvtest.angle_in(view) == "",
          "a view that looks away says only that, and no angle")


def pictures():
    turned(47)
    taken = screenshot("taken")
    display.VDIAngle = 0
    check(turned(47) == "" and np.array_equal(taken, screenshot("off")), "screenshots leave the angle out")
    display.VDIAngle = 1
    simple.Render(view)
    check(pvtest.angle_in(view) == said(47), "the window says the angle again once VDIAngle is on")
    low, high = pvtest.text_boxes(view, pvtest.DEGREES)[0]
    check(0 < low < high < 36, "the angle is at the lower edge of the view: rows {:g} to {:g}".format(low, high))


def several():
    other = make("angle_other.vdi", "--position", "4.0", "0.5", "0.5")
    shown = simple.Show(other, view)
    check(turned(30) == "up to 60\u00b0 from the VDIs' viewpoints", "of two VDIs the farther one counts")
    check(turned(60) == "up to 60\u00b0 from the VDIs' viewpoints",
          "of two VDIs the farther one counts, even if it is the first")
    shown.VDIAngle = 0
    check(turned(30) == said(30), "a VDI whose VDIAngle is off doesn't count")
    shown.VDIAngle = 1
    simple.Hide(other, view)
    check(turned(30) == said(30), "a hidden VDI doesn't count")
    simple.Hide(reader, view)
    simple.Render(view)
    check(pvtest.angle_in(view) == "", "where both VDIs are hidden, the view says no angle")


reader = make("angle.vdi", "--position", *map(str, CAMERA))
view = pvtest.make_view(SIZE, CAMERA, CENTER)
display = simple.Show(reader, view)
simple.Render(view)
one_vdi()
other_messages()
pictures()
several()
pvtest.finish()
