"""pvpython as the client of a pvserver on two ranks: a VDI that is made or read there is drawn here, and orbiting it sends
nothing. relay.py counts the bytes that go over the socket. The argument "all" adds another order of what is shown."""

import os
import subprocess
import sys

import pvtest
import server
from paraview import simple
from pvtest import check

SIZE, CAMERA, CENTER = [320, 240], [2.2, 1.9, 2.4], [0.5, 0.5, 0.5]
LOG = os.path.join(pvtest.OUTPUT, "client_server.log")


class Session:
    """A server that has connected to this client, by way of a relay."""

    def __enter__(self):
        here = os.path.dirname(os.path.abspath(__file__))
        port = server.free_port()
        self.relay = subprocess.Popen(["python3", os.path.join(here, "relay.py"), port], stdin=subprocess.PIPE,
                                      stdout=subprocess.PIPE, text=True)
        relayed = self.relay.stdout.readline().strip()
        with open(LOG, "w") as log:
            self.server = server.start_reverse(relayed, ranks=2, stdout=log, stderr=log)
            os.dup2(log.fileno(), 2)  # this process's output, too
        simple.ReverseConnect(port)
        simple.LoadPlugin(os.environ["VDI_PLUGIN"], remote=True, ns=simple.__dict__)
        return self

    def __exit__(self, *_):
        simple.Disconnect()
        try:
            self.server.wait(5)  # mpirun doesn't always see that its ranks have ended
        except subprocess.TimeoutExpired:
            server.end(self.server)
        self.relay.kill()

    def bytes(self):
        self.relay.stdin.write("\n")
        self.relay.stdin.flush()
        return int(self.relay.stdout.readline())


def show(make_source, name):
    """A view of a VDI with a sphere in it, from beside its viewpoint."""
    view = pvtest.make_view(SIZE, CAMERA, CENTER)
    simple.Show(make_source(view), view)
    sphere = simple.Sphere(Radius=0.3, Center=[0.7, 0.5, 0.8], ThetaResolution=64, PhiResolution=64)
    simple.Show(sphere, view)
    simple.Render(view)
    view.CameraPosition, view.CameraFocalPoint = [2.7, 1.4, 1.9], CENTER
    simple.Render(view)
    return view, pvtest.screenshot(view, name, SIZE)


def generated(view):
    source = pvtest.blocks_source("interleaved")
    pvtest.set_colors("scalars", 0, 1)
    return pvtest.vdi_filter(source, view, "POINTS", "scalars", 0.05)


def orbit(view):
    for _ in range(10):
        view.GetActiveCamera().Azimuth(3)
        view.SMProxy.InteractiveRender()
    view.SMProxy.StillRender()


def bytes_of_orbit(session, view):
    """The bytes that an orbit sends. The same orbit has been shown once before."""
    camera = list(view.CameraPosition), list(view.CameraFocalPoint), list(view.CameraViewUp)
    orbit(view)
    view.CameraPosition, view.CameraFocalPoint, view.CameraViewUp = camera
    view.UpdateVTKObjects()
    before = session.bytes()
    orbit(view)
    return session.bytes() - before


path = os.path.join(pvtest.OUTPUT, "client_server.vdi")
view, expected = show(generated, "client_server_alone.png")
simple.SaveData(path, proxy=view.Representations[0].Input)
orbit(view)
turned = pvtest.screenshot(view, "client_server_alone_turned.png", SIZE)
check(expected.std() > 20 and pvtest.ssim(expected, turned) < 0.95, "the picture shows something, and orbiting changes it")

with Session() as session:
    for make, what in ((generated, "made"), (lambda view: simple.OpenDataFile(path), "read")):
        before = session.bytes()
        view, seen = show(make, "client_server_{}.png".format(what))
        sent, size = session.bytes() - before, os.path.getsize(path)
        print("showing a VDI {} on the server sends {} bytes; its file has {}".format(what, sent, size))
        check(sent < 1.4 * size, "a VDI crosses once, as its file")
        likeness = pvtest.ssim(seen, expected)
        print("a VDI {} on the server: SSIM {:.4f} to the same without a server".format(what, likeness))
        check(likeness > 0.99, "a VDI that is {} on the server is shown as without one".format(what))
        shown = bytes_of_orbit(session, view)
        check(pvtest.ssim(pvtest.screenshot(view, "client_server_turned.png", SIZE), turned) > 0.99, "orbiting turns the VDI")
        place = list(view.CameraPosition)
        view.CameraPosition = [0.6, 0.5, 0.4]
        simple.Render(view)
        said, help_said = pvtest.message_in(view), "Regenerate From This View" if what == "made" else "Reset Camera"
        check(said == "From inside, this VDI is rough: press {}.".format(help_said),
              "from inside, the view says which button helps")
        view.CameraPosition = place
        simple.Render(view)
        check(pvtest.message_in(view) == "", "from outside, the view shows no message")
        simple.Hide(view.Representations[0].Input, view)
        simple.Render(view)
        hidden = bytes_of_orbit(session, view)
        print("an orbit sends {} bytes, {} with the VDI hidden: ParaView's own words about each frame".format(shown, hidden))
        check(shown == hidden and shown < 5000, "orbiting sends nothing of the VDI or of pictures")

    # A volume is drawn on the server's ranks: the view says why the VDI isn't, and shows it when the volume is gone.
    view = pvtest.make_view(SIZE, CAMERA, CENTER)
    image = generated(view)
    simple.Show(image, view)
    simple.Render(view)
    view.CameraPosition, view.CameraFocalPoint = CAMERA, CENTER
    alone = pvtest.screenshot(view, "client_server_no_volume.png", SIZE)
    simple.Hide(image, view)
    for order in ("VDI first",) if sys.argv[1:] != ["all"] else ("VDI first", "volume first"):
        view = pvtest.make_view(SIZE, CAMERA, CENTER)
        for what in order.split()[0], "both":
            if what in ("volume", "both"):
                simple.Show(image.Input, view).SetRepresentationType("Volume")
            if what in ("VDI", "both"):
                simple.Show(image, view)
            simple.Render(view)
            view.CameraPosition, view.CameraFocalPoint = CAMERA, CENTER
        picture = pvtest.screenshot(view, "client_server_{}.png".format(order.replace(" ", "_")), SIZE)
        check("beside a volume" in pvtest.message_in(view), order + ": beside a volume of the server there is a message")
        simple.Hide(image, view)
        volume = pvtest.screenshot(view, "client_server_volume.png", SIZE)
        top = slice(SIZE[1] // 3)  # beside the message
        check(volume.std() > 20 and pvtest.ssim(picture[top], volume[top]) > 0.95, order + ": the volume is seen")
        simple.Show(image, view)
        simple.Hide(image.Input, view)
        picture = pvtest.screenshot(view, "client_server_volume_hidden.png", SIZE)
        check(pvtest.message_in(view) == "" and pvtest.ssim(picture, alone) > 0.99,
              order + ": without the volume, the VDI is seen again")

    # The server can't make a VDI of this blend mode.
    image.BlendMode = "Maximum Intensity"
    simple.Render(view)
    check("its filter or reader has failed" in pvtest.message_in(view), "the view says that the server has failed")
    image.BlendMode = "Composite"
    simple.Render(view)
    picture = pvtest.screenshot(view, "client_server_again.png", SIZE)
    check(pvtest.message_in(view) == "" and pvtest.ssim(picture, alone) > 0.99,
          "after the server has failed, its next VDI is shown")

with open(LOG) as log:
    said = log.read()
print(said)
check("Conflicting" not in said, "nobody warns of requests that conflict")

pvtest.finish()
