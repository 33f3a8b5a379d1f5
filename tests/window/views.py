"""By mouse: a component and an array chosen in the toolbar, what note and legend say meanwhile, the undo of a drag in the
colour editor, and two views of one VDI, of which one has Auto. views_scene.py runs inside ParaView. Needs VDI_PLUGIN and
VDI_TEST_OUTPUT."""

import os
import sys
import time

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, HERE)
from window import COLOR_EDITOR, Inside, Screen, Window, check, failures, ssim, wait_for  # noqa: E402

NOTES = ("Regenerating the VDI", "Loading the VDI into the view", "Refining the picture")
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


def array_in_toolbar(window):
    """An array chosen in the toolbar is the filter's. Note and legend follow what the view shows."""
    panel = window.find("Properties", "frame")
    velocity = window.screenshot_of_middle("3a_velocity.png")
    window.click("Show/hide color legend")
    check(inside("legend()")["map"] == [True, ["velocity"]], "the legend names the array")
    inside("set_rate(4)")  # so that it takes a while
    window.choose("velocity", "density")
    said = []

    def look():
        note = next((text for text in map(lambda begin: window.text_that_begins(begin, panel), NOTES) if text), "")
        said.append((note.split(":")[0], inside("legend()"), window.pixels()))
        return said[-1][1]["map"] == [True, ["density"]] and not note

    wait_for("legend of the array", look, 150)
    window.screenshot("3b_density.png")
    last = window.screenshot_of_middle("3c_density.png")
    print("notes: %s" % [(note, now["map"][1]) for note, now, _ in said], flush=True)
    check(ssim(velocity, last) < 0.9, "an array chosen in the toolbar is shown")
    check(said[0][1]["array"] == said[-1][1]["array"] == "density", "an array chosen in the toolbar is the filter's")
    check(any(note == NOTES[0] for note, _, _ in said), "the panel says that the VDI is being made")
    check(all(now["map"][1] == ["velocity"] for note, now, _ in said if note in NOTES[:2]),
          "the legend stays that of the shown VDI while the next is made and loaded")
    check(said[-1][2] == window.pixels(), "the panel's note ends with the full picture")


def coarse_picture(window):
    """A picture that is coarse after a turn says so, until it is full."""
    panel = window.find("Properties", "frame")
    left, top, width, height = window.view()
    window.drag((left + width // 2, top + height // 2), (left + width // 2 + 30, top + height // 2 + 20), seconds=1)
    coarse = window.pixels()
    wait_for("note on the coarse picture", lambda: window.text_that_begins(NOTES[2], panel), 5)
    wait_for("end of the note", lambda: window.text_that_begins(NOTES[2], panel) is None, 60)
    full = window.pixels()
    window.wait_for_picture()
    check(coarse != full == window.pixels(), "a coarse picture says that it is refined, until it is full")


def input_that_changes(window):
    """An input that is out of date after each update doesn't keep ParaView at work for ever."""
    inside("let_input_change(True)")
    text = wait_for("end of the VDIs in vain", lambda: window.text_that_begins("The input changes with each update"), 120)
    check("5 VDIs in a row" in text, "the panel says why no VDI is shown")
    time.sleep(1)
    check(window.text_that_begins("The input changes") == text and text in window.log_text(), "it goes on saying so")
    window.key("shift")  # a key of the user
    inside("let_input_change(False)")
    wait_for("VDI of the input that rests", lambda: not inside("legend()")["outdated"], 60)
    wait_for("end of the words", lambda: window.text_that_begins("The input changes") is None, 60)


def drag_in_editor(window):
    """A drag in the colour editor is one step for Undo."""
    before, array = inside("opacity()"), inside("legend()")
    right, top = window.edit_colors()
    window.drag((right, top), (right, top + 90), steps=30, seconds=1.5)
    wait_for("edited opacity", lambda: inside("opacity()") != before)
    time.sleep(1)
    window.click("Undo Edit Color Map")
    check(inside("opacity()") == before, "one step back undoes a drag in the colour editor")
    check(inside("legend()")["array"] == array["array"], "it undoes nothing else")
    window.close_dialog(COLOR_EDITOR)


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
    array_in_toolbar(window)
    coarse_picture(window)
    input_that_changes(window)
    drag_in_editor(window)
    auto_in_one_view(window)
sys.exit(1 if failures else 0)
