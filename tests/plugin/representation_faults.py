"""The representation VDI where there is nothing to show: a series whose steps differ and of which one is damaged and one
missing, an empty VDI, data that are no VDI. What is wrong is said in the view, and the next good frame is shown."""

import os
import shutil
import subprocess

import pvtest
from paraview import simple
from pvtest import check

SIZE = [480, 360]
FOLDER = os.path.join(pvtest.OUTPUT, "faults")
shutil.rmtree(FOLDER, ignore_errors=True)
os.makedirs(FOLDER)


def make(name, *options):
    path = os.path.join(FOLDER, name)
    subprocess.run([os.environ["VDI_TOOL"], "generate", "--field", "turbulence", "--size", "24x24x24",
                    "-o", path] + list(options), check=True, stdout=subprocess.DEVNULL)
    return path


def look(view, name):
    path = os.path.join(pvtest.OUTPUT, "faults_{}.png".format(name))
    simple.SaveScreenshot(path, view, ImageResolution=SIZE)
    return pvtest.read_png(path)


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
    check(picture[60:300].std() > 5, "step {} shows something".format(step))
    check((pvtest.message_in(view) == "") == good, "step {} shows {}".format(step, "no message" if good else "a message"))

# A file that is damaged between two renders: the VDI that has been read stays, until it's read again.
scene.AnimationTime = reader.TimestepValues[4]
before = look(view, "sound")
with open(steps[4], "r+b") as file:
    file.truncate(os.path.getsize(steps[4]) // 2)
view.GetActiveCamera().Azimuth(1)
simple.Render(view)
view.GetActiveCamera().Azimuth(-1)
check(pvtest.ssim(look(view, "damaged"), before) > 0.999 and not pvtest.message_in(view), "what has been read is still shown")
simple.ReloadFiles(reader)
look(view, "reloaded")
check(pvtest.message_in(view) != "", "and read again, the damaged file gets a message")
scene.AnimationTime = reader.TimestepValues[0]
check(look(view, "after").std() > 5 and not pvtest.message_in(view), "and the next step none")

# A view that is closed while a VDI is loaded for it, whose last frame showed the one before.
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
check(not pvtest.message_in(view), "what is hidden says nothing")
empty = simple.OpenDataFile(make("empty.vdi", "--resolution", "64x64", "--position", "9", "9", "9", "--focal-point", "10", "10",
                                 "10", "--view-up", "0", "1", "0"))
simple.Show(empty, view)
simple.Render(view)
check("shows nothing" in pvtest.message_in(view), "a VDI that is empty says so")
check(look(view, "empty").std() < 1, "and pictures that are taken show nothing")
simple.Render(view)
wavelet = simple.Wavelet()
check("VDI" not in simple.Show(wavelet, view).GetProperty("Representation").Available,
      "other data have ParaView's own representation, which a client without the plugin can make")
simple.Hide(wavelet, view)
picture = simple.VolumetricDepthImage(Input=wavelet, Resolution=[64, 48], PictureOnly=1)
simple.Show(picture, view)
simple.Render(view)
said = pvtest.message_in(view)
check("no VDI in this data set" in said and "shows nothing" in said, "what is no VDI gets a message, beside the other one's")
boxes = pvtest.message_boxes(view)
check(len(boxes) == 2 and (boxes[0][0] > boxes[1][1] or boxes[1][0] > boxes[0][1]), "and they don't overlap")
look(view, "no_vdi")
simple.Hide(empty, view)
simple.Hide(picture, view)
check(not pvtest.message_in(view), "what is hidden says nothing")

# Views that come and go, with more than one of them on a VDI.
scene.AnimationTime = reader.TimestepValues[0]
for _ in range(3):
    other = pvtest.make_view(SIZE, [2.2, 1.9, 2.4], [0.5, 0.5, 0.5])
    simple.Show(reader, other)
    check(look(other, "other").std() > 5, "a view that comes later shows the VDI")
    simple.Delete(other)
simple.Show(reader, view)
check(look(view, "again").std() > 5, "and the first one still does")
pvtest.finish()
