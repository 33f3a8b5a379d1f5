"""Eight pages in Chromium, connected to a running simulation: one drives, and the others see the
driver and the changes. A finger turns one view meanwhile. The driver leaves, another viewer takes
over and ends the run.

Further argument: the command of a simulation that takes the text of a run, tests/stream/steered.c."""
import json
import os
import subprocess
import sys
import time

from pagetest import azimuth, camera_of, check, run

PAGES = 8
SECONDS = 60  # limit of each wait, on a busy machine
RUN = {"field": "V", "resolution": [96, 54], "supersegments": 8, "every": 5, "stream": {"steer": True},
       "colors": {"range": [0, 1], "opacities": [[0, 0], [1, 1]]}}
STEERING = "vdiPage.live.live.steering"


def text(browser, name):
    return browser.value(f"document.getElementById('{name}').textContent")


def click(browser, name):
    browser.value(f"document.getElementById('{name}').click()")


def enter(browser, parameter, value):
    """Types a parameter's value into its field."""
    browser.value(f"""(() => {{
      const field = document.querySelector('#parameters input[type=number][aria-label={parameter}]');
      field.value = {value};
      field.dispatchEvent(new Event('change'));
    }})()""")


def drive(browser):
    browser.value("document.getElementById('steer').open = true")
    click(browser, "drive")
    browser.wait(f"{STEERING}.driver === {STEERING}.you", SECONDS)


def touch_orbit(browser):
    browser.send("Emulation.setTouchEmulationEnabled", enabled=True, maxTouchPoints=1)
    browser.touch("touchStart", (90, 50))
    for x in range(92, 120, 3):
        browser.touch("touchMove", (x, 50))
    browser.touch("touchEnd")
    browser.send("Emulation.setTouchEmulationEnabled", enabled=False)


def steer_on(browser, link):
    sessions = [browser.session] + [browser.add_page() for _ in range(PAGES - 1)]
    driver, toucher = sessions[:2]

    def each(some):
        for session in some:
            browser.session = session
            yield session

    for _ in each(sessions):
        browser.size(192, 108)
        browser.open(link)
    for _ in each(sessions):
        browser.wait(f"window.vdiPage?.vdi && vdiPage.live.live.viewers === {PAGES} && {STEERING}", SECONDS)

    browser.session = toucher
    browser.value("document.body.classList.add('bare')")  # in a window this small, the bar covers the picture
    touch_orbit(browser)
    turned = camera_of(browser)
    check(turned["position"] != browser.value("vdiPage.vdi.camera.position"), "a finger turns the view of a live page")

    browser.session = driver
    drive(browser)
    me = browser.value(f"{STEERING}.you")
    enter(browser, "level", 0.25)
    for _ in each(sessions[1:]):
        browser.wait(f"{STEERING}.driver === {me} && {STEERING}.parameters.find(({{name}}) => name === 'level').value === 0.25",
                     SECONDS)
        check(text(browser, "driver") == f"Viewer {me} is driving", f"others see who drives: {text(browser, 'driver')}")
        check(browser.value("document.getElementById('drive').disabled && document.getElementById('period').disabled"),
              "others can't steer meanwhile")

    # All pages get VDIs from the driver's new viewpoint. A view that its viewer has turned stays.
    browser.session = driver
    wished = azimuth(camera_of(browser), 40)
    browser.value(f"vdiPage.setCamera({json.dumps(wished)})")
    click(browser, "newview")
    for session in each(sessions):
        browser.wait(f"Math.hypot(...{wished['position']}.map((x, i) => x - vdiPage.vdi.camera.position[i])) < 1e-3", SECONDS)
        if session == toucher:
            check(camera_of(browser) == turned, "a turned view stays while VDIs come from elsewhere")
        else:
            check(text(browser, "angle") == "0°", f"a view that follows: {text(browser, 'angle')}")

    # The driver closes its page. Control is free again, and another viewer takes it.
    browser.session = driver
    complaints = browser.complaints()
    browser.send("Page.navigate", url="about:blank")
    for _ in each(sessions[1:]):
        browser.wait(f"{STEERING}.driver === null && vdiPage.live.live.viewers === {PAGES - 1}", SECONDS)
        check(text(browser, "driver") == "Nobody is driving", f"the driver has left: {text(browser, 'driver')}")
        step = browser.value("vdiPage.vdi.timeStep")
        browser.wait(f"vdiPage.vdi.timeStep > {step}", SECONDS)
    browser.session = toucher
    drive(browser)
    enter(browser, "stop", 1)
    for _ in each(sessions[1:]):
        browser.wait("vdiPage.live.live.hasEnded", SECONDS)
        complaints += browser.complaints()
    # The browser reports connections that the ended run refuses; the pages themselves throw nothing.
    complaints = [one for one in complaints if "WebSocket" not in one and "ERR_CONNECTION" not in one]
    check(not complaints, f"eight pages: {complaints}")


def test_eight_pages(browser):
    with open("output", "w", encoding="utf-8") as output:
        simulation = subprocess.Popen([*sys.argv[4:], json.dumps(RUN)], env={**os.environ, "VDI_OUTPUT": os.getcwd()},
                                      stdout=output, stderr=subprocess.STDOUT)
    try:
        until = time.monotonic() + SECONDS
        while not os.path.exists("vdi-stream.link"):
            if simulation.poll() is not None or time.monotonic() > until:
                raise RuntimeError("the simulation makes no link")
            time.sleep(0.05)
        with open("vdi-stream.link", encoding="utf-8") as file:
            steer_on(browser, file.read().strip())
        check(simulation.wait(SECONDS) == 0, "the simulation ends in order")
        with open("parameters_0.txt", encoding="utf-8") as file:
            levels = {line.split()[1] for line in file}
        check(levels == {"0.5", "0.25"}, f"the simulation has had the driver's value: {levels}")
    finally:
        if simulation.poll() is None:
            simulation.terminate()
            simulation.wait(SECONDS)
        if not os.path.exists("vdi-steering.jsonl") or simulation.returncode != 0:
            with open("output", encoding="utf-8") as output:
                print(output.read(), flush=True)


run(test_eight_pages)
