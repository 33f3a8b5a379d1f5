"""By mouse: the first Apply, another array, another time step, and their undo, each of which needs a VDI that takes seconds.
Prints the longest time that the window took to answer meanwhile, and checks that only views get the previous output, and no
view while an animation is played or saved.
beside_scene.py runs inside ParaView. Needs VDI_PLUGIN and VDI_TEST_OUTPUT."""

import os
import sys
import time

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, HERE)
from window import Inside, Pulse, Screen, Window, check, failures, ssim, wait_for  # noqa: E402

inside = Inside("beside")  # calls of beside_scene.py
path = inside.path
# The longest that the window may take to answer. These took as long as making the VDI does. At the first Apply ParaView makes
# what shows it, and the device's programs for its first picture are compiled. A slow machine gets a share of the VDI's time.
FIRST_ANSWER_SECONDS, ANSWER_SECONDS, ANSWER_SHARE = 2.5, 1.25, 0.3


def made(array, step):
    """Whether the filter has the VDI of that array and step, and no other VDI is requested."""
    now = inside("output_now()")
    return not now["outdated"] and now["array"] == array and now["time"] == step


def check_answers(window, what, action, array, step, seconds=ANSWER_SECONDS):
    """`action` requests that VDI. The window must answer until the VDI is ready."""
    with Pulse(window) as pulse:
        begin = time.monotonic()
        action()
        wait_for("VDI of " + what, lambda: made(array, step), 120)
        taken = time.monotonic() - begin
        window.wait_for_picture()
    print("%s: the VDI took %.1f s, the window at most %.3f s to answer" % (what, taken, pulse.longest), flush=True)
    check(pulse.longest <= max(seconds, ANSWER_SHARE * taken), what + " doesn't freeze the window")


def bytes_of(name):
    with open(path(name), "rb") as file:
        return file.read()


def first_apply(window):
    window.menu("Filters", "Volumetric Depth Images", "Volumetric Depth Image")
    window.enter("Sampling Rate", 4)  # so that it takes a while
    check_answers(window, "the first Apply", lambda: window.click("Apply"), "small", 0.0, FIRST_ANSWER_SECONDS)
    window.screenshot("1_applied.png")


def others_wait(window):
    """Callers other than views get the requested VDI."""
    window.click("Undo Apply")
    wait_for("state from before", lambda: window.is_enabled("Apply"))
    window.click("Apply")
    wait_for("word of the VDI", lambda: inside("output_now()")["outdated"])
    window.screenshot("2_making.png")
    check(inside("fetched()"), "a script gets the VDI while it is made for the view")
    wait_for("VDI", lambda: made("small", 0.0), 120)
    window.enter("Sampling Rate", 3)
    window.click("Apply")
    window.save("Save Data...", path("during.vdi"))
    wait_for("VDI", lambda: made("small", 0.0), 120)
    window.wait_for_picture()
    window.save("Save Data...", path("after.vdi"))
    check(bytes_of("during.vdi") == bytes_of("after.vdi"), "Save Data waits for the VDI that is being made")


def choose_array(window, item):
    """Chooses the array in the panel's box; a toolbar has such a box, too."""
    left, top, _, height = window.find("Select Input Scalars", "label").box
    window.click((left + 200, top + height // 2))
    window.type(item)
    window.key("Return")
    window.click("Apply")


def given_up_step(window):
    """An edit cancels the VDI of a time step. The step is still made, with that edit."""
    window.click("Next Frame")
    wait_for("word of the VDI", lambda: inside("output_now()")["outdated"])
    inside("edit_opacity(0.6)")
    wait_for("VDI of the step", lambda: made("temperature", 2.0), 120)
    window.wait_for_picture()
    check(made("temperature", 2.0), "a time step that an edit gave up is made")


def films(window):
    """Each frame of an animation that is saved or played shows the VDI of its own time."""
    inside("prepare_films()")
    inside("save_film()")
    for step in range(4):
        check(inside("save_step(%d)" % step) == step, "the VDI of step %d is made" % step)
        film, single = path("film.%04d.png" % step), path("step_%d.png" % step)
        check(ssim(film, single) > 0.9999, "Save Animation has step %d" % step)
        if step > 0:
            check(ssim(film, path("step_%d.png" % (step - 1))) < 0.99,
                  "step %d of the animation differs from the previous one" % step)
    inside("note_frames()")
    window.click("Play")
    wait_for("end of the animation", lambda: made("temperature", 3.0) and not inside("is_played()"), 60)
    frames = inside("noted")
    check(len(frames) >= 4 and {shown for shown, _ in frames} == {0.0, 1.0, 2.0, 3.0}, "an animation is played")
    check(all(shown == of for shown, of in frames), "an animation shows each step's VDI at its time: %s" % frames)


def delete_while_made(window):
    window.click("First Frame")
    button = window.find("Delete", "push button")
    with Pulse(window) as pulse:
        window.click(button)
        time.sleep(1)
    print("Delete while a step is made: the window took at most %.3f s to answer" % pulse.longest, flush=True)
    check(pulse.longest <= ANSWER_SECONDS, "Delete doesn't freeze the window while a step is made")


SCRIPT = "--script=" + os.path.join(HERE, "beside_scene.py")
with Screen(1300, 860) as screen, Window(screen, SCRIPT, output=inside.folder) as window:
    inside.wait_for_script()
    window.wait_for_picture()
    first_apply(window)
    others_wait(window)
    check_answers(window, "another array", lambda: choose_array(window, "temperature"), "temperature", 0.0)
    window.screenshot("3_array.png")
    check(inside("bar_title()") == "temperature", "the scalar bar names the other array: %s" % inside("bar_title()"))
    check_answers(window, "the undo of another array", lambda: window.click("Undo Apply"), "small", 0.0)
    check_answers(window, "the redo of another array", lambda: window.click("Redo Apply"), "temperature", 0.0)
    check_answers(window, "another time step", lambda: window.click("Next Frame"), "temperature", 1.0)
    window.screenshot("4_step.png")
    given_up_step(window)
    films(window)
    delete_while_made(window)
    window.screenshot("5_deleted.png")
sys.exit(1 if failures else 0)
