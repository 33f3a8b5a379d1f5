"""Drives the real ParaView as a person does: by mouse and keyboard, in a virtual screen with a window manager.

    with Screen() as screen, Window(screen, "--script=x.py") as window:
        window.menu("Sources", "Alphabetical", "Wavelet")
        window.click("Apply")
        window.screenshot("wavelet.png")

Widgets are found by the text or tool tip that a screen reader would read (AT-SPI), then clicked where they are. Needs
xdotool, openbox, Xvfb, ImageMagick, dbus, at-spi2-core and python3-gi.
"""

import functools
import html
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import threading
import time

from gi.repository import Gio, GLib

PLUGIN_TESTS = os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "plugin")
sys.path.append(PLUGIN_TESTS)
import server  # noqa: E402

SECONDS = 20.0  # limit for a widget to appear
COLOR_EDITOR = "Color Map and Opacity of the VDI"  # its title
DOCKS = ("frame", "panel")  # roles of dock widgets: the one up to Qt 6.8, and the one that forky's Qt has


def wait_for(what, action, seconds=SECONDS):
    """The first true result of `action`. Raises AssertionError, which names `what`, if there is
    none in time."""
    end = time.monotonic() + seconds
    while True:
        result = action()
        if result:
            return result
        assert time.monotonic() < end, "there is no %s after %g seconds" % (what, seconds)
        time.sleep(0.1)


failures = []


def check(good, what):
    print(("ok      " if good else "FAILED  ") + what, flush=True)
    if not good:
        failures.append(what)


def ssim(one, other):
    """The SSIM of two PNG files, which the tool computes."""
    said = subprocess.run([os.environ["VDI_TOOL"], "compare", "--json", one, other], check=True, capture_output=True)
    return json.loads(said.stdout)["ssim"]


def output_folder(name):
    """A folder of VDI_TEST_OUTPUT, made anew: files of another run would make the lists of files
    longer."""
    path = os.path.join(os.environ["VDI_TEST_OUTPUT"], name)
    shutil.rmtree(path, ignore_errors=True)
    os.makedirs(path)
    return path


class Inside:
    """Calls functions inside ParaView. The script that ParaView runs answers them (inside.py), by files in a folder that
    becomes VDI_TEST_OUTPUT."""

    def __init__(self, name):
        self.folder = os.environ["VDI_TEST_OUTPUT"] = output_folder(name)
        os.environ["VDI_TEST_SOURCE"] = PLUGIN_TESTS  # which has pvtest.py
        self.path = functools.partial(os.path.join, self.folder)

    def read(self, name):
        """The text of a file; None if there is none."""
        if not os.path.exists(self.path(name)):
            return None
        with open(self.path(name)) as file:
            return file.read()

    def wait_for_script(self):
        said = wait_for("end of the script", lambda: self.read("ready"), 100)
        assert said == "ok", said

    def start(self, call):
        """Has a call made. Returns once ParaView has begun with it."""
        if self.read("done") is not None:
            os.remove(self.path("done"))
        with open(self.path("do.new"), "w") as file:
            file.write(call)
        os.replace(self.path("do.new"), self.path("do"))
        wait_for("begin of " + call, lambda: self.read("do") is None, 60)

    def __call__(self, call):
        """The result of a call."""
        self.start(call)
        result = json.loads(wait_for("end of " + call, lambda: self.read("done"), 60))
        assert not str(result).startswith("Traceback"), result
        return result


class Session:
    """A D-Bus session for one ParaView, in a runtime folder of its own.

    ParaView has to start before anything requests the accessibility bus. If that bus exists first,
    Debian's Qt 5.15.8 (a11y_root.diff) may register its objects before it is connected, and then
    never answers."""

    def __init__(self):
        self.folder = tempfile.mkdtemp(prefix="vdi-window-")  # short: sockets have names of at most 108 characters
        self.environment = dict(os.environ, XDG_RUNTIME_DIR=self.folder, XDG_CACHE_HOME=self.folder,
                                GSETTINGS_BACKEND="memory")
        read, write = os.pipe()
        self.daemon = subprocess.Popen(
            ["dbus-daemon", "--session", "--nofork", "--nopidfile", "--print-address=%d" % write], pass_fds=[write],
            env=self.environment, stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL)
        os.close(write)
        with os.fdopen(read) as address:
            self.address = address.readline().strip()
        assert self.address, "dbus-daemon doesn't start"
        self.environment["DBUS_SESSION_BUS_ADDRESS"] = self.address

    def end(self):
        self.daemon.terminate()  # and so the accessibility bus
        self.daemon.wait()
        shutil.rmtree(self.folder, ignore_errors=True)

    def accessibility_bus(self):
        """Starts the accessibility bus if necessary, which Qt notices, and connects to it."""
        flags = Gio.DBusConnectionFlags
        session = Gio.DBusConnection.new_for_address_sync(
            self.address, flags.AUTHENTICATION_CLIENT | flags.MESSAGE_BUS_CONNECTION)
        for what in ("IsEnabled", "ScreenReaderEnabled"):
            enabled = GLib.Variant("(ssv)", ("org.a11y.Status", what, GLib.Variant("b", True)))
            try:
                session.call_sync("org.a11y.Bus", "/org/a11y/bus", "org.freedesktop.DBus.Properties", "Set", enabled, None,
                                  0, -1)
            except GLib.Error as error:
                # Newer at-spi2-core has no ScreenReaderEnabled; IsEnabled is enough for Qt.
                unknown = error.matches(Gio.dbus_error_quark(), Gio.DBusError.INVALID_ARGS)
                if not unknown or what != "ScreenReaderEnabled":
                    raise
        address = session.call_sync("org.a11y.Bus", "/org/a11y/bus", "org.a11y.Bus", "GetAddress", None, None, 0, -1)
        return Bus(address.unpack()[0])


class Bus:
    """A connection to an accessibility bus."""

    def __init__(self, address):
        self.address = address
        flags = Gio.DBusConnectionFlags
        self.bus = Gio.DBusConnection.new_for_address_sync(
            address, flags.AUTHENTICATION_CLIENT | flags.MESSAGE_BUS_CONNECTION)

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
    """One widget as AT-SPI describes it. Each property is queried anew."""

    SHOWING, ENABLED = 25, 8  # bits of its state

    def __init__(self, bus, program, path="/org/a11y/atspi/accessible/root"):
        self.bus, self.program, self.path, self.known_role = bus, program, path, None

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
        """The tool tip without HTML tags, which some of forky's ParaView have."""
        tip = self._property("Description")
        return html.unescape(re.sub("<[^>]*>", "", tip)).strip() if tip.startswith("<html>") else tip

    @property
    def role(self):
        if self.known_role is None:
            self.known_role = self._ask("org.a11y.atspi.Accessible", "GetRoleName")[0]
        return self.known_role

    @property
    def text(self):
        """The text of an editor."""
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
        self.manager = subprocess.Popen(["openbox", "--sm-disable"], stdout=subprocess.DEVNULL,
                                        stderr=subprocess.DEVNULL)
        return self

    def __exit__(self, *error):
        for process in (self.manager, self.server):
            process.terminate()
            process.wait()


class Server:
    """pvserver on some ranks, which waits for a client at `port`."""

    def __init__(self, ranks, log):
        self.ranks, self.log = ranks, log

    def __enter__(self):
        self.port = server.free_port()
        environment = server.clean_environment(OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1")
        with open(self.log, "w") as log:
            self.process = server.start("--server-port=" + self.port, ranks=self.ranks, env=environment, stdout=log,
                                        stderr=log)
        return self

    def __exit__(self, *error):
        server.end(self.process)


class Window:
    """ParaView's main window, without the user's settings and without our plugin."""

    def __init__(self, screen, *arguments, output=".", folder=None):
        """`output`: the folder of screenshots and of the log; `folder`: the one that ParaView's file dialogs show first."""
        self.middle = None
        self.screen, self.arguments, self.output, self.folder = screen, arguments, output, folder

    def __enter__(self):
        home = os.path.join(self.output, "home")
        shutil.rmtree(home, ignore_errors=True)
        os.makedirs(home)
        self.session = Session()
        environment = dict(self.session.environment, HOME=home, QT_LINUX_ACCESSIBILITY_ALWAYS_ON="1", LC_ALL="C.UTF-8")
        environment.pop("PV_PLUGIN_CONFIG_FILE", None)  # ParaView loads the plugins that it names
        if sys.version_info >= (3, 13):
            # With that Python, Debian's ParaView 5.13 crashes if its Script Editor finds pygments, but not ParaView's
            # own formatter for pygments.
            with open(os.path.join(home, "pygments.py"), "w") as file:
                file.write("raise ImportError\n")
            environment["PYTHONPATH"] = home
        self.log = open(os.path.join(self.output, "paraview.log"), "w+")
        self.process = subprocess.Popen(["paraview", "--disable-registry", *self.arguments], env=environment,
                                        cwd=self.folder, stdout=self.log, stderr=subprocess.STDOUT)
        try:
            self.window = wait_for("main window", self._main_window, 120)
            self.bus = self.session.accessibility_bus()
            program = wait_for("ParaView on the bus", lambda: self.bus.program(self.process.pid), 60)
            self.root = Widget(self.bus, program)
            wait_for("answer of ParaView", self._answers, 60)
            self.place()
        except BaseException:
            self.__exit__(*sys.exc_info())
            raise
        return self

    def __exit__(self, *error):
        if error and error[0] is not None:
            self.screenshot("failed.png")
        if self.process.poll() is None:
            server.end(self.process, 10)
        self.log.close()
        self.session.end()

    def _main_window(self):
        assert self.process.poll() is None, "ParaView ended by itself: " + self.log_text()[-2000:]
        found = xdotool("search", "--onlyvisible", "--pid", str(self.process.pid), "--name", "^ParaView [56]").split()
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
        """The main window over all of the screen, with room for the panel of properties."""
        xdotool("windowmove", self.window, "0", "0")
        xdotool("windowsize", self.window, str(self.screen.size[0]), str(self.screen.size[1] - 25))  # and a title
        time.sleep(1)
        left, top, width, height = self.find("Pipeline Browser", "frame").box
        self.drag((left + width // 2, top + height + 2), (left + width // 2, top + 120))
        self.drag((left + width + 4, top + 300), (left + 340, top + 300))
        time.sleep(0.5)

    # Finding widgets

    def widgets(self, node=None, hidden=False):
        """All visible widgets, outermost first; with `hidden`, the others as well."""
        try:
            children = (node or self.root).children()
        except GLib.Error:  # it vanished during the query
            return
        for child in children:
            try:
                if node is not None and not hidden and not child.has(Widget.SHOWING):
                    continue
                # Closed boxes and docks have many children, none of which can be clicked.
                closed = not hidden and (child.role == "combo box" or child.role in DOCKS and child.box[0] < -100)
            except GLib.Error:
                continue
            yield child
            if not closed:
                yield from self.widgets(child, hidden)

    def find(self, name, role=None, seconds=None, within=None):
        """The visible widget of that text, or of that tool tip's first line; `within`: in that widget, a dialog for example."""
        def look():
            for widget in self.widgets(within):
                try:
                    if role is not None and widget.role not in (DOCKS if role == "frame" else (role,)):
                        continue
                    if widget.name.split("\n")[0] == name or widget.tip.split("\n")[0] == name:
                        return widget
                except GLib.Error:
                    continue
            return None

        return wait_for("widget '%s'" % name, look, SECONDS if seconds is None else seconds)

    def has(self, name, role=None, seconds=0):
        try:
            return self.find(name, role, seconds) is not None
        except AssertionError:
            return False

    def is_enabled(self, name, role="push button"):
        return self.find(name, role).has(Widget.ENABLED)

    def text_that_begins(self, begin, within=None):
        """The visible text of a label or an editor that starts with `begin`; None if there is
        none."""
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

    # Using mouse and keyboard

    def click(self, target, role=None, button=1, times=1, seconds=0):
        """`target`: a name as for find, a widget, or a point (x, y) of the screen; `seconds`: how long the button is down."""
        x, y = self._point(target, role)
        xdotool("mousemove", str(x), str(y))
        time.sleep(0.1)
        if seconds:
            xdotool("mousedown", str(button))
            time.sleep(seconds)
            self.release(button)
        else:
            xdotool("click", "--repeat", str(times), "--delay", "60", str(button))
        time.sleep(0.3)

    def apply(self, seconds=120):
        self.click("Apply")
        wait_for("end of Apply", lambda: not self.is_enabled("Apply"), seconds)
        panel = self.find("Properties", "frame")
        time.sleep(0.5)  # a VDI begins to be made in the background
        wait_for("VDI", lambda: not self.is_making(panel), seconds)

    def show_wavelet(self):
        """Shows a wavelet as a volume."""
        self.menu("Sources", "Alphabetical", "Wavelet")
        self.apply()
        self.choose("Outline", "Volume")
        self.click("Yes", "push button")
        self.wait_for_picture(120)

    def orbit(self, right, down):
        """Drags from the middle of the view by these pixels, and waits for the full picture."""
        left, top, width, height = self.view()
        middle = (left + width // 2, top + height // 2)
        before = self.pixels()
        self.drag(middle, (middle[0] + right, middle[1] + down), steps=12, seconds=1)
        wait_for("picture from elsewhere", lambda: self.pixels() != before)
        self.wait_for_picture(120)

    def edit_colors(self):
        """Opens the editor of the VDI's colour map. Returns the screen position of the last opacity point."""
        self.click("Edit Color Map and Opacity")
        button = self.find("Rescale to data range", within=self.find(COLOR_EDITOR, "dialog"))  # just right of the last point
        left, top, _, _ = button.box
        return left - 7, top + 8

    def is_making(self, panel):
        """Whether the panel says that the VDI is made anew. It looks only in `panel`, because a small VDI is soon made."""
        return self.text_that_begins("Regenerating the VDI", panel) is not None

    def save(self, item, name, picture=None, extension=""):
        """Saves by an item of the menu File. Without a server, `name` may be relative to the folder in which ParaView
        was started. `picture`: the name of a screenshot of the dialog. `extension`: the one that ParaView is to add."""
        self.menu("File", item)
        self.find("Files of type:")
        self.type(name)
        if picture:
            self.screenshot(picture)
        self.key("Return")
        path = os.path.join(self.folder or "", name) + extension
        wait_for(path, lambda: os.path.exists(path), 120)

    def open_by_double_click(self, name):
        """Opens a file in the folder in which ParaView was started."""
        self.menu("File", "Open...")
        self.find("Files of type:")
        self.click(self.find(name), times=2)
        wait_for("end of the dialog", lambda: not self.has("Files of type:"))

    def enter(self, label, value):
        """Enters a value in the panel's field beside that label."""
        left, top, width, height = self.find(label, "label").box
        self.click((left + 250, top + height // 2), times=3)
        self.type(str(value))
        self.key("Tab")

    def drag(self, start, end, button=1, steps=20, seconds=0.6, release=True):
        """Drags from one point of the screen to another; with `release` False the button stays down."""
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
        """Menu ▸ submenu ▸ item. A dialog that has just closed may still take the focus, at which Qt closes the menus, so
        the way is walked again as a user would."""
        for _ in range(2):
            try:
                return self._walk_menus(path)
            except (AssertionError, ValueError) as error:
                print("%s; the menus are opened again" % error, flush=True)
                self.key("Escape", "Escape", "Escape")
        return self._walk_menus(path)

    def _walk_menus(self, path):
        self.click(path[0], "menu item")
        for above, name in zip(path, path[1:]):
            time.sleep(0.3)
            try:
                place = self.find(name, "menu item", 1.5)
            except AssertionError:
                place = self._place_in_submenu(above, name)
            self.click(place)

    def _place_in_submenu(self, above, name):
        """The place of an action that ParaView has in two menus; Qt reports its place in the other
        one."""
        submenu = self.find(above, "menu item", 5)
        names = [widget.name for widget in self.widgets(submenu, hidden=True) if widget.role == "menu item"]
        x, y, width, height = submenu.box
        return x + width + 40, y + height // 2 + height * names.index(name)

    def search(self, name):
        """Makes the source or filter of that name by Search, of the menus Sources and Filters. With Qt 6, these don't tell what
        they show once the session was reset."""
        def opened():  # a session that is still being reset closes it
            self.key("ctrl+space")
            time.sleep(1)
            return self.text_that_begins(("Type to search.", "Press Enter to create"))

        wait_for("search", opened)
        self.type(name)
        time.sleep(0.5)
        self.key("Return")

    def open_file(self, path):
        """File ▸ Open; what is shown of it waits for Apply."""
        self.menu("File", "Open...")
        self.find("Files of type:", seconds=10)
        self.type(path)
        self.key("Return")
        wait_for("end of the dialog", lambda: not self.has("Files of type:"))

    def load_plugin(self, path, picture=None):
        """Loads the plugin by Load New, first on a server if there is one; `picture`: the name of a screenshot of the
        dialog after that."""
        name = os.path.splitext(os.path.basename(path))[0]
        if not self.has("Plugin Manager", "dialog"):  # ParaView opens it where a server lacks the plugin
            self.menu("Tools", "Manage Plugins...")
        self.find("Plugin Manager", "dialog")
        for side in ("Remote Plugins", "Local Plugins"):
            if not self.has(side, "panel"):
                continue

            def is_loaded():
                texts = list(self.widgets(self.find(side, "panel"), hidden=True))  # the list may have to be scrolled
                rows = {widget.box[1] for widget in texts if widget.name == name}
                return any(widget.name == "Loaded" and widget.box[1] in rows for widget in texts)

            if is_loaded():
                continue
            self.click(self.find("Load New ...", within=self.find(side, "panel")))
            self.find("Files of type:")
            self.type(path)
            self.key("Return")
            wait_for("loaded plugin", is_loaded, 60)
        if picture:
            self.screenshot(picture)
        self.close_dialog("Plugin Manager")

    def connect(self, name, port, plugin, picture=None):
        """Connects to a server of this computer, entered in the dialog, with the plugin on both sides; `picture`: the name of a
        screenshot of what is entered."""
        self.load_plugin(plugin)
        self.menu("File", "Connect...")
        self.click("Add Server")
        dialog = self.find("Edit Server Configuration", "dialog")
        fields = [self.find(label, "label", within=dialog) for label in ("Name", "Port")]
        for field, value in zip(fields, (name, port)):
            left, top, _, height = field.box
            self.click((left + 150, top + height // 2), times=3)
            self.type(value)
        if picture:
            self.screenshot(picture)
        self.click("Configure")
        self.click("Save")
        dialog = self.find("Choose Server Configuration", "dialog")
        self.click(self.find("Connect", "push button", within=dialog))
        self.find("Plugin Manager", "dialog", 60)  # ParaView opens it on its own
        self.load_plugin(plugin)
        if self.has("Output Messages", "frame"):  # one says that this ParaView keeps no list of servers
            self.click(self.find("Close", within=self.find("Output Messages", "frame")))

    def reset_session(self):
        self.click("Reset Session", "push button")
        if self.has("Yes", "push button"):
            self.click("Yes", "push button")
        time.sleep(2)

    def choose(self, shown, item):
        """Chooses an item of the combo box that shows `shown`: of several, that in a toolbar."""
        boxes = [widget for widget in self.widgets() if widget.role == "combo box" and widget.name == shown]
        self.click(boxes[-1])
        time.sleep(0.3)
        self.type(item)
        self.key("Return")

    def select(self, row):
        """Selects a row of the pipeline browser. Row 0 is the server."""
        x, y, _, _ = self.find("Pipeline Browser", "frame").box
        self.click((x + 70, y + 32 + 22 * row))

    def close_dialog(self, title):
        """Closes the dialog with Alt+F4."""
        for window in xdotool("search", "--onlyvisible", "--name", "^%s$" % title).split():
            xdotool("windowactivate", "--sync", window, "key", "alt+F4")
        time.sleep(0.5)

    def close(self, seconds=60, answer=None):
        """Closes the window with Alt+F4, and clicks the button `answer`, if it is given, of the questions that follow.
        ParaView must end without an error."""
        xdotool("windowactivate", "--sync", self.window, "key", "alt+F4")
        end = time.monotonic() + seconds
        while answer and self.process.poll() is None and time.monotonic() < end:
            if self.has(answer, "push button", 1):
                self.click(answer, "push button")
        code = self.process.wait(seconds)
        check(code == 0, "ParaView's window is closed: exit code %s" % code)
        check("nullptr" not in self.log_text(), "the log has no message of Qt about a nullptr")

    def pixels(self):
        """The middle of the view, as bytes of red, green and blue."""
        if self.middle is None:
            left, top, width, height = self.view()
            self.middle = "%dx%d+%d+%d" % (width // 2, height // 2, left + width // 4, top + height // 4)
        return subprocess.run(["import", "-window", "root", "-crop", self.middle, "-depth", "8", "rgb:-"], check=True,
                              capture_output=True).stdout

    def wait_for_picture(self, seconds=60):
        """Waits until the middle of the view shows something that stays the same for more than two seconds in which the
        window answers. After a drag, a rough picture comes before the full one."""
        seen = []

        def rests():
            self.root.children()
            seen.append(self.pixels())
            return len(set(seen[-1])) > 30 and seen[-7:] == seen[-1:] * 7

        wait_for("picture that rests", lambda: time.sleep(0.4) or rests(), seconds)

    def screenshot(self, name):
        path = os.path.join(self.output, name)
        subprocess.run(["import", "-window", "root", path], check=True)
        return path

    def screenshot_of_middle(self, name):
        """A picture of the middle of the view, once it rests; without the colour legend, which only a volume has."""
        self.wait_for_picture()
        path = os.path.join(self.output, name)
        subprocess.run(["import", "-window", "root", "-crop", self.middle, "+repage", path], check=True)
        return path

    def _point(self, target, role):
        if isinstance(target, tuple):
            return target
        x, y, width, height = (self.find(target, role) if isinstance(target, str) else target).box
        return x + width // 2, y + height // 2


class Pulse:
    """Queries the window repeatedly while this context is entered. `longest` is the longest time,
    in seconds, that the window's event loop took to answer."""

    def __init__(self, window):
        self.pid, self.longest, self.stop = window.process.pid, 0.0, threading.Event()
        self.address = window.bus.address

    def __enter__(self):
        bus = Bus(self.address)  # a separate connection, so that the test's queries aren't disturbed
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
            self.root.name
            self.longest = max(self.longest, time.monotonic() - begin)
            time.sleep(0.01)


def xdotool(*arguments):
    return subprocess.run(["xdotool", *arguments], capture_output=True, text=True).stdout
