"""The representation VDI on several ranks against one: a VDI of scattered blocks with an object in it, and an animation of
a series of files. `write` makes the pictures of one rank, `compare` those of several."""

import os
import sys

import pvtest
from paraview import simple
from pvtest import check

SIZE, CAMERA, CENTER = [320, 240], [2.2, 1.9, 2.4], [0.5, 0.5, 0.5]
MODE = sys.argv[1]


def path(name, mode):
    return os.path.join(pvtest.OUTPUT, "ranks_{}_{}.png".format(name, mode))


def done(name):
    if MODE == "write":
        check(pvtest.read_png(path(name, "write")).std() > 20, name + " shows something")
        return
    seen, expected = (pvtest.read_png(path(name, mode)) for mode in ("compare", "write"))
    likeness, wrong = pvtest.ssim(seen, expected), pvtest.wrong_share(seen, expected)
    print("{} on several ranks against one: SSIM {:.4f}, {:.2%} of its pixels off by more than 16".format(
        name, likeness, wrong))
    check(likeness > 0.99 and wrong < 0.01, name + " is as on one rank")


view = pvtest.make_view(SIZE, CAMERA, CENTER)
view.Background = [0.1, 0.3, 0.2]
source = pvtest.blocks_source("interleaved")
pvtest.set_colors("scalars", 0, 1)
image = pvtest.vdi_filter(source, view, "POINTS", "scalars", 0.05)
simple.Show(image, view)
simple.Render(view)
view.CameraPosition, view.CameraFocalPoint = [2.7, 1.4, 1.9], CENTER
simple.SaveScreenshot(path("alone", MODE), view, ImageResolution=SIZE)
done("alone")
sphere = simple.Sphere(Radius=0.3, Center=[0.7, 0.5, 0.8], ThetaResolution=64, PhiResolution=64)
simple.Show(sphere, view)
simple.SaveScreenshot(path("with an object", MODE), view, ImageResolution=SIZE)
done("with an object")

if MODE == "compare":
    volume = simple.Show(source, view)
    volume.SetRepresentationType("Volume")
    simple.Render(view)
    check("beside a volume" in pvtest.message_in(view), "beside a volume on several ranks there is a message")
    simple.Hide(source, view)
    simple.Render(view)
    check(pvtest.message_in(view) == "", "without the volume there is no message")

files = [os.path.join(pvtest.OUTPUT, "ranks_{}.vdi".format(step)) for step in range(3)]
if MODE == "write":
    for step, file in enumerate(files):
        image.CameraPosition, image.Resolution = [2.2, 1.9 + step, 2.4], [320 - 70 * step, 240]
        simple.SaveData(file, proxy=image)
simple.Hide(image, view)
reader = simple.OpenDataFile(files)
simple.Show(reader, view)
scene = simple.GetAnimationScene()
scene.UpdateAnimationUsingDataTimeSteps()
simple.SaveAnimation(os.path.join(pvtest.OUTPUT, "ranks_frame_{}.png".format(MODE)), view, ImageResolution=SIZE)
for step in range(3):
    name = "frame {}".format(step)
    os.replace(os.path.join(pvtest.OUTPUT, "ranks_frame_{}.{:04d}.png".format(MODE, step)), path(name, MODE))
    done(name)
pvtest.finish()
