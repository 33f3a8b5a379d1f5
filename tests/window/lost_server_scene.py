"""Runs inside the real ParaView (--script): connects to the server at VDI_TEST_PORT, shows a VDI of a wavelet, and says
"ready". From then on it answers what lost_server.py asks of it."""

import os
import sys
import traceback

from paraview import simple

sys.path.insert(0, os.path.join(os.path.dirname(os.environ["VDI_TEST_SOURCE"]), "window"))
from inside import answer, leave  # noqa: E402


def show_vdi():
    simple.Connect("127.0.0.1", int(os.environ["VDI_TEST_PORT"]))
    for remote in (False, True):
        simple.LoadPlugin(os.environ["VDI_PLUGIN"], remote=remote, ns=globals())
    view = simple.GetActiveViewOrCreate("RenderView")
    wavelet = simple.Wavelet(registrationName="Wavelet", WholeExtent=[-20, 20] * 3)
    simple.Show(wavelet, view).SetRepresentationType("Outline")
    view.ResetCamera()
    image = VolumetricDepthImage(registrationName="Image", Input=wavelet)  # noqa: F821
    simple.SetActiveSource(image)
    simple.Show(image, view).SetRepresentationType("VDI")
    simple.Render(view)
    return view, image


def make_slow():
    """From now on a VDI takes seconds."""
    image.SamplingRate = 20


def edit():
    """Edits the colours. The window makes the VDI anew in the background."""
    make_slow()
    image.LookupTable.RGBPoints = [37, 0.9, 0.1, 0.1, 157, 0.9, 0.9, 0.2, 277, 0.1, 0.2, 0.9]


def update():
    """Makes the VDI anew in one update, which shows its progress."""
    make_slow()
    image.UpdatePipeline()


def save():
    make_slow()
    simple.SaveData(os.path.join(os.environ["VDI_TEST_OUTPUT"], "saved.vdi"), proxy=image)


def delete():
    """Deletes the filter while its VDI is made in the background."""
    edit()
    simple.Delete(image)


def play():
    """Turns the camera about the volume."""
    scene = simple.GetAnimationScene()
    scene.NumberOfFrames = 1000
    cue = simple.GetCameraTrack(view=view)
    cue.Mode = "Path-based"
    frames = []
    for time, position in ((0, [0, 0, 150]), (0.5, [150, 0, 0]), (1, [0, 0, -150])):
        frame = simple.CameraKeyFrame()
        frame.KeyTime, frame.Position, frame.FocalPoint = time, position, [0, 0, 0]
        frames.append(frame)
    cue.KeyFrames = frames
    scene.Play()


def receive(url):
    """Shows a stream, beside the VDI."""
    stream = VDIStream(registrationName="Stream", URL=url)  # noqa: F821
    simple.Show(stream, view).SetRepresentationType("VDI")
    simple.Render(view)


def follow():
    """The window regenerates the VDI for another camera by itself."""
    make_slow()
    image.Auto = 1
    view.CameraPosition = [150, 40, 60]
    simple.Render(view)


try:
    view, image = show_vdi()
    answer(view.GetInteractor(), globals())
    leave("ready", "ok")
except Exception:
    leave("ready", traceback.format_exc())
