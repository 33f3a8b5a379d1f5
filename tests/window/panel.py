"""By mouse, as the guide describes it: from a shown volume to a VDI in two clicks, its opacity
edited, an edit cancelled, Auto and its undo, saved as data and as a state, the trace replayed and
the state loaded. Leaves a screenshot of each step in VDI_TEST_OUTPUT."""

import functools
import os
import re
import subprocess
import sys
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from window import COLOR_EDITOR, Pulse, Screen, Window, check, failures, output_folder, ssim, wait_for  # noqa: E402

OUTPUT = output_folder("panel")
path = functools.partial(os.path.join, OUTPUT)
# The longest that the window may take to answer while a colour is edited. It took 5 to 20 s before VDIs
# were made in the background, and 0.5 to 1.3 s before still frames were. Two cores with nothing else to
# do take 0.2 s now.
ANSWER_SECONDS = 1.0
# After Delete, ParaView also makes the panels of what is left. window_beside allows as much.
DELETE_SECONDS = 1.25
LOAD = """
from paraview import simple
simple.LoadDistributedPlugin("VolumetricDepthImages", remote=False, ns=globals())
"""
REPLAY = """
import os
from paraview.simple import FindSource, SaveData
SaveData(os.environ["VDI_REPLAYED"], proxy=FindSource("VolumetricDepthImage1"))
"""


def bytes_of(name):
    with open(name, "rb") as file:
        return file.read()


def check_like_volume(volume, vdi):
    similar = ssim(volume, vdi)
    print("the VDI after the first Apply, against the volume before: SSIM %.4f" % similar, flush=True)
    check(similar >= 0.99, "the first Apply shows what the volume showed")


def regenerate_before_apply(window):
    """The button sets the camera for the first Apply. This test undoes that, so that Apply itself
    takes the camera."""
    unset = window.values()
    window.click("Regenerate From This View")
    values = wait_for("camera of the view", lambda: window.values() != unset and window.values())
    width = window.view()[2]
    check(any(value.isdigit() and abs(int(value) - width) < 8 for value in values),
          "Regenerate From This View before the first Apply takes the view's size")
    check(window.is_enabled("Apply"), "Regenerate From This View before the first Apply leaves the VDI to Apply")
    window.screenshot("3_regenerated.png")
    window.click("Undo Regenerate VDI")
    wait_for("panel as it was", lambda: window.values() == unset)


def estimates(window, begin):
    """The panel's estimate of the next VDI, and its change with another number of supersegments, without Apply."""
    line = wait_for("estimate", lambda: window.text_that_begins(begin))
    window.enter("Supersegments", 50)
    more = wait_for("another estimate", lambda: window.text_that_begins(begin) not in (None, line)
                    and window.text_that_begins(begin))
    window.enter("Supersegments", 25)
    wait_for("the first estimate again", lambda: window.text_that_begins(begin) == line)
    print("25 supersegments: %s; 50: %s" % (line, more), flush=True)
    return line


def saved(window, name):
    """The bytes of the VDI's file. The file is removed, because it would make the lists of files
    longer."""
    window.save("Save Data...", path(name))
    data = bytes_of(path(name))
    os.remove(path(name))
    return data


def edit_opacity(window, panel, start, end):
    """Drags a point of the opacity, and waits until the VDI has been made anew."""
    window.drag(start, end, steps=15)
    wait_for("new VDI", lambda: window.is_making(panel), 30)
    wait_for("end of making the VDI", lambda: not window.is_making(panel), 120)


def close_and_cancel(window, panel, below):
    """Closing the editor keeps its edits. Cancel takes back those since it was opened. The opacity's last point is `below`
    pixels below its first place."""
    made = saved(window, "before_close.vdi")
    right, top = window.edit_colors()
    edit_opacity(window, panel, (right, top + below), (right, top + 30))
    window.close_dialog(COLOR_EDITOR)
    check(not window.has(COLOR_EDITOR, "dialog"), "Alt+F4 closes the editor")
    kept = saved(window, "closed.vdi")
    check(kept != made, "closing the editor keeps its edit")
    right, top = window.edit_colors()
    edit_opacity(window, panel, (right, top + 30), (right, top + 80))
    check(saved(window, "before_cancel.vdi") != kept, "another edit gives another VDI")
    editor = window.find(COLOR_EDITOR, "dialog")
    window.click(window.find("Rescale to data range", within=editor))
    window.click(window.find("Cancel", "push button", within=editor))
    check(saved(window, "cancelled.vdi") == kept, "Cancel takes back an edit of the opacity, and Rescale to data range")
    window.wait_for_picture()


def regenerate_in_2d(window):
    """In 2-D mode, a line says why Regenerate can't work. The line vanishes with that mode, and moves no widget."""
    place = window.find("Auto", "check box").box
    window.click("Change Interaction Mode")
    window.click("Regenerate From This View")
    wait_for("word of 2-D mode", lambda: window.text_that_begins("The active view is in 2-D mode"))
    check(window.find("Auto", "check box").box == place, "Auto keeps its place")
    window.click("Change Interaction Mode")
    wait_for("end of it", lambda: window.text_that_begins("The active view is in 2-D mode") is None)


def check_rests_at(window, values, what):
    """The panel has these values after a while, and keeps them."""
    wait_for("values after " + what, lambda: window.values() == values, 60)
    window.wait_for_picture()
    check(window.values() == values, "Auto leaves the VDI as it is after " + what)


def auto_and_undo(window):
    """Auto, the undo of what it did, and the redo: these stay until the camera moves again."""
    x, y, width, height = window.view()
    middle = (x + width // 2, y + height // 2)
    window.click("Auto", "check box")
    before = window.values()
    window.drag(middle, (middle[0] + 160, middle[1]))
    window.find("Undo Regenerate VDI", seconds=60)
    window.drag(middle, (middle[0] + 20, middle[1]), steps=5, seconds=0.2)  # while the VDI is made
    window.key("ctrl+z")
    check_rests_at(window, before, "an undo while it is made")
    # Auto looks at the camera four times a second, so at least once while the button is down.
    window.click("Redo Regenerate VDI", seconds=0.6)
    after = wait_for("camera that Auto had set", lambda: window.values() != before and window.values(), 60)
    window.wait_for_picture()
    window.screenshot("8_auto.png")
    window.click("Undo Regenerate VDI", seconds=0.6)
    check_rests_at(window, before, "an undo")
    window.click("Redo Regenerate VDI", seconds=0.6)
    check_rests_at(window, after, "a redo")
    window.click("Auto", "check box")


def delete(window, button, what):
    """Presses Delete while a VDI is being made."""
    with Pulse(window) as pulse:
        window.click(button)
        time.sleep(1)
    print("Delete while %s is made: the window took at most %.3f s to answer" % (what, pulse.longest), flush=True)
    check(pulse.longest <= DELETE_SECONDS, "Delete doesn't freeze the window while %s is made" % what)


def first_session(window):
    vdi, state = path("first.vdi"), path("state.pvsm")
    window.menu("Tools", "Start Trace")
    window.click("OK", "push button")
    window.load_plugin(os.environ["VDI_PLUGIN"])
    window.menu("Sources", "Alphabetical", "Wavelet")
    window.click("Apply")
    window.choose("Outline", "Volume")
    window.click("Yes", "push button")
    time.sleep(2)
    x, y, width, height = window.view()
    window.drag((x + width // 2, y + height // 2), (x + width // 2 + 120, y + height // 2 - 70))
    time.sleep(1)
    window.screenshot("1_volume.png")
    volume = window.screenshot_of_middle("volume_middle.png")

    window.menu("Filters", "Volumetric Depth Images")
    window.screenshot("2_menu.png")
    window.key("Escape", "Escape")
    window.menu("Filters", "Volumetric Depth Images", "Volumetric Depth Image")
    window.screenshot("3_filter.png")
    check(" s" not in estimates(window, "Estimate for an average volume: "), "the estimate for an average volume has no time")
    regenerate_in_2d(window)
    regenerate_before_apply(window)
    window.apply()
    time.sleep(1)
    window.screenshot("4_applied.png")
    check_like_volume(volume, window.screenshot_of_middle("vdi_middle.png"))
    values = window.values()
    check(estimates(window, "Estimate from the last VDI: ").endswith(" s"), "the estimate from the last VDI has a time")
    check(any(value.startswith("1.73205") for value in values), "the unit distance is the volume's")
    check(any(value.isdigit() and abs(int(value) - width) < 8 for value in values), "the width is the view's")

    window.click("Undo Apply")
    wait_for("state from before", lambda: window.is_enabled("Apply"))
    check(window.values() != values, "the first Apply is undone")
    window.apply()
    time.sleep(1)
    window.screenshot("4_applied_again.png")
    check(window.values() == values, "another Apply takes the same values")

    window.enter("Sampling Rate", 4)  # so that it takes a while
    window.apply()

    right, top = window.edit_colors()
    time.sleep(1)
    window.screenshot("5_colors.png")
    panel = window.find("Properties", "frame")
    with Pulse(window) as pulse:
        window.drag((right, top), (right, top + 90), steps=30, seconds=1.5)
        wait_for("new VDI", lambda: window.is_making(panel), 30)
        window.screenshot("7_making.png")
        window.drag((right, top + 90), (right, top + 60), steps=15)
        wait_for("newer VDI", lambda: window.is_making(panel), 30)
    window.save("Save Data...", path("making"), extension=".vdi")  # the name that ParaView proposes
    wait_for("end of making the VDI", lambda: not window.is_making(panel), 120)
    time.sleep(1)
    window.save("Save Data...", path("made.vdi"))
    check(bytes_of(path("making.vdi")) == bytes_of(path("made.vdi")), "Save Data waits for the VDI that is being made")
    window.screenshot("8_edited.png")
    print("two colour edits, one while a VDI is made: the window took at most %.3f s to answer" % pulse.longest, flush=True)
    check(pulse.longest <= ANSWER_SECONDS, "an edit doesn't freeze the window")
    window.select(0)  # the server, which has no properties in the panel
    check(not window.has(COLOR_EDITOR, "dialog"), "the editor closes where nothing is shown")
    window.select(2)
    panel = window.find("Properties", "frame")
    close_and_cancel(window, panel, 60)

    window.drag((x + width // 2, y + height // 2), (x + width // 2 - 60, y + height // 2 + 30))
    time.sleep(1)
    before = window.values()
    window.click("Regenerate From This View")
    wait_for("new VDI", lambda: window.is_making(panel), 30)
    wait_for("end of making the VDI", lambda: not window.is_making(panel), 120)
    check(window.values() != before, "the button sets the camera")
    auto_and_undo(window)

    window.menu("Tools", "Stop Trace")
    trace = wait_for("trace", lambda: window.text_that_begins("# trace generated"))
    with open(path("trace.py"), "w") as file:
        file.write(LOAD + trace + REPLAY)
    window.screenshot("9_trace.png")
    window.close_dialog("ParaView Python Script Editor")
    # ParaView 6 keeps the editor, and asks when its own window is closed.
    is_editor_open = not window.has("Discard", "push button", 3)
    if not is_editor_open:
        window.click("Discard", "push button")
        window.close_dialog("Script Editor")
    for name in ("CameraPosition", "Resolution", "ScalarOpacityUnitDistance"):
        # ParaView 6 writes volumetricDepthImage1.Set(name=value, ...).
        check(re.search(r"volumetricDepthImage1(\.%s = |\.Set\([^)]*\b%s=)" % (name, name), trace),
              "the trace has " + name)

    window.save("Save Data...", vdi)
    time.sleep(1)
    window.screenshot("10_saved.png")
    check(not window.has("Configure Writer", "dialog") and not window.has("OK", "push button"),
          "Save Data asks nothing twice")
    window.save("Save State...", state)
    window.select(1)
    window.open_by_double_click("first.vdi")  # beside the volume that it was made from
    window.apply(60)
    window.wait_for_picture()
    window.screenshot("11_opened.png")
    check(any(widget.role == "combo box" and widget.name == "VDI" for widget in window.widgets()),
          "what is opened is shown as a VDI")
    button = window.find("Delete", "push button")
    window.drag((x + width // 2, y + height // 2), (x + width // 2 - 60, y + height // 2 + 30))
    delete(window, button, "the picture in full")
    return vdi, state, is_editor_open


def second_session(window, state):
    vdi = path("from_state.vdi")
    window.reset_session()
    window.menu("File", "Load State...")
    window.find("File name:", seconds=10)
    window.type(state)
    window.key("Return")
    time.sleep(20)
    window.screenshot("12_state.png")
    window.select(2)
    window.save("Save Data...", vdi)
    return vdi


def delete_while_making(window):
    window.select(1)
    window.choose("Volume", "Outline")  # which is shown after Delete, without ParaView's time for a volume
    window.select(2)
    panel = window.find("Properties", "frame")
    x, y, width, height = window.view()
    window.drag((x + width // 2, y + height // 2), (x + width // 2 - 90, y + height // 2 + 30))
    window.wait_for_picture()
    window.click("Regenerate From This View")
    wait_for("new VDI", lambda: window.is_making(panel), 30)
    delete(window, window.find("Delete", "push button"), "a VDI")
    window.screenshot("13_deleted.png")


def close_while_making(window, answer):
    window.search("Volumetric Depth Image")
    window.enter("Sampling Rate", 8)
    panel = window.find("Properties", "frame")
    window.click("Apply")
    wait_for("new VDI", lambda: window.is_making(panel), 30)
    window.close(answer=answer)


with Screen() as screen:
    with Window(screen, output=OUTPUT, folder=OUTPUT) as window:
        vdi, state, is_editor_open = first_session(window)
        from_state = second_session(window, state)
        delete_while_making(window)
        close_while_making(window, "Discard" if is_editor_open else None)
    replayed = path("replayed.vdi")
    subprocess.run(["pvbatch", os.path.join(OUTPUT, "trace.py")], check=True, timeout=200,
                   env=dict(os.environ, VDI_REPLAYED=replayed, PV_PLUGIN_CONFIG_FILE=os.environ["VDI_PLUGIN_LIST"]))
check(bytes_of(from_state) == bytes_of(vdi), "a state that is loaded makes the same VDI")
check(bytes_of(replayed) == bytes_of(vdi), "a trace that is replayed makes the same VDI")
sys.exit(1 if failures else 0)
