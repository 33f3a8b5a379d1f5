"""A viewer of a simulation that is killed and starts again, at the same port and with the same token. Arguments: vdi, the
simulation."""
import json
import os
import pathlib
import socket
import subprocess
import sys
import tempfile
import time
import urllib.request

vdi, program = sys.argv[1:]
PATIENCE = 150
TOKEN = "t" * 32


def check(holds, what):
    if not holds:
        sys.exit("FAILED  %s" % (what,))


def until(condition, what):
    end = time.monotonic() + PATIENCE
    while not condition():
        check(time.monotonic() < end, "never came: " + what)
        time.sleep(0.05)


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return listener.getsockname()[1]


with tempfile.TemporaryDirectory() as name:
    folder = pathlib.Path(name)
    got = folder / "got"
    link = folder / "vdi-stream.link"
    port = free_port()
    run = json.dumps({"field": "V", "resolution": [96, 54], "colors": {"range": [0, 1], "opacities": [[0, 0], [1, 1]]},
                      "stream": {"port": port, "title": "Run 7"}})
    environment = {**os.environ, "VDI_OUTPUT": name, "VDI_TOKEN": TOKEN}
    running = []

    def start(*command, **more):
        running.append(subprocess.Popen(command, env=environment, cwd=name, **more))
        return running[-1]

    def frames():
        return len(list(got.glob("*.vdi")))

    try:
        first = start(program, run)
        until(lambda: link.exists() or first.poll() is not None, "a link")
        check(first.poll() is None, "the simulation runs")
        check(link.read_text() == f"http://127.0.0.1:{port}/\n", "the link has no token that the user has set")
        page = urllib.request.urlopen(f"http://127.0.0.1:{port}/", timeout=PATIENCE).read()
        check(b"<title>Run 7</title>" in page, "the page has its title")
        receiver = start(vdi, "receive", f"http://127.0.0.1:{port}/", "-o", got, "--patience", str(PATIENCE),
                         stdout=subprocess.DEVNULL)
        until(lambda: frames() >= 2, "frames")
        first.kill()
        first.wait(PATIENCE)
        dead = link.stat().st_ino  # a killed run can't remove it
        time.sleep(1)
        before = frames()
        again = start(program, run)
        until(lambda: frames() >= before + 2, "frames of the run that started again")
        check(receiver.poll() is None, "the viewer continues")
        check(link.stat().st_ino != dead, "the new run replaces the link that the killed one left")
        check(link.stat().st_mode & 0o777 == 0o600, "only its owner can read the link")
    finally:
        for process in reversed(running):
            process.kill()
            process.wait(PATIENCE)
