"""The representation VDI where there is nothing to show: a series whose steps differ, with one
damaged step and one missing; an empty VDI; and data that aren't a VDI. Also viewpoints that show
nothing of a VDI, or nothing true. The view reports the fault, and shows the next good frame."""

import os
import shutil

import pvtest
from paraview import simple
from pvtest import check
from vtkmodules.vtkCommonCore import vtkCollection

SIZE = [320, 240]
FOLDER = os.path.join(pvtest.OUTPUT, "faults")
shutil.rmtree(FOLDER, ignore_errors=True)
os.makedirs(FOLDER)


def make(name, *options):
    return pvtest.make_vdi(os.path.join(FOLDER, name), "--field", "turbulence", "--size", "24x24x24", *options)


def look(view, name):
    return pvtest.screenshot(view, "faults_{}.png".format(name), SIZE)


steps = [make("step_0.vdi", "--resolution", "200x150"), make("step_1.vdi", "--resolution", "120x160", "--azimuth", "80"),
         make("step_2.vdi", "--resolution", "200x150"), make("step_3.vdi", "--resolution", "200x150", "--parallel"),
         make("step_4.vdi", "--resolution", "160x160")]
with open(steps[2], "r+b") as file:
    file.seek(os.path.getsize(steps[2]) // 2)
    byte = file.read(1)
    file.seek(-1, os.SEEK_CUR)
    file.write(bytes([byte[0] ^ 0xff]))
reader = simple.OpenDataFile(steps)
view = pvtest.make_view(SIZE, [2.2, 1.9, 2.4], [0.5, 0.5, 0.5])
simple.Show(reader, view)
simple.Render(view)
scene = simple.GetAnimationScene()
scene.UpdateAnimationUsingDataTimeSteps()
os.remove(steps[3])
for step, good in enumerate([True, True, False, False, True]):
    scene.AnimationTime = reader.TimestepValues[step]
    picture = look(view, "step_{}".format(step))
    check(picture[40:200].std() > 5, "step {} shows something".format(step))
    check((pvtest.message_in(view) == "") == good, "step {} shows {}".format(step, "no message" if good else "a message"))

# A file that is damaged between two renders: the VDI that has been read stays, until it's read again.
scene.AnimationTime = reader.TimestepValues[4]
before = look(view, "sound")
with open(steps[4], "r+b") as file:
    file.truncate(os.path.getsize(steps[4]) // 2)
view.GetActiveCamera().Azimuth(1)
simple.Render(view)
view.GetActiveCamera().Azimuth(-1)
check(pvtest.ssim(look(view, "damaged"), before) > 0.999 and not pvtest.message_in(view),
      "a VDI that was read before its file was damaged is still shown")
simple.ReloadFiles(reader)
look(view, "reloaded")
check(pvtest.message_in(view) != "", "when it is read again, the damaged file gets a message")
scene.AnimationTime = reader.TimestepValues[0]
check(look(view, "after").std() > 5 and not pvtest.message_in(view),
      "the step after the damaged file is shown, without a message")

# Closes a view that still shows the previous VDI while the next one is loaded for it.
for _ in range(3):
    other = pvtest.make_view(SIZE, [2.2, 1.9, 2.4], [0.5, 0.5, 0.5])
    simple.Show(reader, other)
    simple.Render(other)
    other.ViewTime = reader.TimestepValues[1]
    other.SMProxy.Update()
    other.SMProxy.InteractiveRender()
    simple.Delete(other)
check(look(view, "closed").std() > 5, "a view that is closed while a VDI is loaded leaves the other one as it is")

simple.Hide(reader, view)
check(not pvtest.message_in(view), "a hidden VDI has no message")
empty = simple.OpenDataFile(make("empty.vdi", "--resolution", "64x64", "--position", "9", "9", "9", "--focal-point", "10", "10",
                                 "10", "--view-up", "0", "1", "0"))
simple.Show(empty, view)
simple.Render(view)
check("shows nothing" in pvtest.message_in(view), "a VDI that is empty says so")
check(look(view, "empty").std() < 1, "screenshots of a VDI that is empty show nothing")
simple.Render(view)
wavelet = simple.Wavelet()
check("VDI" not in simple.Show(wavelet, view).GetProperty("Representation").Available,
      "other data have ParaView's own representation, which a client without the plugin can make")
simple.Hide(wavelet, view)
picture = simple.VolumetricDepthImage(Input=wavelet, Resolution=[64, 48], PictureOnly=1)
simple.Show(picture, view)
simple.Render(view)
said = pvtest.message_in(view)
check("This data set has no VDI" in said and "shows nothing" in said,
      "a picture without a VDI gets a message in addition to the empty VDI's")
boxes = pvtest.text_boxes(view)
check(len(boxes) == 2 and (boxes[0][0] > boxes[1][1] or boxes[1][0] > boxes[0][1]), "the two messages don't overlap")
look(view, "no_vdi")
simple.Hide(empty, view)
simple.Hide(picture, view)
check(not pvtest.message_in(view), "hidden data have no messages")

# Viewpoints.
scene.AnimationTime = reader.TimestepValues[0]
simple.Show(reader, view)


def said_from(position, focal_point=(0.5, 0.5, 0.5), scale=None, render=simple.Render):
    view.CameraPosition, view.CameraFocalPoint = list(position), list(focal_point)
    view.CameraParallelProjection, view.CameraParallelScale = int(scale is not None), scale or 1
    render(view)
    return pvtest.message_in(view)


AWAY, OUT, SMALL = [4, 4, 4], "out of sight: press Reset Camera", "too small to be seen"
for scale in (None, 1):
    kind = ", in parallel projection" if scale else ""
    for position in ([2.2, 1.9, 2.4], [-1.2, -0.9, -1.4], [0.5, 0.5, 3], [3, 0.5, 0.5]):
        check(said_from(position, scale=scale) == "", "nothing is said from {}{}".format(position, kind))
    check(OUT in said_from([2.2, 1.9, 2.4], AWAY, scale), "a view that looks away says so" + kind)
    check(OUT in said_from([2.2, 9, 2.4], [0.5, 9, 0.5], scale), "a view that looks past the VDI says so" + kind)
    check(said_from([2.2, 1.9, 2.4], scale=scale) == "", "a view that looks at the VDI again has no message" + kind)
    check(said_from([0.7, 0.5, 0.4], scale=scale) == "From inside, this VDI is rough: press Reset Camera.",
          "a view from inside says so" + kind)
    low, high = pvtest.text_boxes(view)[0]
    check(0.75 * SIZE[1] < low < high < SIZE[1],
          "the message is at the view's upper edge, in rows {:g} to {:g}{}".format(low, high, kind))
check(SMALL in said_from([2000, 2000, 2000]), "a view from too far away says so")
check(SMALL in said_from([3, 3, 3], scale=1000), "a view of a wide parallel scale says so")
check(OUT in said_from([2.2, 1.9, 2.4], AWAY, render=lambda _: view.SMProxy.InteractiveRender()),
      "interactive frames say that the VDI is out of sight")
check(look(view, "away").std() < 1, "screenshots don't say that the VDI is out of sight")
ball = simple.Sphere(Center=AWAY)
simple.Show(ball, view)
check(said_from([2.2, 1.9, 2.4], AWAY) == "", "nothing is said where another object is seen")
ball.Center, ball.Radius = [1.35, 1.2, 1.45], 0.6
check(said_from([2.2, 1.9, 2.4]) == "", "nothing is said where another object hides the VDI")
behind = look(view, "behind")
simple.Hide(reader, view)
check((look(view, "nothing_behind") == behind).all(), "the object does hide the VDI")
simple.Show(reader, view)
check(OUT in said_from([2.2, 1.9, 2.4], AWAY), "there is a message where neither the VDI nor the object is seen")
simple.Delete(ball)
plane = simple.Plane()
simple.Show(plane, view)
check(OUT in said_from([2.2, 1.9, 2.4], AWAY), "there is a message where neither the VDI nor a flat object is seen")
check(said_from([0, 0, -3], [0, 0, -1]) == "" and said_from([-0.4, -0.4, -0.5], [-0.5, -0.5, 0]) == "",
      "nothing is said where the flat object is seen")
simple.Delete(plane)
picture.PictureOnly = 0
picture.CameraPosition, picture.CameraFocalPoint = [40, 30, 50], [0, 0, 0]
simple.Show(picture, view)
check(said_from([2.2, 1.9, 2.4]) == "From inside, this VDI is rough: press Regenerate From This View.",
      "the filter's VDI tells of its button, in addition to another one's message")
check(said_from([2, -1, 20], [40, -1, 20]).count("VDI") == 1, "a message that two VDIs share is shown once")
display = simple.GetDisplayProperties(reader, view)
display.Opacity = 0
check(said_from([2, -1, 20], [40, -1, 20]).count("VDI") == 1,
      "where one of two VDIs is transparent, the other one's message is said once")
display.Opacity = 1
check(said_from([40, 30, 50], [0, 0, 0]) == "", "nothing is said where one of two VDIs is seen")
picture.CameraPosition, picture.CameraFocalPoint = [2.2, 1.9, 2.4], [0.5, 0.5, 0.5]
check(said_from([2.2, 1.9, 2.4]) == "", "a VDI that was made inside is true from there")
picture.CameraPosition, picture.CameraFocalPoint, picture.CameraViewAngle = [0, 0, 60], [-6, 0, 0], 6
simple.Hide(reader, view)
check(said_from([0, 0, 60], [0, 0, 0]) == "", "nothing is said where a part of the scene is seen")
view.CameraViewAngle = 6
check(OUT in said_from([0, 0, 60], [6, 0, 0]), "there is a message where the VDI lacks the part of the scene in sight")
comparative = simple.CreateView("ComparativeRenderView")
simple.Show(reader, comparative)
simple.Render(comparative)
comparative.CameraPosition, comparative.CameraFocalPoint = [2.2, 1.9, 2.4], AWAY
simple.Render(comparative)
views = vtkCollection()
comparative.SMProxy.GetViews(views)
said = [pvtest.message_in(views.GetItemAsObject(index)) for index in range(views.GetNumberOfItems())]
check(len(said) > 1 and all(OUT in each for each in said), "each of comparative views says that the VDI is out of sight")
simple.Delete(comparative)
simple.Hide(picture, view)
view.CameraViewAngle = 30
said_from([2.2, 1.9, 2.4])

# Views that come and go, with more than one of them on a VDI.
scene.AnimationTime = reader.TimestepValues[0]
for _ in range(3):
    other = pvtest.make_view(SIZE, [2.2, 1.9, 2.4], [0.5, 0.5, 0.5])
    simple.Show(reader, other)
    check(look(other, "other").std() > 5, "a view that comes later shows the VDI")
    simple.Delete(other)
simple.Show(reader, view)
check(look(view, "again").std() > 5, "the first view still shows the VDI after the others are closed")
with pvtest.Messages("ErrorEvent") as errors:
    said = said_from([2.2, 1.9, 2.4], AWAY)
check(OUT in said and not errors, "a message after other views have closed is drawn without an error")
pvtest.finish()
