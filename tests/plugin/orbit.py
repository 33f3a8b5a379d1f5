"""Measures how fast a VDI orbits in a view of 1280 x 720, and checks that neither orbits nor time steps leak memory.
The figures are this machine's; they are lower on a busy one. Arguments: the parts to run (fluid, recognisable,
memory)."""

import os
import sys
import time

import pvtest
from paraview import simple
from pvtest import check

SIZE, CENTER = [1280, 720], [0.5, 0.5, 0.5]


def make(name, *options, field="turbulence"):
    return pvtest.make_vdi(name, "--field", field, *options)


def megabytes():
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def interactive_seconds(view, frames, degrees):
    seconds = []
    for _ in range(frames):
        view.GetActiveCamera().Azimuth(degrees)
        start = time.perf_counter()
        view.SMProxy.InteractiveRender()
        seconds.append(time.perf_counter() - start)
    return seconds


def shown(source, size):
    """A view of that size. Its first picture is a small one, because it moves the camera."""
    view = pvtest.make_view([64, 36], [2.2, 1.4, 2.0], CENTER)
    simple.Show(source, view)
    simple.Render(view)
    view.ViewSize = size
    view.CameraPosition, view.CameraFocalPoint = [2.2, 1.4, 2.0], CENTER
    return view


def fluid():
    view = shown(simple.OpenDataFile(make("orbit.vdi", "--size", "48x48x48", "--resolution", "640x360")), SIZE)
    simple.Render(view)
    start = time.perf_counter()
    simple.Render(view)
    still = time.perf_counter() - start
    for what, degrees in (("0 to 90 degrees", 3), ("90 to 180 degrees", 3)):
        before = os.times()
        seconds = interactive_seconds(view, 30, degrees)
        after = os.times()
        used = (after.user + after.system - before.user - before.system) / len(seconds)
        print("orbit of 1280 x 720, {}: {:.1f} frames/s, the slowest in {:.0f} ms, {:.0f} ms of CPU time each; "
              "at rest {:.0f} ms".format(what, len(seconds) / sum(seconds), 1e3 * max(seconds), 1e3 * used, 1e3 * still))
        check(sum(seconds) / len(seconds) < max(0.2, still / 2), "frames are quick while the camera moves")
    sphere = simple.Show(simple.Sphere(Radius=0.2, Center=CENTER), view)
    seconds = interactive_seconds(view, 30, 3)
    print("with an object: {:.1f} frames/s".format(len(seconds) / sum(seconds)))
    sphere.Visibility = 0
    simple.Delete(view)


def recognisable():
    """Part of a fine structure, seen from the side, can be recognised at any frame rate."""
    reader = simple.OpenDataFile(make("orbit_coil.vdi", "--size", "64x64x64", "--resolution", "480x270", "--azimuth", "0",
                                      field="coil"))
    view = shown(reader, [640, 360])
    simple.GetDisplayProperties(reader, view).VDIFrameRate = 240
    view.CameraPosition = [1.5, 0.7, 0.5]
    interactive_seconds(view, 6, 0.1)  # brings the pixels down to the fewest allowed
    seconds = interactive_seconds(view, 6, 0.1)
    rough = pvtest.pixels(view.GetRenderWindow())
    whole = pvtest.screenshot(view, "orbit_coil.png", [640, 360])
    pvtest.write_png("orbit_coil_rough.png", rough)
    likeness = pvtest.ssim(rough, whole)
    print("zoomed in, from the side: {:.1f} frames/s, SSIM to the picture at rest {:.3f}".format(
        len(seconds) / sum(seconds), likeness))
    check(whole.std() > 10 and likeness > 0.9, "what moves can be recognised")
    simple.Delete(view)


def memory():
    files = [make("orbit_{}.vdi".format(step), "--size", "24x24x24", "--resolution", size)
             for step, size in enumerate(("64x48", "48x64", "56x56"))]
    reader = simple.OpenDataFile(files)
    view = shown(reader, [64, 48])

    def orbits(count):
        interactive_seconds(view, count, 7)

    def steps(count):
        for step in range(count):
            view.ViewTime = reader.TimestepValues[step % 3]
            simple.Render(view)

    for work, count, what in ((orbits, 150, "frames of an orbit"), (steps, 30, "time steps")):
        work(count // 3)
        before = megabytes()
        work(count)
        grown = megabytes() - before
        print("{} {}: {:+.1f} MB".format(count, what, grown))
        check(grown < 8, "{} leave nothing behind".format(what))


for part in sys.argv[1:]:
    {"fluid": fluid, "recognisable": recognisable, "memory": memory}[part]()
pvtest.finish()
