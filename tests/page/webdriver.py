"""Firefox and WebKit, each with one page, driven by WebDriver. Both need nothing but Python: Firefox takes the
commands on a socket of its own (Marionette), WebKit from the WebKitWebDriver beside it, in a window on an X server."""
import base64
import json
import os
import socket
import subprocess
import time
import urllib.request

from browser import Driven


class OverWebDriver(Driven):
    """What both have in common. `command` sends a command: its name in Marionette, the end of its address in HTTP."""

    def value(self, expression):
        """The value of a JavaScript expression, or of the promise that it gives, once that is fulfilled."""
        return self.command("ExecuteScript", "execute/sync", script=f"return ({expression});", args=[])

    def size(self, width, height):
        """Gives the page this size, which is smaller than the window's."""
        for _ in range(2):
            inner = self.value("[innerWidth, innerHeight]")
            outer = self.command("GetWindowRect", "window/rect")
            self.command("SetWindowRect", "window/rect", width=outer["width"] + width - inner[0],
                         height=outer["height"] + height - inner[1])

    def open(self, url):
        """Opens a URL and waits until the page's script has run."""
        self.command("Navigate", "url", url=url)

    def screenshot(self, path=None):
        """PNG of what the window shows."""
        data = base64.b64decode(self.command("TakeScreenshot", "screenshot", full=False))
        if path:
            with open(path, "wb") as file:
                file.write(data)
        return data


SETTINGS = {"marionette.port": 0, "datareporting.policy.dataSubmissionEnabled": False, "app.update.enabled": False,
            "browser.shell.checkDefaultBrowser": False, "browser.startup.homepage_override.mstone": "ignore",
            "webgl.force-enabled": True, "toolkit.startup.max_resumed_crashes": -1}


class Firefox(OverWebDriver):
    """Firefox without a window. Its GPU is Mesa's llvmpipe."""

    def __init__(self, program):
        super().__init__()
        with open(os.path.join(self.profile.name, "user.js"), "w", encoding="utf-8") as file:
            for name, value in SETTINGS.items():
                file.write(f"user_pref({json.dumps(name)}, {json.dumps(value)});\n")
        self.process = subprocess.Popen([program, "--headless", "--marionette", "--no-remote", "--profile", self.profile.name],
                                        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.number = 0
        try:
            self.connect()
        except BaseException:
            self.end()
            raise

    def connect(self):
        until = time.monotonic() + self.seconds
        port = os.path.join(self.profile.name, "MarionetteActivePort")
        while not os.path.exists(port) or not os.path.getsize(port):
            if self.process.poll() is not None or time.monotonic() > until:
                raise TimeoutError("Firefox doesn't start")
            time.sleep(0.05)
        with open(port, encoding="utf-8") as file:
            self.stream = socket.create_connection(("127.0.0.1", int(file.read())), self.seconds).makefile("rwb")
        self.receive()
        self.command("NewSession", "", capabilities={})

    def receive(self):
        length = b""
        while not length.endswith(b":"):
            byte = self.stream.read(1)
            if not byte:
                raise EOFError("Firefox has ended")
            length += byte
        return json.loads(self.stream.read(int(length[:-1])))

    def command(self, name, _, **parameters):
        self.number += 1
        if name == "ExecuteScript":
            parameters["sandbox"] = None  # the page's own names, too
        message = json.dumps([0, self.number, "WebDriver:" + name, parameters]).encode()
        self.stream.write(str(len(message)).encode() + b":" + message)
        self.stream.flush()
        _, _, error, result = self.receive()
        if error:
            raise RuntimeError(f"{name}: {error['message']}")
        return result["value"] if isinstance(result, dict) and list(result) == ["value"] else result

    def close(self):
        self.stream.close()
        self.end()


class WebKit(OverWebDriver):
    """GTK's WebKit in its MiniBrowser. `program` is WebKitWebDriver. Its GPU is Mesa's llvmpipe."""

    def __init__(self, program, browser):
        super().__init__()
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        home = {name: self.profile.name for name in ("XDG_DATA_HOME", "XDG_CACHE_HOME", "XDG_CONFIG_HOME")}
        self.process = subprocess.Popen([program, f"--port={port}"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                                        env={**os.environ, **home})
        self.opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
        self.address = f"http://127.0.0.1:{port}/session"
        options = {"webkitgtk:browserOptions": {"binary": browser, "args": ["--automation"]}}
        try:
            self.connect({"alwaysMatch": options})
        except BaseException:
            self.end()
            raise

    def connect(self, capabilities):
        until = time.monotonic() + self.seconds
        while True:
            try:
                made = self.send(self.address, {"capabilities": capabilities})
                break
            except ConnectionRefusedError:
                if self.process.poll() is not None or time.monotonic() > until:
                    raise
                time.sleep(0.05)
        self.address += "/" + made["sessionId"]

    def send(self, address, body, method=None):
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(address, data, {"Content-Type": "application/json"}, method=method)
        try:
            with self.opener.open(request, timeout=self.seconds) as reply:
                return json.load(reply)["value"]
        except urllib.error.HTTPError as error:
            raise RuntimeError(f"{address}: {json.load(error)['value']['message']}") from error
        except urllib.error.URLError as error:
            raise error.reason if isinstance(error.reason, OSError) else error

    def command(self, name, end, **parameters):
        reads = name in ("GetWindowRect", "TakeScreenshot")
        return self.send(f"{self.address}/{end}", None if reads else parameters)

    def close(self):
        self.send(self.address, None, "DELETE")
        self.end()
