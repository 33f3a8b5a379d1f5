"""By mouse: opens a .vdi file, presses Apply, drags to orbit; what is seen is compared with the tool's picture for the same
camera (orbit_compare.py). Then without the mouse (orbit_inside.py): what comes late shows by itself. orbit_notes.py runs inside
ParaView. Needs VDI_PLUGIN, VDI_TOOL, VDI_LOSE_DEVICE and VDI_TEST_OUTPUT."""

import os
import subprocess
import sys
import time

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, HERE)
from window import Inside, Screen, Window, wait_for  # noqa: E402

inside = Inside("orbit")  # calls of orbit_inside.py


def compare(window, name, start, end, what="orbited"):
    """Drags from start to end, then compares the window with the tool's picture. orbit_compare.py gets `what`."""
    if inside.read("camera.json"):
        os.remove(inside.path("camera.json"))
    window.drag(start, end, steps=30, seconds=1.5)
    wait_for("end of the drag", lambda: inside.read("camera.json"), 60)
    window.wait_for_picture()  # in full
    picture = window.screenshot(name)
    subprocess.run(["pvpython", os.path.join(HERE, "orbit_compare.py"), picture, what], check=True, timeout=200)


def generate(name, *options):
    path = inside.path(name)
    subprocess.run([os.environ["VDI_TOOL"], "generate", "--field", "turbulence", "--size", "32x32x32", "-o", path]
                   + list(options), check=True, stdout=subprocess.DEVNULL)
    return path


def steps():
    """Small frames are quick, but a large VDI isn't loaded so soon."""
    files = [generate("small.vdi", "--resolution", "160x120"),
             generate("large.vdi", "--resolution", "1280x960", "--supersegments", "20", "--seed", "2")]
    size = [120, 90]
    inside("be_small({})".format(size))
    time.sleep(1)
    seen_size, contrast, are_same = inside("show_steps({!r})".format(files))
    assert seen_size == size and contrast > 10 and not are_same, (seen_size, contrast, are_same)
    for step in (0, 1, 0, 1):
        inside("go_to({})".format(step))
        wait_for("picture of step {} without the mouse".format(step), lambda: inside("sees({})".format(step)), 30)


def comparative():
    inside("show_comparative()")
    time.sleep(2)
    count, contrast, whole = inside("comparative_is_whole()")
    assert count == 4 and contrast > 10 and all(whole), "comparative views show rough pictures: %s" % whole
    inside("close_comparative()")


def lost_stills():
    """Each full picture loses the device. The window must give up and keep the rough picture."""
    inside("show_and_lose({!r}, {!r})".format(generate("lost.vdi", "--resolution", "480x360"), LOSE_STILLS))
    wait_for("word of the rough picture", lambda: "with few pixels" in inside("what_is_said()")[0], 60)
    time.sleep(1)
    frames = inside("what_is_said()")[2]
    time.sleep(2)
    said, contrast, later = inside("what_is_said()")
    assert later == frames, "the window renders on and on: %d frames, then %d" % (frames, later)
    assert contrast > 10 and "with few pixels" in said, said
    os.remove(LOSE_STILLS)


def screenshots_while_made():
    inside("show_made()")
    for peak, prepares in ((0.2, False), (0.7, True)):
        held, differs = inside("edit_and_capture({}, {})".format(peak, prepares))
        assert held and differs, "a screenshot shows the VDI from before an edit: {}, {}".format(held, differs)
        wait_for("end of making the VDI", lambda: not inside("is_held()"), 60)
        assert inside("captures_the_same()"), "a screenshot that is taken while a VDI is made isn't the one after that"


def compared_vdis():
    """Each cell of a comparative view has the VDI of its own value."""
    inside("compare_distances([2, 40])")

    def differ():
        thick, thin = inside("compared()")
        return thick - thin > 1

    wait_for("another VDI in each cell", differ, 60)
    inside("close_comparative()")


def two_views():
    """Auto follows the view in which it was turned on, whichever is active, and makes one VDI each time."""
    inside("show_in_two_views()")

    def wait_for_making(view, made):
        wait_for("VDI from view {}".format(view), lambda: inside("makings_from({})".format(view)), 60)
        time.sleep(1)  # Auto looks four times a second
        makings = inside("makings_from({})".format(view))
        assert makings == made, "VDIs are made again and again: {} instead of {}".format(makings, made)

    inside("activate(0)")
    time.sleep(2)  # until the VDI has the script's changes
    inside("forget_makings()")
    inside("turn_auto(1)")
    wait_for_making(0, 1)
    inside("activate(1)")
    time.sleep(1)
    assert inside("makings_from(0)") == 1, "Auto makes the VDI anew for a view in which it wasn't turned on"
    inside("move(0, [0, 80, 1])")
    wait_for_making(0, 2)
    inside("turn_auto(0)")
    inside("turn_auto(1)")
    wait_for_making(1, 3)
    inside("close_second_view()")


generate("input.vdi", "--resolution", "160x160", "--supersegments", "12", "--azimuth", "40")
LOSE_STILLS = os.environ["VDI_TEST_LOSE_STILLS"] = inside.path("lose_stills")
os.environ["LD_PRELOAD"] = os.environ["VDI_LOSE_DEVICE"]
SCRIPT = "--script=" + os.path.join(HERE, "orbit_notes.py")
with Screen(1100, 760) as screen, Window(screen, SCRIPT, output=inside.folder) as window:
    inside.wait_for_script()
    window.open_file(inside.path("input.vdi"))
    window.click("Apply")
    window.wait_for_picture()
    left, top, width, height = window.view()
    middle = (left + width // 2, top + height // 2)
    compare(window, "opened.png", middle, middle, "opened")
    assert inside("what_angle_is_said()") == "", "a view from the VDI's viewpoint says that it is turned"
    compare(window, "orbited.png", middle, (middle[0] + 180, middle[1] + 60))
    turned = inside("what_angle_is_said()")
    assert turned.endswith("from the VDI's viewpoint"), "a view that is turned says " + repr(turned)
    compare(window, "orbited_back.png", middle, (middle[0] - 90, middle[1] - 180))
    steps()
    comparative()
    screenshots_while_made()
    compared_vdis()
    two_views()
    lost_stills()
