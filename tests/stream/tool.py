"""`vdi` in the tests of the stream. It takes the first of the program's arguments: vdi."""
import http.client
import json
import os
import pathlib
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

from viewer import Viewer

VDI = sys.argv.pop(1)
PATIENCE = 120  # seconds: far more than anything here takes on a loaded machine


class Server:
    """A running `vdi serve`."""

    def __init__(self, *arguments, environment=None):
        self.errors = tempfile.TemporaryFile("w+")
        self.process = subprocess.Popen([VDI, "serve", *map(str, arguments)], stdout=subprocess.PIPE, stderr=self.errors,
                                        text=True, env={**os.environ, **(environment or {})})
        ready, _, _ = select.select([self.process.stdout], [], [], PATIENCE)
        self.link = self.process.stdout.readline().strip() if ready else ""
        if not self.link:
            self.kill()
            raise RuntimeError("vdi serve printed no link: " + self.said())
        self.address, _, fragment = self.link.partition("#token=")
        self.token = fragment
        self.port = int(self.address.rstrip("/").rpartition(":")[2])

    def said(self):
        self.errors.seek(0)
        return self.errors.read()

    def end(self, how=signal.SIGTERM):
        self.process.send_signal(how)
        self.process.stdout.close()
        return self.process.wait(PATIENCE)

    def close(self):
        self.kill()
        self.errors.close()

    def kill(self):
        if self.process.poll() is None:
            self.end(signal.SIGKILL)

    def get(self, path, **headers):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE)
        connection.request("GET", path, headers=headers)
        reply = connection.getresponse()
        body = reply.read()
        connection.close()
        return reply, body

    def ticks(self):
        """The CPU time that the server has taken."""
        fields = pathlib.Path(f"/proc/{self.process.pid}/stat").read_text().rpartition(")")[2].split()
        return int(fields[11]) + int(fields[12])

    def status(self):
        return json.loads(self.get("/status", Authorization="Bearer " + self.token)[1])

    def viewers(self):
        return self.status()["viewers"]

    def frames(self):
        """The number of frames published so far."""
        return self.status()["frames"]


def make(path, size, resolution, supersegments, step=0):
    subprocess.run([VDI, "generate", "--size", size, "--resolution", resolution, "--supersegments", str(supersegments),
                    "--step", str(step), "--time", str(step / 2), "-o", path], check=True, timeout=PATIENCE,
                   stdout=subprocess.DEVNULL)


def run(*arguments, environment=None, **more):
    """A vdi that ends by itself."""
    return subprocess.run([VDI, *map(str, arguments)], capture_output=True, text=True, timeout=PATIENCE,
                          env={**os.environ, **(environment or {})}, check=False, **more)


def receive(*arguments, **more):
    return run("receive", *arguments, **more)


def until(condition, what):
    end = time.monotonic() + PATIENCE
    while not condition():
        if time.monotonic() > end:
            raise AssertionError("never came: " + what)
        time.sleep(0.05)


class ServedFolder(unittest.TestCase):
    """A test with VDIs that the class has made (`cls.made`, by setUpClass), and a folder in which they appear."""

    @classmethod
    def setUpClass(cls):
        cls.made = pathlib.Path(tempfile.mkdtemp())

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.made)

    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)
        self.live = self.folder / "live"
        self.live.mkdir()

    def serve(self, *arguments, **more):
        server = Server(*arguments, **more)
        self.addCleanup(server.close)
        return server

    def view(self, server, **more):
        viewer = Viewer(server.port, PATIENCE, **more)
        self.addCleanup(viewer.close)
        return viewer

    def greeted(self, server, **more):
        """A viewer that has said hello, with the token and `more`."""
        viewer = self.view(server)
        viewer.hello(server.token, **more)
        return viewer

    def appear(self, made, name):
        """Makes a file appear whole at once, as a simulation's does."""
        shutil.copy(self.made / f"{made}.vdi", self.live / ".part")
        os.rename(self.live / ".part", self.live / name)

    def bytes_of(self, made):
        return (self.made / f"{made}.vdi").read_bytes()
