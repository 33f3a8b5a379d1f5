"""Chromium without a window, driven over its DevTools protocol. Its pipe needs nothing but Python."""
import base64
import json
import os
import select
import subprocess
import tempfile
import time


class Driven:
    """What all browsers have in common: `process`, and `value`, which gives the value of a JavaScript expression."""

    def __init__(self, seconds=60):
        self.seconds = seconds
        self.profile = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)

    def wait(self, expression, seconds=None):
        """Waits until the expression is true."""
        until = time.monotonic() + (seconds or self.seconds)
        while not self.value(expression):
            if time.monotonic() > until:
                raise TimeoutError(f"in vain for: {expression}; the page says: "
                                   + str(self.value("document.getElementById('message')?.textContent")))
            time.sleep(0.02)

    def end(self):
        self.process.terminate()
        try:
            self.process.wait(10)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        self.profile.cleanup()


class Browser(Driven):
    """One browser with one page at first. Chromium's GPU is SwiftShader, which runs on the CPU."""

    def __init__(self, program, seconds=60):
        super().__init__(seconds)
        to_read, self.write_end = os.pipe()
        self.read_end, to_write = os.pipe()

        def connect():  # Chromium reads from descriptor 3 and writes to 4
            reader, writer = os.dup(to_read), os.dup(to_write)
            os.dup2(reader, 3)
            os.dup2(writer, 4)

        self.process = subprocess.Popen(
            [program, "--headless=new", "--no-sandbox", "--remote-debugging-pipe", "--disable-gpu-watchdog",
             "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist", "--hide-scrollbars",
             "--no-first-run", "--disable-background-networking", "--force-device-scale-factor=1",
             f"--user-data-dir={self.profile.name}", "about:blank"],
            preexec_fn=connect, close_fds=False, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(to_read)
        os.close(to_write)
        self.buffer = b""
        self.number = 0
        self.events = []
        self.session = None
        self.add_page()

    def add_page(self):
        """Opens another page, in its own window so that it isn't hidden. Later calls go to it. Returns its session."""
        target = self.send("Target.createTarget", url="about:blank", newWindow=True, browser=True)["targetId"]
        self.session = self.send("Target.attachToTarget", targetId=target, flatten=True, browser=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.send(f"{domain}.enable")
        return self.session

    def close(self):
        os.close(self.write_end)
        os.close(self.read_end)
        self.end()

    def receive(self, until):
        while b"\0" not in self.buffer:
            left = until - time.monotonic()
            if left <= 0 or not select.select([self.read_end], [], [], left)[0]:
                raise TimeoutError("the browser doesn't answer")
            part = os.read(self.read_end, 1 << 20)
            if not part:
                raise EOFError("the browser has ended")
            self.buffer += part
        text, self.buffer = self.buffer.split(b"\0", 1)
        return json.loads(text)

    def send(self, method, browser=False, **parameters):
        self.number += 1
        message = {"id": self.number, "method": method, "params": parameters}
        if not browser:
            message["sessionId"] = self.session
        os.write(self.write_end, json.dumps(message).encode() + b"\0")
        until = time.monotonic() + self.seconds
        while True:
            answer = self.receive(until)
            if answer.get("id") == self.number:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']['message']}")
                return answer["result"]
            self.events.append(answer)

    def value(self, expression):
        """The value of a JavaScript expression, or of the promise that it gives, once that is fulfilled."""
        result = self.send("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in result:
            details = result["exceptionDetails"]
            raise RuntimeError(details.get("exception", {}).get("description", details["text"]))
        return result["result"].get("value")

    def size(self, width, height, ratio=1, mobile=False):
        self.send("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=ratio, mobile=mobile)

    def open(self, url):
        """Opens a URL and waits until the page's script has run."""
        self.events.clear()
        self.send("Page.navigate", url="about:blank")
        self.send("Page.navigate", url=url)
        self.wait("document.readyState === 'complete' && location.href !== 'about:blank'")

    def screenshot(self, path=None):
        """PNG of what the window shows."""
        data = base64.b64decode(self.send("Page.captureScreenshot", format="png")["data"])
        if path:
            with open(path, "wb") as file:
                file.write(data)
        return data

    def mouse(self, kind, x, y, **more):
        self.send("Input.dispatchMouseEvent", type=kind, x=x, y=y, **more)

    def drag(self, start, end, steps=8, button="left", buttons=1, modifiers=0):
        self.mouse("mousePressed", *start, button=button, buttons=buttons, clickCount=1, modifiers=modifiers)
        for i in range(1, steps + 1):
            place = [a + (b - a) * i / steps for a, b in zip(start, end)]
            self.mouse("mouseMoved", *place, button=button, buttons=buttons, modifiers=modifiers)
        self.mouse("mouseReleased", *end, button=button, clickCount=1, modifiers=modifiers)

    def touch(self, kind, *points):
        self.send("Input.dispatchTouchEvent", type=kind,
                  touchPoints=[{"x": x, "y": y, "id": i} for i, (x, y) in enumerate(points)])

    def key(self, key):
        self.send("Input.dispatchKeyEvent", type="keyDown", key=key)
        self.send("Input.dispatchKeyEvent", type="keyUp", key=key)

    def complaints(self):
        """The exceptions of the page and the messages of its console, since it was opened."""
        found = []
        self.value("0")
        for event in self.events:
            method, params = event.get("method"), event.get("params", {})
            if method == "Runtime.exceptionThrown":
                details = params["exceptionDetails"]
                found.append(details.get("exception", {}).get("description", details["text"]))
            elif method == "Log.entryAdded" and params["entry"]["level"] == "error":
                found.append(params["entry"]["text"])
        return found
