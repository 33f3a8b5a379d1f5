"""A source that ParaView itself distributes: N ranks against one.

Usage: distributed.py write|compare. `write` (1 rank) makes the pictures to compare with. Nothing is updated before the VDI
asks for it, since an earlier update would hide a wrong request."""

import os
import subprocess
import sys

import numpy as np
import server
from pvtest import *  # noqa: F403

mode = sys.argv[1]


def vdi_of_wavelet(association):
    source = simple.Wavelet()
    if association == "CELLS":
        source = simple.PointDatatoCellData(Input=source)
    return filter_with(source, association, "RTData", Resolution=[160, 120], CameraPosition=[60, 45, 75])


for association in ("POINTS", "CELLS"):
    path = "distributed_%s.png" % association
    saved = os.path.join(OUTPUT, "distributed_%s_%s.vdi" % (association, mode))
    simple.SaveData(saved, proxy=vdi_of_wavelet(association))
    read = picture(simple.OpenDataFile(saved))
    page = saved.replace(".vdi", ".html")
    simple.SaveData(page, proxy=vdi_of_wavelet(association))
    inside = picture(simple.OpenDataFile(vdi_in_page(page, saved.replace(".vdi", "_page.vdi"))))
    check(np.array_equal(inside, read), association + ": the page has the VDI that the file has")
    live = picture(vdi_of_wavelet(association))
    check((live.max(axis=2) > 8).mean() > 0.03, association + ": there is something to see")
    check(np.abs(live.astype(int) - read).max() <= 1, association + ": what is saved is what is shown")
    if mode == "write":
        write_png(path, live)
    else:
        worst = np.abs(live.astype(int) - read_png(os.path.join(OUTPUT, path))).max()
        check(worst <= 1, "%s: the ranks' picture is that of one rank, worst channel off by %d" % (association, worst))


# Pictures as PNG, by extractors: of the VDI itself and from another viewpoint, as `vdi render` draws the VDI's file.
image = vdi_of_wavelet("POINTS")
turned = simple.RenderVDI(Input=image, UseOriginalCamera=1, Azimuth=20)
made = {0: image, 20: turned, "white": turned}
for name, source in made.items():
    extractor = simple.CreateExtractor("VDIPicture", source, registrationName="picture_%s" % name)
    extractor.Writer.FileName = "extracted_%s_%s.png" % (mode, name)
extractor.Writer.Background = [1, 1, 1]
simple.SaveExtracts(ExtractsOutputDirectory=OUTPUT)
extracted = {name: read_png(os.path.join(OUTPUT, "extracted_%s_%s.png" % (mode, name))).astype(int) for name in made}
saved = os.path.join(OUTPUT, "distributed_POINTS_%s.vdi" % mode)
for degrees in (0, 20):
    path = os.path.join(OUTPUT, "rendered_%s.png" % mode)
    subprocess.run([os.environ["VDI_TOOL"], "render", saved, "-o", path, "--azimuth", str(degrees)], check=True, timeout=60,
                   env=server.clean_environment())
    worst = np.abs(extracted[degrees] - read_png(path)).max()
    # As in picture(), straight colour and opacity are bytes, each off by half of 1.
    check(worst <= 2, "an extracted picture at %d degrees is that of vdi render, off by %d" % (degrees, worst))
check(np.abs(extracted[20] - extracted[0]).max() > 30, "another viewpoint has another picture")
check(extracted["white"].min() < 200 and (extracted["white"][extracted[20].max(axis=2) == 0] == 255).all(),
      "a background lies beneath the picture")


def prepare(image):
    """Prepares the VDI as the window does: the ranks progress only while the client asks them
    to."""
    image.SMProxy.InvokeCommand("Prepare")
    percent = image.GetProperty("Preparation")
    for _ in range(100000):
        image.SMProxy.InvokeCommand("ServePreparation")
        image.SMProxy.UpdatePropertyInformation(percent.SMProperty)
        if not 0 <= percent.GetData() < 100:
            break
    return percent.GetData()


# A VDI that all ranks make together in the background.
image = vdi_of_wavelet("POINTS")
first = picture(image)
report = image.GetProperty("Report")
image.SMProxy.UpdatePropertyInformation(report.SMProperty)
before = report.GetData()
simple.SaveData(os.path.join(OUTPUT, "distributed_again.vdi"), proxy=image)
image.SMProxy.UpdatePropertyInformation(report.SMProperty)
check("generate" in before and report.GetData() == before, "saving an existing VDI doesn't make it anew")
image.SMProxy.InvokeCommand("Hold")
image.ScalarOpacityFunction = simple.CreatePiecewiseFunction(Points=[37, 0, 0.5, 0, 277, 0.2, 0.5, 0])
image.UpdatePipeline()
check(np.abs(picture(image).astype(int) - first).max() <= 1, "while it is held, the filter keeps what it has")
check(prepare(image) == 100, "the preparation gets to its end")
image.SMProxy.InvokeCommand("Release")
image.SMProxy.MarkDirty(image.SMProxy)
taken = picture(image)
check(np.abs(taken.astype(int) - first).max() > 30, "the prepared VDI shows the other opacity")
image.SamplingRate = 2
picture(image)
image.SamplingRate = 0
check(np.array_equal(picture(image), taken), "an update without a preparation makes the same VDI")
# A preparation that is cancelled, and one whose filter is deleted before it ends.
image.Supersegments, image.Resolution, image.SamplingRate = 40, [400, 300], 4
image.SMProxy.InvokeCommand("Prepare")
image.SMProxy.InvokeCommand("Hold")
image.SMProxy.InvokeCommand("Release")
image.SMProxy.MarkDirty(image.SMProxy)
check(picture(image).shape == (300, 400, 3), "the update makes the VDI that was given up")
image.SamplingRate = 3
image.SMProxy.InvokeCommand("Prepare")
simple.Delete(image)
check(picture(vdi_of_wavelet("POINTS")).max() > 60, "after a filter that went while it made a VDI, there's another one")
finish()
