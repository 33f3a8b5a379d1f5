"""The extractor VDIStream: a viewer gets what a simulation's script offers. The argument tells runs
apart."""

import gc
import os
import stat
import subprocess
import sys
import time
import urllib.request

from pvtest import *  # noqa: F403

name = sys.argv[1]
link_file = os.path.join(OUTPUT, "stream_%s.link" % name)
folder = os.path.join(OUTPUT, "stream_%s" % name)


def receive(link, patience=100):
    # A viewer isn't one of the ranks.
    environment = {key: value for key, value in os.environ.items() if not key.startswith(("OMPI_", "PMIX_", "PMI_"))}
    return subprocess.run([os.environ["VDI_TOOL"], "receive", link, "-o", folder, "--frames", "1", "--patience", str(patience)],
                          capture_output=True, text=True, timeout=150, env=environment)


def arrives(link, expected):
    """Whether a viewer gets that file. Files of earlier steps may come first, because encoding goes on meanwhile."""
    end = time.monotonic() + 120
    while time.monotonic() < end:
        done = receive(link)
        if done.returncode != 0:
            print(done.stderr)
            return False
        with open(os.path.join(folder, "vdi_000000.vdi"), "rb") as file:
            if file.read() == expected:
                return True
        time.sleep(0.1)
    return False


image = simple.VolumetricDepthImage(Input=simple.Wavelet(WholeExtent=[-12, 12, -12, 12, -12, 12]))
image.SelectInputScalars = ["POINTS", "RTData"]
image.Resolution = [160, 120]
image.CameraPosition = [40, 30, 50]
extractor = simple.CreateExtractor("VDIStream", image, registrationName="stream")
extractor.Writer.LinkFile = link_file
extractor.Writer.Title = "Run <7>"
# The extractor of files writes the same at the last of the scene's steps.
files = simple.CreateExtractor("VDI", image, registrationName="files")
files.Writer.FileName = "stream_%s.vdi" % name
link = None
for number, supersegments in enumerate((12, 5)):
    image.Supersegments = supersegments
    simple.SaveExtracts(ExtractsOutputDirectory=OUTPUT)
    if link is None:
        with open(link_file) as file:
            link = file.read().strip()
        check(stat.S_IMODE(os.stat(link_file).st_mode) == 0o600, "only the owner of the link's file can read it")
        page = urllib.request.urlopen(link.split("#")[0], timeout=60).read()
        check(b"<title>Run &lt;7&gt;</title>" in page, "the page has its title")
        check("#token=" in link and link.startswith("http://127.0.0.1:"), "the link has host, port and token")
    with open(os.path.join(OUTPUT, "stream_%s.vdi" % name), "rb") as file:
        check(arrives(link, file.read()), "a viewer gets VDI %d as the extractor of files writes it" % number)

simple.Delete(extractor)
del extractor
gc.collect()
check(not os.path.exists(link_file), "the link goes with the server")
done = receive(link, 0.5)
check(done.returncode == 1 and "no connection" in done.stderr, "the server goes with the extractor")
