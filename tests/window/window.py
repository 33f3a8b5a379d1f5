"""Drives the real ParaView as a person does: by mouse and keyboard, in a virtual screen with a window manager.

    with Screen() as screen, Window(screen, "--script=x.py") as window:
        window.menu("Sources", "Alphabetical", "Wavelet")
        window.click("Apply")
        window.screenshot("wavelet.png")

Widgets are found by the text or tool tip that a screen reader would read (AT-SPI), then clicked where they are. Needs
xdotool, openbox, Xvfb, ImageMagick, dbus, at-spi2-core and python3-gi; run it by
`dbus-run-session -- /usr/bin/python3 test.py`.
"""

import os
import shutil
import subprocess
import sys
import threading
import time

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
        time.sleep(0.1)


class Bus:
    """The accessibility bus of this session."""

    def __init__(self):
        session = Gio.bus_get_sync(Gio.BusType.SESSION)
        for what in ("IsEnabled", "ScreenReaderEnabled"):
            enabled = GLib.Variant("(ssv)", ("org.a11y.Status", what, GLib.Variant("b", True)))
            session.call_sync("org.a11y.Bus", "/org/a11y/bus", "org.freedesktop.DBus.Properties", "Set", enabled, None, 0,
                              -1)
        address = session.call_sync("org.a11y.Bus", "/org/a11y/bus", "org.a11y.Bus", "GetAddress", None, None, 0, -1)
        self.address = address.unpack()[0]
        self.bus = Gio.DBusConnection.new_for_address_sync(
            self.address, Gio.DBusConnectionFlags.AUTHENTICATION_CLIENT | Gio.DBusConnectionFlags.MESSAGE_BUS_CONNECTION)
        # Programs ask for the registry once, when they start.
        self.call("org.a11y.atspi.Registry", "/org/a11y/atspi/accessible/root", "org.a11y.atspi.Accessible", "GetChildren")

    def call(self, name, path, interface, method, arguments=None):
        return self.bus.call_sync(name, path, interface, method, arguments, None, 0, 120000).unpack()

    def program(self, pid):
        """Name on the bus of the process's one connection; None if it has none yet."""
        daemon = ("org.freedesktop.DBus", "/", "org.freedesktop.DBus")
        for name in self.call(*daemon, "ListNames")[0]:
            if not name.startswith(":"):
                continue
            try:
                if self.call(*daemon, "GetConnectionUnixProcessID", GLib.Variant("(s)", (name,)))[0] == pid:
                    return name
            except GLib.Error:  # it has gone
                continue
        return None


class Widget:
    """What AT-SPI says of one widget. Everything is asked anew."""

    SHOWING, ENABLED = 25, 8  # bits of its state

    def __init__(self, bus, program, path="/org/a11y/atspi/accessible/root"):
        self.bus, self.program, self.path = bus, program, path

    def _ask(self, interface, method, arguments=None):
        return self.bus.call(self.program, self.path, interface, method, arguments)

    def _property(self, name):
        arguments = GLib.Variant("(ss)", ("org.a11y.atspi.Accessible", name))
        return self._ask("org.freedesktop.DBus.Properties", "Get", arguments)[0]

    @property
    def name(self):
        return self._property("Name")

    @property
    def tip(self):
        return self._property("Description")

    @property
    def role(self):
        return self._ask("org.a11y.atspi.Accessible", "GetRoleName")[0]

    @property
    def text(self):
        """Of an editor."""
        return self._ask("org.a11y.atspi.Text", "GetText", GLib.Variant("(ii)", (0, -1)))[0]

    @property
    def box(self):
        """Left, top, width and height on the screen."""
        return self._ask("org.a11y.atspi.Component", "GetExtents", GLib.Variant("(u)", (0,)))[0]

    def has(self, state):
        return self._ask("org.a11y.atspi.Accessible", "GetState")[0][state // 32] >> state % 32 & 1 == 1

    def children(self):
        return [Widget(self.bus, program, path) for program, path in
                self._ask("org.a11y.atspi.Accessible", "GetChildren")[0] if not path.endswith("/null")]


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
        self.bus = Bus()
        # Where Qt looks first; asking the session's bus instead, it often comes too late to notice that it's wanted.
        subprocess.run(["xprop", "-root", "-f", "AT_SPI_BUS", "8s", "-set", "AT_SPI_BUS", self.bus.address], check=True)
        self.manager = subprocess.Popen(["openbox", "--sm-disable"], stderr=subprocess.DEVNULL)
        return self

    def __exit__(self, *error):
        for process in (self.manager, self.server):
            process.terminate()
            process.wait()


SKIPPED = 77  # exit status that ctest counts as skipped, and names


class Window:
    """ParaView's main window, without settings of the user's. VDI_PLUGIN_LIST names the list of our plugin."""

    def __init__(self, screen, *arguments, output="."):
        self.screen, self.arguments, self.output = screen, arguments, output

    def __enter__(self):
        home = os.path.join(self.output, "home")
        shutil.rmtree(home, ignore_errors=True)
        os.makedirs(home)
        environment = dict(os.environ, HOME=home, QT_ACCESSIBILITY="1", QT_LINUX_ACCESSIBILITY_ALWAYS_ON="1",
                           LC_ALL="C.UTF-8", PV_PLUGIN_CONFIG_FILE=os.environ.get("VDI_PLUGIN_LIST", ""))
        for _ in range(40):
            self.log = open(os.path.join(self.output, "paraview.log"), "w+")
            self.process = subprocess.Popen(["paraview", "--disable-registry", *self.arguments], env=environment,
                                            stdout=self.log, stderr=subprocess.STDOUT)
            self.window = wait_for("main window", self._main_window, 120)
            program = wait_for("ParaView on the bus", lambda: self.screen.bus.program(self.process.pid))
            self.root = Widget(self.screen.bus, program)
            try:
                wait_for("answer of ParaView", self._answers, 1)
                self.place()
                return self
            except AssertionError:  # Qt 5.15 is often on the bus and has nothing to say there, until its end
                self.__exit__()
        print("skipped: Qt doesn't answer on the accessibility bus here, in 40 starts of ParaView", flush=True)
        sys.exit(SKIPPED)

    def __exit__(self, *error):
        if self.process.poll() is None:
            self.process.terminate()
            try:
                self.process.wait(10)
            except subprocess.TimeoutExpired:
                self.process.kill()
                self.process.wait()
        self.log.close()

    def _main_window(self):
        assert self.process.poll() is None, "ParaView ended by itself: " + self.log_text()[-2000:]
        found = xdotool("search", "--onlyvisible", "--pid", str(self.process.pid), "--name", "^ParaView 5").split()
        return found[-1] if found else None

    def _answers(self):
        try:
            return self.root.children()
        except GLib.Error:
            return False

    def log_text(self):
        with open(self.log.name) as log:
            return log.read()

    def place(self):
        """The main window over all of the screen."""
        xdotool("windowmove", self.window, "0", "0")
        xdotool("windowsize", self.window, str(self.screen.size[0]), str(self.screen.size[1] - 25))  # and a title
        time.sleep(1)

    # What is there

    def widgets(self, node=None, hidden=False):
        """All that are visible, outermost first; `hidden`: the others as well."""
        try:
            children = (node or self.root).children()
        except GLib.Error:  # it went while it was looked at
            return
        for child in children:
            try:
                if node is not None and not hidden and not child.has(Widget.SHOWING):
                    continue
            except GLib.Error:
                continue
            yield child
            yield from self.widgets(child, hidden)

    def find(self, name, role=None, seconds=None):
        """The visible widget of that text, or of that tool tip's first line."""
        def look():
            for widget in self.widgets():
                try:
                    if role is not None and widget.role != role:
                        continue
                    if widget.name.split("\n")[0] == name or widget.tip.split("\n")[0] == name:
                        return widget
                except GLib.Error:
                    continue
            return None

        return wait_for("widget '%s'" % name, look, SECONDS if seconds is None else seconds)

    def has(self, name, role=None):
        try:
            return self.find(name, role, 0) is not None
        except AssertionError:
            return False

    def is_enabled(self, name, role="push button"):
        return self.find(name, role).has(Widget.ENABLED)

    def text_that_begins(self, begin, within=None):
        """The visible text, of a label or an editor, that begins so; None if there is none."""
        for widget in self.widgets(within):
            try:
                text = widget.text if widget.role == "text" else widget.name
            except GLib.Error:
                continue
            if text.startswith(begin):
                return text
        return None

    def values(self):
        """The texts of all editors that are visible."""
        found = []
        for widget in self.widgets():
            try:
                if widget.role == "text":
                    found.append(widget.text)
            except GLib.Error:
                continue
        return found

    def view(self):
        """Left, top, width and height of the one render view, without the frame of the active one."""
        left = self.find("Capture to Clipboard or File").box[0] - 58
        top = self.find("Maximize", "push button").box[1] + 28
        bottom = self.screen.size[1] - 37
        return left, top, self.screen.size[0] - left - 4, bottom - top

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
        names = [widget.name for widget in self.widgets(submenu, hidden=True) if widget.role == "menu item"]
        x, y, width, height = submenu.box
        return x + width + 40, y + height // 2 + height * names.index(name)

    def choose(self, shown, item):
        """In the combo box, of a toolbar if there are several, that shows `shown`."""
        boxes = [widget for widget in self.widgets() if widget.role == "combo box" and widget.name == shown]
        self.click(boxes[-1])
        time.sleep(0.3)
        self.type(item)
        self.key("Return")

    def select(self, row):
        """In the pipeline browser; row 0 is the server."""
        x, y, _, _ = self.find("Pipeline Browser", "frame").box
        self.click((x + 70, y + 32 + 22 * row))

    def close_dialog(self, title):
        """By the button of the window manager's frame."""
        for window in xdotool("search", "--onlyvisible", "--name", "^%s$" % title).split():
            xdotool("windowactivate", "--sync", window, "key", "alt+F4")
        time.sleep(0.5)

    def screenshot(self, name):
        path = os.path.join(self.output, name)
        subprocess.run(["import", "-window", "root", path], check=True)
        return path

    def _point(self, target, role):
        if isinstance(target, tuple):
            return target
        x, y, width, height = (self.find(target, role) if isinstance(target, str) else target).box
        return x + width // 2, y + height // 2


class Pulse:
    """Asks the window something over and over while it is entered: `longest` is the longest time, in seconds, that its
    event loop took to answer."""

    def __init__(self, window):
        self.pid, self.longest, self.stop = window.process.pid, 0.0, threading.Event()

    def __enter__(self):
        bus = Bus()  # of its own, beside what the test asks
        self.root = Widget(bus, bus.program(self.pid))
        self.thread = threading.Thread(target=self._ask)
        self.thread.start()
        return self

    def __exit__(self, *error):
        self.stop.set()
        self.thread.join()

    def _ask(self):
        while not self.stop.is_set():
            begin = time.monotonic()
            self.root.role
            self.longest = max(self.longest, time.monotonic() - begin)
            time.sleep(0.01)


def xdotool(*arguments):
    return subprocess.run(["xdotool", *arguments], capture_output=True, text=True).stdout
