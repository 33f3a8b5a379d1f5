"""Drives the real ParaView as a person does: by mouse and keyboard, in a virtual screen with a window manager.

    with Screen() as screen, Window(screen, "--script=x.py") as window:
        window.menu("Sources", "Alphabetical", "Wavelet")
        window.click("Apply")
        window.screenshot("wavelet.png")

Widgets are found by the text or tool tip that a screen reader would read (AT-SPI), then clicked where they are. Needs
xdotool, openbox, Xvfb, ImageMagick, dbus and python3-pyatspi; run it by `dbus-run-session -- /usr/bin/python3 test.py`.
"""

import os
import shutil
import subprocess
import threading
import time

import pyatspi
from gi.repository import Gio, GLib

SECONDS = 20.0  # that a widget may take to show up


def wait_for(what, action, seconds=SECONDS):
    """The first result of `action` that is true; AssertionError that names `what` when there is none in time."""
    end = time.monotonic() + seconds
    while True:
        result = action()
        if result:
            return result
        assert time.monotonic() < end, "there is no %s after %g seconds" % (what, seconds)
        while GLib.MainContext.default().iteration(False):  # what has come and gone, from the bus
            pass
        time.sleep(0.1)


class Screen:
    """Xvfb and openbox; DISPLAY names it while it is entered."""

    def __init__(self, width=1500, height=950):
        self.size = (width, height)

    def __enter__(self):
        read, write = os.pipe()
        self.server = subprocess.Popen(["Xvfb", "-displayfd", str(write), "-screen", "0", "%dx%dx24" % self.size,
                                        "-nolisten", "tcp"], pass_fds=[write], stderr=subprocess.DEVNULL)
        os.close(write)
        with os.fdopen(read) as number:
            os.environ["DISPLAY"] = ":" + number.readline().strip()
        # Qt asks for it once, when a program starts.
        subprocess.run(["dbus-send", "--session", "--print-reply", "--dest=org.a11y.Bus", "/org/a11y/bus",
                        "org.freedesktop.DBus.Properties.Set", "string:org.a11y.Status", "string:IsEnabled",
                        "variant:boolean:true"], check=True, stdout=subprocess.DEVNULL)
        self.manager = subprocess.Popen(["openbox", "--sm-disable"], stderr=subprocess.DEVNULL)
        return self

    def __exit__(self, *error):
        for process in (self.manager, self.server):
            process.terminate()
            process.wait()


class Window:
    """ParaView's main window, without settings of the user's. VDI_PLUGIN_LIST names the list of our plugin."""

    def __init__(self, screen, *arguments, output="."):
        self.screen, self.arguments, self.output = screen, arguments, output

    def __enter__(self):
        home = os.path.join(self.output, "home")
        shutil.rmtree(home, ignore_errors=True)
        os.makedirs(home)
        environment = dict(os.environ, HOME=home, QT_ACCESSIBILITY="1", PV_PLUGIN_CONFIG_FILE=os.environ.get("VDI_PLUGIN_LIST", ""),
                           QT_LINUX_ACCESSIBILITY_ALWAYS_ON="1", LC_ALL="C.UTF-8")
        self.log = open(os.path.join(self.output, "paraview.log"), "w+")
        self.process = subprocess.Popen(["paraview", "--disable-registry", *self.arguments], env=environment,
                                        stdout=self.log, stderr=subprocess.STDOUT)
        wait_for("ParaView on the accessibility bus", self._find_application, 120)
        self.place()
        return self

    def __exit__(self, *error):
        if self.process.poll() is None:
            self.process.terminate()
            try:
                self.process.wait(10)
            except subprocess.TimeoutExpired:
                self.process.kill()
                self.process.wait()
        self.log.close()

    def _find_application(self):
        assert self.process.poll() is None, "ParaView ended by itself: " + self.log_text()[-2000:]
        for application in pyatspi.Registry.getDesktop(0):
            if application is not None and application.get_process_id() == self.process.pid:
                self.application = application
                return any(child is not None for child in application)
        return False

    def log_text(self):
        with open(self.log.name) as log:
            return log.read()

    def place(self):
        """The main window over all of the screen."""
        self.window = wait_for("main window", lambda: xdotool("search", "--onlyvisible", "--pid", str(self.process.pid),
                                                              "--name", "^ParaView").split())[-1]
        xdotool("windowmove", self.window, "0", "0")
        xdotool("windowsize", self.window, str(self.screen.size[0]), str(self.screen.size[1] - 25))  # and a title
        time.sleep(1)

    # What is there

    def _widgets(self, node=None):
        node = self.application if node is None else node
        for child in node:
            if child is None:
                continue
            yield child
            yield from self._widgets(child)

    def find(self, name, role=None, seconds=SECONDS, within=None):
        """The visible widget of that text, or of that tool tip's first line."""
        def look():
            (within or self.application).clear_cache()  # menus are filled without a word to those who listen
            for widget in self._widgets(within):
                try:
                    if role is not None and widget.getRoleName() != role:
                        continue
                    if widget.name.split("\n")[0] != name and widget.description.split("\n")[0] != name:
                        continue
                    if widget.getState().contains(pyatspi.STATE_SHOWING):
                        return widget
                except Exception:  # it went while it was looked at
                    continue
            return None

        return wait_for("widget '%s'" % name, look, seconds)

    def has(self, name, role=None):
        try:
            return self.find(name, role, 0) is not None
        except AssertionError:
            return False

    def box(self, widget):
        """Left, top, width and height on the screen."""
        extents = widget.queryComponent().getExtents(pyatspi.DESKTOP_COORDS)
        return extents.x, extents.y, extents.width, extents.height

    # What a person does

    def click(self, target, role=None, button=1, times=1):
        """`target`: a name as for find, a widget, or a point (x, y) of the screen."""
        x, y = self._point(target, role)
        xdotool("mousemove", str(x), str(y))
        time.sleep(0.1)
        xdotool("click", "--repeat", str(times), "--delay", "60", str(button))
        time.sleep(0.3)

    def drag(self, start, end, button=1, steps=20, seconds=0.6, release=True):
        """From one point of the screen to another; with `release` False the button stays down."""
        xdotool("mousemove", str(start[0]), str(start[1]), "mousedown", str(button))
        for step in range(1, steps + 1):
            at = [round(a + (b - a) * step / steps) for a, b in zip(start, end)]
            xdotool("mousemove", *[str(value) for value in at])
            time.sleep(seconds / steps)
        if release:
            self.release(button)

    def release(self, button=1):
        xdotool("mouseup", str(button))

    def key(self, *keys):
        xdotool("key", *keys)
        time.sleep(0.2)

    def type(self, text):
        xdotool("type", "--delay", "12", text)
        time.sleep(0.2)

    def menu(self, *path):
        """Menu ▸ submenu ▸ item."""
        self.click(path[0], "menu item")
        for above, name in zip(path, path[1:]):
            time.sleep(0.3)
            try:
                self.click(self.find(name, "menu item", 1.5))
            except AssertionError:
                self.click(self._place_in_submenu(above, name))

    def _place_in_submenu(self, above, name):
        """Of an action that ParaView has in two menus, for which Qt tells the place in the other one."""
        submenu = self.find(above, "menu item")
        names = [widget.name for widget in self._widgets(submenu) if widget.getRoleName() == "menu item"]
        x, y, width, height = self.box(submenu)
        return x + width + 40, y + height // 2 + height * names.index(name)

    def screenshot(self, name):
        path = os.path.join(self.output, name)
        subprocess.run(["import", "-window", "root", path], check=True)
        return path

    def _point(self, target, role):
        if isinstance(target, tuple):
            return target
        x, y, width, height = self.box(self.find(target, role) if isinstance(target, str) else target)
        return x + width // 2, y + height // 2


class Pulse:
    """Asks the window something over and over while it is entered: `longest` is the longest time, in seconds, that its
    event loop took to answer."""

    def __init__(self, window):
        self.pid, self.longest, self.stop = window.process.pid, 0.0, threading.Event()

    def __enter__(self):
        session = Gio.bus_get_sync(Gio.BusType.SESSION)
        address = session.call_sync("org.a11y.Bus", "/org/a11y/bus", "org.a11y.Bus", "GetAddress", None, None, 0, -1)
        self.bus = Gio.DBusConnection.new_for_address_sync(
            address.unpack()[0], Gio.DBusConnectionFlags.AUTHENTICATION_CLIENT
            | Gio.DBusConnectionFlags.MESSAGE_BUS_CONNECTION)
        names = self._call("org.freedesktop.DBus", "/", "org.freedesktop.DBus", "ListNames")[0]
        self.name = next(name for name in names if name.startswith(":") and self._pid(name) == self.pid)
        self.thread = threading.Thread(target=self._ask)
        self.thread.start()
        return self

    def __exit__(self, *error):
        self.stop.set()
        self.thread.join()

    def _call(self, name, path, interface, method, arguments=None):
        return self.bus.call_sync(name, path, interface, method, arguments, None, 0, 60000).unpack()

    def _pid(self, name):
        return self._call("org.freedesktop.DBus", "/", "org.freedesktop.DBus", "GetConnectionUnixProcessID",
                          GLib.Variant("(s)", (name,)))[0]

    def _ask(self):
        while not self.stop.is_set():
            begin = time.monotonic()
            self._call(self.name, "/org/a11y/atspi/accessible/root", "org.a11y.atspi.Accessible", "GetRole")
            self.longest = max(self.longest, time.monotonic() - begin)
            time.sleep(0.01)


def xdotool(*arguments):
    return subprocess.run(["xdotool", *arguments], capture_output=True, text=True).stdout
