"""Uses a server on two ranks by mouse, as the guide describes: makes a VDI of a shown volume,
edits its opacity, orbits it and saves it. Then starts ParaView anew, without the server, opens the
file and orbits again. What the view shows is compared with the tool's
picture for its camera (seen.py). Leaves a screenshot of each step in VDI_TEST_OUTPUT."""

import functools
import os
import sys
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import seen  # noqa: E402
from window import COLOR_EDITOR, Pulse, Screen, Server, Window, check, failures, output_folder, ssim, wait_for  # noqa: E402

OUTPUT = output_folder("server")
path = functools.partial(os.path.join, OUTPUT)
# An edit kept the window from answering for 10 to 20 s before the server's ranks made VDIs during their other
# work.
ANSWER_SECONDS = 1.0


def black_background(window):
    """Sets the black background that the tool's pictures have."""
    window.click("Load a color palette")
    window.key(*["Up"] * 3, "Return")  # Black Background; the menu is not exposed to accessibility tools


def check_view(window, vdi, name):
    """`name`: that of the step, of which a screenshot is left. On a busy machine the full picture
    may take a while."""
    window.save("Save State...", path(name + ".pvsm"))
    end = time.monotonic() + 60
    while True:
        picture = window.screenshot(name + ".png")
        similar = seen.likeness(picture, window.view(), path(vdi), path(name + ".pvsm"), path(name))
        if similar > 0.99 or time.monotonic() > end:
            break
        time.sleep(2)
    print("%s: SSIM %.4f to the tool's picture" % (name, similar), flush=True)
    check(similar > 0.99, name + ": the view shows what the tool renders for its camera")


def edit_opacity(window):
    panel = window.find("Properties", "frame")
    point = window.edit_colors()
    time.sleep(1)
    before = window.pixels()
    with Pulse(window) as pulse:
        window.drag(point, (point[0], point[1] + 60), steps=15, seconds=1)
        # A small one is made so soon that the test may not look in time.
        wait_for("new VDI", lambda: window.is_making(panel) or window.pixels() != before, 60)
        window.screenshot("3_making.png")
        wait_for("end of making the VDI", lambda: not window.is_making(panel), 200)
    window.close_dialog(COLOR_EDITOR)
    window.wait_for_picture(120)
    print("a colour edit with two ranks: the window took at most %.3f s to answer" % pulse.longest, flush=True)
    check(pulse.longest <= ANSWER_SECONDS, "an edit doesn't freeze the window")


def with_server(screen):
    with Server(2, path("server.log")) as server, Window(screen, output=OUTPUT, folder=OUTPUT) as window:
        window.connect("two ranks", server.port, os.environ["VDI_PLUGIN"])
        black_background(window)
        window.show_wavelet()
        window.orbit(60, -40)
        window.screenshot("1_volume.png")
        window.menu("Filters", "Volumetric Depth Images", "Volumetric Depth Image")
        window.apply(200)
        window.wait_for_picture(120)
        window.screenshot("2_applied.png")
        edit_opacity(window)
        window.orbit(-60, -20)
        window.save("Save Data...", path("first.vdi"))
        check_view(window, "first.vdi", "4_orbited")


def reopened(screen):
    with Window(screen, output=OUTPUT, folder=OUTPUT) as window:
        window.load_plugin(os.environ["VDI_PLUGIN"])
        black_background(window)
        window.open_by_double_click("first.vdi")
        window.apply(200)
        window.wait_for_picture()
        check_view(window, "first.vdi", "5_opened")
        opened = window.screenshot_of_middle("5_middle.png")
        for said in ("Array: RTData (points)", "Range: ", "Seen from: ("):
            text = window.text_that_begins("Array: ")
            check(text is not None and said in text, "the opened file's panel says " + said)
        window.orbit(80, 30)
        check_view(window, "first.vdi", "6_orbited_again")
        orbited = window.screenshot_of_middle("6_middle.png")
        window.click("Look as Made")
        wait_for("another picture", lambda: ssim(orbited, window.screenshot_of_middle("7_middle.png")) < 0.9, 60)
        similar = ssim(opened, path("7_middle.png"))
        print("Look as Made: SSIM %.4f to what was shown at first" % similar, flush=True)
        check(similar > 0.95, "Look as Made shows what was shown at first")
        window.screenshot("7_as_made.png")
        window.close()


with Screen() as screen:
    with_server(screen)
    reopened(screen)
sys.exit(1 if failures else 0)
