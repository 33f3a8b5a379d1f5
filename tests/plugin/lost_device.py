"""A Vulkan device that is lost while a VDI is orbited (lose_device.c): a new one takes its place, and the frame shows the VDI.
If the new device is lost, too, a message appears until there is something new to show."""

import os

import pvtest
from paraview import simple
from pvtest import check

SIZE, CENTER = [320, 240], [0.5, 0.5, 0.5]
LOSE = os.environ["VDI_TEST_LOSE_DEVICE"]


def make(seed):
    return pvtest.make_vdi("lost_{}.vdi".format(seed), "--field", "turbulence", "--size", "24x24x24", "--resolution", "200x150",
                           "--seed", str(seed))


def look(view):
    return pvtest.screenshot(view, "lost_device.png", SIZE)


def orbit(view, frames=5):
    for _ in range(frames):
        view.GetActiveCamera().Azimuth(3)
        view.SMProxy.InteractiveRender()


if os.path.isdir(LOSE):
    os.rmdir(LOSE)
reader = simple.OpenDataFile([make(seed) for seed in (1, 2)])
view = pvtest.make_view(SIZE, [2.2, 1.9, 2.4], CENTER)
simple.Show(reader, view)
simple.Render(view)
before = look(view)
check(before.std() > 20, "the VDI is shown")

camera = list(view.CameraPosition)
view.CameraPosition = [2.2, 1.9, 2.5]
beside = look(view)
view.CameraPosition = camera
look(view)
open(LOSE, "w").close()
same = look(view)
check(os.path.exists(LOSE) and pvtest.ssim(before, same) == 1.0, "a frame like the previous one doesn't use the device")
view.CameraPosition = [2.2, 1.9, 2.5]
after = look(view)
check(not os.path.exists(LOSE), "a device is lost in a frame at rest")
check(pvtest.ssim(beside, after) > 0.999 and not pvtest.message_in(view),
      "the frame that loses the device shows the VDI, on a new one")
view.CameraPosition = camera
orbit(view)
open(LOSE, "w").close()
orbit(view)
check(not os.path.exists(LOSE) and not pvtest.message_in(view), "a device is lost while orbiting, and there is no message")
view.CameraPosition, view.CameraFocalPoint, view.CameraViewUp = camera, CENTER, [0, 1, 0]
check(pvtest.ssim(before, look(view)) > 0.999, "the VDI is still shown after a device was lost while orbiting")

open(LOSE, "w").close()
view.ViewTime = reader.TimestepValues[1]
simple.Render(view)
view.ViewTime = reader.TimestepValues[0]
check(pvtest.ssim(before, look(view)) > 0.999, "a device that is lost while a time step is loaded doesn't lose the step")

os.mkdir(LOSE)
view.ViewTime = reader.TimestepValues[1]
simple.Render(view)
orbit(view)
check("lost" in pvtest.message_in(view).lower(), "where every device is lost, the view says so")
check(look(view).std() > 5, "where every device is lost, screenshots show the message")
os.rmdir(LOSE)
view.ViewTime = reader.TimestepValues[0]
view.CameraPosition, view.CameraFocalPoint, view.CameraViewUp = camera, CENTER, [0, 1, 0]
check(pvtest.ssim(before, look(view)) > 0.999 and not pvtest.message_in(view), "the next time step is shown on a new device")

# A filter that makes VDIs in the same process.
simple.Hide(reader, view)
wavelet = simple.Wavelet(WholeExtent=[-7, 8] * 3)
wavelet.UpdatePipeline()
pvtest.set_colors("RTData", 37, 277)
image = pvtest.vdi_filter(wavelet, view, "POINTS", "RTData", 3, CameraPosition=[30, 30, 40], CameraFocalPoint=[0, 0, 0])
simple.Show(image, view)
view.CameraPosition, view.CameraFocalPoint, view.CameraViewUp = [30, 30, 40], [0, 0, 0], [0, 1, 0]
made = look(view)
view.CameraPosition = [30, 31, 40]
open(LOSE, "w").close()
look(view)
view.CameraPosition = [30, 30, 40]
again = look(view)
check(made.std() > 20 and pvtest.ssim(made, again) > 0.999, "the output of a filter is shown again on a new device")
# A device that is lost while the filter makes VDIs.
open(LOSE, "w").close()
image.SamplingRate = 1.5
finer = look(view)
check(not os.path.exists(LOSE) and not pvtest.message_in(view), "a device that is lost in a filter leaves no message")
check(pvtest.ssim(made, finer) > 0.95, "the filter's next VDI after a lost device is shown, made on a new one")
pvtest.finish()
