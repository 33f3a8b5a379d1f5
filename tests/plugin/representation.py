"""The representation VDI: compared with the representation Volume at the VDI's viewpoint, alone and
with an opaque object in it; compared with `vdi render` for other cameras; and shown by Show
alone."""

import os
import subprocess

import numpy as np
import pvtest
from paraview import simple
from pvtest import check
from vtkmodules.vtkRenderingCore import VTK_STEREO_RIGHT

SIZE, CAMERA, CENTER = [200, 150], [80, 56, 92], [0, 0, 0]
VDI = os.path.join(pvtest.OUTPUT, "representation.vdi")


def screenshot(view, name, camera=None):
    simple.Render(view)  # the first picture of a view moves its camera
    if camera is not None:
        view.CameraPosition, view.CameraFocalPoint, view.CameraViewUp = camera, CENTER, [0, 1, 0]
    return pvtest.screenshot(view, "representation_{}.png".format(name), SIZE)


def rendered(view, name):
    """The tool's picture of the VDI for the view's camera."""
    path = os.path.join(pvtest.OUTPUT, "representation_{}_expected.png".format(name))
    command = [os.environ["VDI_TOOL"], "render", VDI, "-o", path, "--resolution", "{}x{}".format(*SIZE)]
    for option, values in (("position", view.CameraPosition), ("focal-point", view.CameraFocalPoint),
                           ("view-up", view.CameraViewUp)):
        command += ["--" + option] + [repr(value) for value in values]
    command += (["--parallel-scale", repr(view.CameraParallelScale)] if view.CameraParallelProjection
                else ["--view-angle", repr(view.CameraViewAngle)])
    subprocess.run(command, check=True)
    return pvtest.read_png(path)


def compare(seen, expected, least, what):
    likeness = pvtest.ssim(seen, expected)
    print("{}: SSIM {:.4f}".format(what, likeness))
    check(expected.std() > 20 and likeness >= least, what)


def volume_beside_vdi():
    wavelet = simple.Wavelet(WholeExtent=[-31, 32] * 3)
    wavelet.UpdatePipeline()
    pvtest.set_colors("RTData", 37, 277)
    view = pvtest.make_view(SIZE, CAMERA, CENTER)
    sphere = simple.Sphere(Radius=14, Center=[10, 0, 14], ThetaResolution=64, PhiResolution=64)
    plane = simple.Plane(Origin=[-30, -30, -5], Point1=[30, -30, 5], Point2=[-30, 30, 5])
    volume = simple.Show(wavelet, view)
    volume.SetRepresentationType("Volume")
    simple.ColorBy(volume, ("POINTS", "RTData"))
    volume.ScalarOpacityUnitDistance, volume.Shade = 3, 0
    simple.HideScalarBarIfNotNeeded(simple.GetColorTransferFunction("RTData"), view)
    image = pvtest.vdi_filter(wavelet, view, "POINTS", "RTData", 3)
    pictures = {}
    for shown in ("volume", "vdi"):
        if shown == "vdi":
            simple.Hide(wavelet, view)
            display = simple.Show(image, view)
            check(display.Representation == "VDI", "Show alone shows the filter's output as a VDI")
            check(list(display.ColorArrayName) == ["FIELD", "RTData"] and display.LookupTable == image.LookupTable,
                  "the filter's output has the legend of its array")
        pictures[shown, "alone"] = screenshot(view, shown + "_alone", CAMERA)
        if shown == "vdi":
            display.Opacity = 0.5
            half = screenshot(view, "half", CAMERA)
            off = np.abs(2 * half.astype(int) - pictures[shown, "alone"])
            check(off.max() <= 2, "Opacity 0.5 shows the VDI half as opaque")
            display.Opacity = 1
        for thing, what in ((sphere, "sphere"), (plane, "plane")):
            simple.Show(thing, view)
            pictures[shown, what] = screenshot(view, "{}_{}".format(shown, what), CAMERA)
            simple.Hide(thing, view)
    compare(pictures["vdi", "alone"], pictures["volume", "alone"], 0.99, "a VDI from its viewpoint, as Volume")
    for what in ("sphere", "plane"):
        compare(pictures["vdi", what], pictures["volume", what], 0.99, "with a {} in it, as Volume".format(what))
        check(pvtest.ssim(pictures["vdi", what], pictures["vdi", "alone"]) < 0.97, "the {} in the VDI is seen".format(what))
    simple.SaveData(VDI, proxy=image)
    simple.Delete(view)


def elsewhere():
    reader = simple.OpenDataFile(VDI)
    view = pvtest.make_view(SIZE, CAMERA, CENTER)
    display = simple.Show(reader, view)
    check(display.Representation == "VDI", "Show alone shows an opened file as a VDI")
    bounds = reader.GetDataInformation().GetBounds()
    check(np.allclose(bounds, (-31, 32) * 3), "an opened file has its scene's bounds")
    simple.Render(view)
    for camera in ([80, 56, 92], [-60, 30, 110], [0, -130, 20]):
        seen = screenshot(view, "from", camera)
        compare(seen, rendered(view, "from"), 0.995, "from {}, as the tool renders it".format(camera))
    simple.Render(view)
    check(display.VDIAngle == 1 and pvtest.angle_in(view) == "", "pvbatch, which has no windows, says no angle")
    view.CameraParallelProjection, view.CameraParallelScale = 1, 40
    compare(screenshot(view, "parallel", [-60, 30, 110]), rendered(view, "parallel"), 0.995, "in parallel projection")
    view.CameraParallelProjection = 0
    # A larger picture than the window is made of tiles, each with a part of the image plane.
    large = pvtest.screenshot(view, "representation_large.png", [2 * SIZE[0], 2 * SIZE[1]]).astype(float)
    small = large.reshape(SIZE[1], 2, SIZE[0], 2, 3).mean(axis=(1, 3)).astype(np.uint8)
    compare(small, screenshot(view, "small"), 0.98, "a picture larger than the window")
    # A translucent object is drawn by peeling. It doesn't change a VDI beside it.
    sphere = simple.Sphere(Radius=6, Center=[0, -120, 0], PhiResolution=32, ThetaResolution=32)
    translucent = simple.Show(sphere, view)
    translucent.Opacity, translucent.DiffuseColor = 0.5, [0, 0, 1]
    view.CameraParallelScale = 130
    view.CameraParallelProjection = 1
    beside = screenshot(view, "translucent")
    simple.Hide(sphere, view)
    without = screenshot(view, "without_translucent")
    different = np.abs(beside.astype(int) - without).max(axis=2) > 2
    share = different.mean()
    print("a translucent sphere beside a VDI: {:.2%} of the pixels differ".format(share))
    check(0 < share < 0.01 and without.std() > 5, "a translucent object beside a VDI changes nothing of it")
    view.CameraParallelProjection = 0
    view.Background = [0.2, 0.5, 0.3]
    check(np.allclose(screenshot(view, "background")[2, 2], [51, 128, 77], atol=1), "the background is the view's")
    simple.Delete(view)


def ball(centre, radius):
    """A volume that is opaque only inside a ball."""
    z, y, x = np.meshgrid(*[np.arange(64.0) - 31] * 3, indexing="ij")
    distance = np.sqrt((x - centre[0]) ** 2 + (y - centre[1]) ** 2 + (z - centre[2]) ** 2)
    return pvtest.source_of_values(np.clip(radius - distance, -0.5, 0.5), "inside", origin=[-31, -31, -31])[0]


def column_of(picture):
    """The mean column of the bright pixels."""
    columns = (picture.max(axis=2) > 60).sum(axis=0)
    return float((columns * np.arange(len(columns))).sum() / columns.sum())


def window_column(view, source):
    """The column of the source in the window itself: screenshots of ParaView have no stereo."""
    simple.Show(source, view)
    simple.Render(view)  # the first picture of a view moves its camera
    view.CameraPosition, view.CameraFocalPoint, view.CameraViewUp = CAMERA, CENTER, [0, 1, 0]
    for _ in range(2):  # the window learns late which eye it is
        simple.Render(view)
    seen = pvtest.pixels(view.GetRenderWindow(), front=0)
    simple.Hide(source, view)
    return column_of(seen)


def stereo():
    """The right eye sees a ball of the VDI where it sees the same one as a surface, before and behind the focal point."""
    view = pvtest.make_view([320, 240], CAMERA, CENTER)
    pvtest.set_colors("inside", -0.5, 0.5)
    columns = {}
    for centre in ((14, 10, 18), (-14, -8, -20)):
        surface = simple.Sphere(Radius=7, Center=centre, ThetaResolution=48, PhiResolution=48)
        image = pvtest.vdi_filter(ball(centre, 7), view, "POINTS", "inside", 1)
        columns[centre] = [surface, image, window_column(view, surface)]
    own = view.GetClientSideObject()
    view.GetRenderWindow().SetSwapBuffers(0)
    own.SetStereoRender(True)
    own.SetStereoType(VTK_STEREO_RIGHT)
    for centre, (surface, image, alone) in columns.items():
        window_column(view, surface)
        seen, expected = window_column(view, image), window_column(view, surface)
        print("a ball at {}: column {:.2f} for the right eye, {:.2f} as a surface, {:.2f} without stereo".format(
            centre, seen, expected, alone))
        check(abs(expected - alone) > 1 and abs(seen - expected) < 0.7, "the right eye sees the VDI in its place")


volume_beside_vdi()
elsewhere()
stereo()
pvtest.finish()
