"""Opens pages in another browser than Chromium, which page_test.py and live_test.py drive: a page from a disk, a damaged
one, and a live one. The pictures are those of vdi render. CHROMIUM is the browser's program; another argument is the
browser that the program drives: WebKit's, of which the program is the driver."""
import json
import os
import subprocess
import sys

import numpy as np

from pagetest import (VDI, azimuth, bare, camera_of, check, compare, message_of, open_page, page_of, rendering, run, shown, vdi,
                      whole)
from webdriver import Firefox, WebKit

SIZE = 512, 288  # Firefox has no narrower window
NAME = os.path.basename(sys.argv[2])


def look(browser, file, name, angles):
    bare(browser)
    start = camera_of(browser)
    for degrees in angles:
        camera = azimuth(start, degrees)
        browser.value(f"vdiPage.setCamera({json.dumps(camera)}, false)")
        expected = rendering(file, camera, size=SIZE)
        compare(f"{NAME}: {name}, {degrees} degrees", shown(browser, f"{NAME}_{name}_{degrees}"), expected())


def test_from_disk(browser):
    common = ["--size", "24x22x20", "--resolution", f"{SIZE[0]}x{SIZE[1]}", "--supersegments", "8"]
    vdi("generate", *common, "--field", "mixing", "-o", "compact.vdi")
    vdi("generate", *common, "--field", "coil", "--precision", "full", "--parallel", "-o", "full.vdi")
    open_page(browser, page_of("compact.vdi", "full.vdi"))
    whole(browser)
    check(message_of(browser) == "", f"a page from a disk says: {message_of(browser)}")
    look(browser, "compact.vdi", "compact", (0, 30))
    browser.value("vdiPage.show(1)")
    look(browser, "full.vdi", "full", (30,))


def test_damaged(browser):
    with open("compact.html", encoding="utf-8") as file:
        text = file.read()
    begin = text.index(">", text.index('data-size="')) + 1
    with open("damaged.html", "w", encoding="utf-8") as file:
        file.write(text[:begin] + text[begin:begin + 4000] + "A" * 400 + text[begin + 4400:])
    open_page(browser, "damaged.html")
    browser.wait("window.vdiPage && !message.hidden && !message.textContent.startsWith('Reading')")
    check("damaged" in message_of(browser) or "invalid .vdi file" in message_of(browser), f"damage: {message_of(browser)}")


def test_live(browser):
    with subprocess.Popen([VDI, "serve", "compact.vdi"], stdout=subprocess.PIPE, text=True) as server:
        try:
            browser.open(server.stdout.readline().strip())
            browser.wait("window.vdiPage?.vdi && vdiPage.live.live.isFull()")
            check("token" not in browser.value("location.href"), "the token leaves the address")
            look(browser, "compact.vdi", "live", (20,))
        finally:
            server.terminate()


def start():
    browser = Firefox(sys.argv[2]) if len(sys.argv) < 5 else WebKit(*sys.argv[2:5:2])
    browser.size(*SIZE)
    got = browser.value("[innerWidth, innerHeight]")
    check(np.array_equal(got, SIZE), f"the page has {got} pixels")
    return browser


run(test_from_disk, test_damaged, test_live, browser=start)
