"""Shared by the tests of the page: the page in Chromium, its pictures, and those of vdi render.

Their arguments: VDI CHROMIUM FOLDER; pictures are left in the folder."""
import io
import itertools
import json
import math
import os
import subprocess
import sys
import tempfile
import time

import numpy as np
from skimage import io as images
from skimage.metrics import structural_similarity

from browser import Browser

VDI, CHROMIUM, PICTURES = map(os.path.abspath, sys.argv[1:4])
os.makedirs(PICTURES, exist_ok=True)
WIDTH, HEIGHT = 192, 108
failures = []
numbers = itertools.count()  # of pictures that vdi render makes


def check(holds, what):
    if not holds:
        print("FAILED ", what, flush=True)
        failures.append(what)


def vdi(*words):
    subprocess.run([VDI, *map(str, words)], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                   timeout=120)


def page_of(*files, title=None):
    page = files[0].replace(".vdi", ".html")
    vdi("export", *files, "-o", page, *(["--title", title] if title else []))
    return page


def open_page(browser, page, fragment=""):
    browser.open(f"file://{os.path.abspath(page)}{fragment}")


def whole(browser):
    browser.wait("window.vdiPage && vdiPage.vdi && vdiPage.viewer.isWhole()")


def bare(browser):
    """Only the VDI, on black as in vdi render's pictures."""
    browser.value("""(() => {
      document.body.classList.add('bare');
      for (const [id, value] of [['outline', false], ['background', '#000000']]) {
        const input = document.getElementById(id);
        if (id === 'outline') { if (input.checked) input.click(); }
        else { input.value = value; input.dispatchEvent(new Event('input')); }
      }
    })()""")
    whole(browser)


def final(browser):
    """The picture at rest, sheared."""
    browser.wait("window.vdiPage && vdiPage.vdi && vdiPage.viewer.isFinal()")


def shown(browser, name=None):
    final(browser)
    browser.value("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
    path = os.path.join(PICTURES, name + ".png") if name else None
    return images.imread(io.BytesIO(browser.screenshot(path)))[..., :3]


def rendering(file, camera, reconstruction="sheared", size=(WIDTH, HEIGHT), more=()):
    """Starts vdi render of a file from the page's camera. Returns a function that waits for its picture."""
    words = {"position": camera["position"], "focal_point": camera["focalPoint"], "view_up": camera["viewUp"]}
    if camera["parallel"]:
        words.update(parallel_scale=camera["parallelScale"])
    else:
        words.update(view_angle=camera["viewAngle"])
    name = f"expected_{next(numbers)}"
    with open(f"{name}.json", "w", encoding="utf-8") as text:
        json.dump(words, text)
    command = [VDI, "render", file, "-o", f"{name}.png", "--camera", f"{name}.json", "--resolution", f"{size[0]}x{size[1]}",
               "--reconstruction", reconstruction, *map(str, more)]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    def picture():
        if process.wait(120) != 0:
            raise RuntimeError(f"{' '.join(command)}: status {process.returncode}")
        return images.imread(f"{name}.png")[..., :3]

    return picture


def rendered(*words, **more):
    """The picture that vdi render makes of a file from the page's camera."""
    return rendering(*words, **more)()


def compare(what, got, expected, least=0.995):
    """SSIM of each channel, of all and over the object's bounding box."""
    rows, columns = np.nonzero(expected.max(axis=2) > 2)
    if len(rows) == 0:
        check(False, f"{what}: nothing to see")
        return
    box = np.s_[max(rows.min() - 4, 0):rows.max() + 5, max(columns.min() - 4, 0):columns.max() + 5]
    values = [structural_similarity(got[part][..., c], expected[part][..., c], data_range=255)
              for part in (np.s_[:], box) for c in range(3)]
    most = np.abs(got.astype(int) - expected).max()
    print(f"{what}: SSIM {min(values[:3]):.4f}, over the object {min(values[3:]):.4f}, largest difference {most}/255",
          flush=True)
    check(min(values) >= least and most <= 8, what)


def azimuth(camera, degrees):
    up = np.array(camera["viewUp"]) / np.linalg.norm(camera["viewUp"])
    focal = np.array(camera["focalPoint"])
    back = np.array(camera["position"]) - focal
    angle = math.radians(degrees)
    turned = math.cos(angle) * back + math.sin(angle) * np.cross(up, back) + (1 - math.cos(angle)) * (up @ back) * up
    return {**camera, "position": (focal + turned).tolist()}


def camera_of(browser):
    return browser.value("vdiPage.viewer.camera")


def message_of(browser):
    return browser.value("document.getElementById('message').hidden ? '' : document.getElementById('message').textContent")


def in_chromium():
    browser = Browser(CHROMIUM)
    browser.size(WIDTH, HEIGHT)
    return browser


def run(*tests, browser=in_chromium):
    """Runs the tests in turn, in one browser and one temporary folder. Exits with status 1 after a failure."""
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        browser = browser()
        try:
            for test in tests:
                start = time.monotonic()
                try:
                    test(browser)
                except (TimeoutError, RuntimeError) as error:
                    check(False, f"{test.__name__}: {error}")
                print(f"{test.__name__}: {time.monotonic() - start:.1f} s", flush=True)
        finally:
            browser.close()
            os.chdir("/")
    print("all well" if not failures else f"{len(failures)} failures")
    sys.exit(1 if failures else 0)
