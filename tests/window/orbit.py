"""By mouse: opens a .vdi file, presses Apply, drags to orbit; what is seen is compared with the tool's picture for the same
camera (orbit_compare.py). orbit_notes.py runs inside ParaView. Needs VDI_PLUGIN, VDI_TOOL and VDI_TEST_OUTPUT."""

import os
import shutil
import subprocess
import sys
import time

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, HERE)
from window import Screen, Window, wait_for  # noqa: E402

OUTPUT = os.environ["VDI_TEST_OUTPUT"] = os.path.join(os.environ["VDI_TEST_OUTPUT"], "orbit")
os.environ["VDI_TEST_SOURCE"] = os.path.join(os.path.dirname(HERE), "plugin")  # which has pvtest.py
shutil.rmtree(OUTPUT, ignore_errors=True)
os.makedirs(OUTPUT)


def read(name):
    path = os.path.join(OUTPUT, name)
    if not os.path.exists(path):
        return None
    with open(path) as file:
        return file.read()


def compare(window, name, start, end, what="orbited"):
    """After a drag from start to end. `what`: what it is that's seen, for orbit_compare.py."""
    if read("camera.json"):
        os.remove(os.path.join(OUTPUT, "camera.json"))
    window.drag(start, end, steps=30, seconds=1.5)
    wait_for("end of the drag", lambda: read("camera.json"), 60)
    time.sleep(3)  # the still picture
    picture = window.screenshot(name)
    subprocess.run(["pvpython", os.path.join(HERE, "orbit_compare.py"), picture, what], check=True, timeout=200)


subprocess.run([os.environ["VDI_TOOL"], "generate", "--field", "turbulence", "--size", "32x32x32", "--resolution", "160x160",
                "--supersegments", "12", "--azimuth", "40", "-o", os.path.join(OUTPUT, "input.vdi")],
               check=True, stdout=subprocess.DEVNULL)
with Screen(1100, 760) as screen, Window(screen, "--script=" + os.path.join(HERE, "orbit_notes.py"), output=OUTPUT) as window:
    said = wait_for("end of the script", lambda: read("ready"), 100)
    assert said == "ok", said
    window.open_file(os.path.join(OUTPUT, "input.vdi"))
    window.click("Apply")
    window.wait_for_picture()
    left, top, width, height = window.view()
    middle = (left + width // 2, top + height // 2)
    compare(window, "opened.png", middle, middle, "opened")
    compare(window, "orbited.png", middle, (middle[0] + 180, middle[1] + 60))
    compare(window, "orbited_back.png", middle, (middle[0] - 90, middle[1] - 180))
