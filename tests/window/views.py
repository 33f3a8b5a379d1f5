"""By mouse: a component chosen in the toolbar and its undo, and two views of one VDI, of which one has Auto.
views_scene.py runs inside ParaView. Needs VDI_PLUGIN and VDI_TEST_OUTPUT."""

import os
import sys
import time

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, HERE)
from window import Inside, Screen, Window, check, failures, ssim, wait_for  # noqa: E402

inside = Inside("views")  # calls of views_scene.py


def colored(component, low, high):
    """Whether the VDI shows the component, and its map and its legend fit."""
    now = inside("coloring()")
    names = {-1: "Magnitude", 0: "X", 1: "Y", 2: "Z"}
    return (not now["outdated"] and now["shown"] == [max(component, 0)] and now["component"] == component
            and now["title"] == names[component] and abs(now["ends"][0] - low) < 0.05 and abs(now["ends"][1] - high) < 0.05)


def components(window):
    window.menu("Filters", "Volumetric Depth Images", "Volumetric Depth Image")
    window.apply()
    magnitude = window.screenshot_of_middle("1_magnitude.png")
    low, high = inside("coloring()")["ends"]
    check(colored(-1, low, high), "the first Apply shows the magnitude")
    window.choose("Magnitude", "Z")
    wait_for("component Z", lambda: colored(2, -2.647, 2.647), 60)
    wait_for("picture of Z", lambda: ssim(magnitude, window.screenshot_of_middle("2_z.png")) < 0.9, 60)
    names = ("Undo Change color component", "Undo Change Color Component")  # the first in ParaView 5.11
    window.click(next((name for name in names if window.has(name)), names[-1]))
    wait_for("undo of the component", lambda: colored(-1, low, high), 60)
    wait_for("picture of the magnitude", lambda: ssim(magnitude, window.screenshot_of_middle("3_undone.png")) > 0.99, 60)


def auto_in_one_view(window):
    left, top, width, height = window.view()
    middle = top + height // 2

    def drag(x):
        window.drag((x, middle), (x + width // 8, middle), seconds=1)

    window.click("Auto", "check box")
    inside("show_twice()")
    time.sleep(2)
    window.screenshot("4_split.png")
    before = inside("camera()")
    drag(left + width * 3 // 4)
    time.sleep(5)
    window.screenshot("5_right.png")
    check(inside("camera()") == before, "another view's camera doesn't make the VDI anew")
    drag(left + width // 4)
    wait_for("VDI of the view with Auto", lambda: inside("camera()") != before and not inside("coloring()")["outdated"], 60)
    time.sleep(1)
    window.screenshot("6_left.png")


SCRIPT = "--script=" + os.path.join(HERE, "views_scene.py")
with Screen() as screen, Window(screen, SCRIPT, output=inside.folder) as window:
    inside.wait_for_script()
    window.wait_for_picture()
    components(window)
    auto_in_one_view(window)
sys.exit(1 if failures else 0)
