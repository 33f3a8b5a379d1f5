"""Kills the server of a ParaView at random moments in each kind of the plugin's work. ParaView must say that it has lost its
server, save its state, and end, as it does without the plugin. lost_server_scene.py runs inside ParaView.

    lost_server.py TIMES [SEED]

Needs VDI_PLUGIN and VDI_TEST_OUTPUT."""

import os
import random
import subprocess
import sys
import time
import xml.etree.ElementTree

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, HERE)
from window import Inside, Screen, Server, Window, check, failures  # noqa: E402

TIMES, SEED = int(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 1
SCRIPT = "--script=" + os.path.join(HERE, "lost_server_scene.py")


def call(text):
    return lambda window: inside.start(text)


def orbit(window):
    left, top, width, height = window.view()
    window.drag((left + width // 2, top + height // 2), (left + width // 2 + 150, top + height // 2), release=False)


# What is begun before the server is killed, and how many seconds may pass until then.
WORK = {
    "nothing is done": (lambda window: None, 1),
    "a VDI is regenerated": (call("edit()"), 6),
    "an update makes a VDI": (call("update()"), 6),
    "a VDI is saved": (call("save()"), 6),
    "a filter is deleted": (call("delete()"), 1),
    "Auto regenerates": (call("follow()"), 6),
    "an animation plays": (call("play()"), 4),
    "a stream is received": (lambda window: inside.start("receive(%r)" % stream_url()), 4),
    "the view is turned": (orbit, 1),
}


def stream_url():
    """The link to a server of the VDI that the scene has saved, which lives until the end of this program."""
    if not streams:
        inside("simple.SaveData(%r, proxy=image)" % inside.path("served.vdi"))
        process = subprocess.Popen([os.environ["VDI_TOOL"], "serve", inside.path("served.vdi"), "--port", "0"],
                                   stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        streams.append((process, next(word for line in process.stdout for word in line.split() if "://" in word)))
    return streams[0][1]


def lose(screen, work, chance):
    """Kills the server once during that work."""
    begin, most = WORK[work]
    seconds = chance.uniform(0, most)
    what = "when %s (after %.2f s), " % (work, seconds)
    for name in ("ready", "state.pvsm"):
        if os.path.exists(inside.path(name)):
            os.remove(inside.path(name))
    with Server(1, inside.path("server.log")) as server:
        os.environ["VDI_TEST_PORT"] = server.port
        with Window(screen, SCRIPT, output=inside.folder, folder=inside.folder) as window:
            inside.wait_for_script()
            begin(window)
            time.sleep(seconds)
            server.process.kill()
            window.release()
            window.click(window.find("Save state and exit", "push button", 60))
            window.find("Files of type:", seconds=30)
            window.type(inside.path("state.pvsm"))
            window.key("Return")
            code = window.process.wait(60)
            check(code == 255, what + "ParaView ends by itself: exit code %s" % code)  # its own _exit(-1)
            said = window.log_text()
    saved = []
    if os.path.exists(inside.path("state.pvsm")):
        proxies = xml.etree.ElementTree.parse(inside.path("state.pvsm")).iter("Proxy")
        saved = [proxy.get("type") for proxy in proxies]
    check("RTAnalyticSource" in saved, what + "the state is saved")
    check("VolumetricDepthImage" in saved or "deleted" in work, what + "the state has the VDI")
    check("Signal" not in said, what + "ParaView doesn't crash")


inside = Inside("lost_server")
streams = []
chance = random.Random(SEED)
names = list(WORK)
try:
    with Screen() as screen:
        for i in range(TIMES):
            lose(screen, names[i % len(names)], chance)
finally:
    for process, _ in streams:
        process.kill()
sys.exit(1 if failures else 0)
