"""The source VDI Stream with `vdi serve` of a folder: it shows the same as an opened file, takes new VDIs, keeps one
during Pause, returns to a restarted server, and keeps the token out of saved files and messages. On any number of ranks.
With the argument `states`, it also loads a saved state."""

import os
import shutil
import socket
import subprocess
import sys
import tempfile
import time

import pvtest
import server
from paraview import servermanager, simple, smtrace
from pvtest import check, finish, make_view, message_in, standard_error
from vtkmodules.util.numpy_support import vtk_to_numpy

TOOL, SIZE, PATIENCE = os.environ["VDI_TOOL"], [160, 120], 60
TOKEN = "aToken-of-this-test-alone"
scratch = tempfile.mkdtemp()
environment = server.clean_environment(VDI_TOKEN=TOKEN)


def run(*arguments):
    subprocess.run([TOOL, *arguments], check=True, timeout=PATIENCE, env=environment, stdout=subprocess.DEVNULL)


def until(condition, what):
    end = time.monotonic() + PATIENCE
    while not condition():
        if time.monotonic() > end:
            check(False, what + ": never")
            return
        time.sleep(0.05)


class Folder:
    """A folder with VDIs, and the server that follows it."""

    def __init__(self, name):
        self.path = os.path.join(scratch, name)
        os.mkdir(self.path)
        self.process, self.port = None, "0"

    def appear(self, step):
        """Makes a file appear whole at once, as a simulation's does."""
        shutil.copy(made(step), os.path.join(self.path, ".part"))
        os.rename(os.path.join(self.path, ".part"), os.path.join(self.path, "%06d.vdi" % step))

    def serve(self):
        self.process = subprocess.Popen([TOOL, "serve", "--port", self.port, self.path], stdout=subprocess.PIPE, text=True,
                                        env=environment, stderr=subprocess.DEVNULL)
        self.address = self.process.stdout.readline().strip()
        self.port = self.address.rstrip("/").rpartition(":")[2]
        self.link = self.address + "#token=" + TOKEN

    def kill(self):
        self.process.kill()
        self.process.wait()
        self.process.stdout.close()


def made(step):
    path = os.path.join(scratch, "made_%d.vdi" % step)
    if not os.path.exists(path):
        run("generate", "--field", "turbulence", "--seed", str(step), "--size", "24x24x24", "--resolution", "96x72",
            "--supersegments", "8", "--step", str(step), "--time", str(step), "-o", path)
    return path


def information(source, name):
    source.UpdatePropertyInformation(source.GetProperty(name).SMProperty)
    return source.GetPropertyValue(name)


def take(source):
    source.InvokeCommand("Take")
    source.MarkDirty(source.SMProxy)


def take_next(source, seen):
    """Takes the next VDI once there are more arrivals than `seen`."""
    until(lambda: information(source, "Arrivals") > seen, "another arrival")
    take(source)


def step_of(source):
    """The step of the VDI in the source's output."""
    source.UpdatePipeline()
    parameters = source.GetClientSideObject().GetOutputDataObject(0).GetFieldData().GetArray("VDI.parameters")
    return None if parameters is None else int(vtk_to_numpy(parameters)[3])


def screenshot(source):
    """A picture of only that source, from a viewpoint near the VDI's."""
    simple.HideAll(view)
    simple.Show(source, view).SetRepresentationType("VDI")
    view.CameraPosition, view.CameraFocalPoint = [2.2, 1.4, 2.0], [0.5, 0.5, 0.5]
    return pvtest.screenshot(view, None, SIZE)


def shows(source, step):
    """Whether the view shows what the opened file shows."""
    opened = simple.OpenDataFile(made(step))
    expected = screenshot(opened)
    seen = screenshot(source)
    simple.Delete(opened)
    return expected.std() > 10 and bool((seen == expected).all())


def text_of(path):
    with open(path, encoding="utf-8") as file:
        return file.read()


def shown_and_renewed():
    live = Folder("live")
    live.appear(1)
    live.serve()
    source = simple.VDIStream(URL=live.link, Patience=PATIENCE)
    check(shows(source, 1), "the stream looks like the opened file")
    check(source.URL == live.address, "the token leaves the URL at once: " + source.URL.replace(TOKEN, "TOKEN"))
    line = information(source, "Connection")
    check(line.startswith("127.0.0.1:%s: live" % live.port) and "step 1" in line, "the panel's line: " + line)

    seen = information(source, "Arrivals")
    live.appear(2)
    take_next(source, seen)
    check(step_of(source) == 2, "a file that appears is taken")

    source.Pause = 1
    source.UpdateVTKObjects()
    live.appear(3)
    time.sleep(0.5)
    take(source)
    check(step_of(source) == 2, "a pause keeps the VDI")
    seen = information(source, "Arrivals")
    source.Pause = 0
    source.UpdateVTKObjects()
    until(lambda: take(source) or step_of(source) == 3, "the newest one after a pause")
    check(information(source, "Arrivals") > seen, "the end of a pause counts")

    live.kill()
    until(lambda: "trying again" in information(source, "Connection"), "word of a lost connection")
    take(source)
    check(step_of(source) == 3, "what a lost server has sent stays")
    live.appear(4)
    seen = information(source, "Arrivals")
    live.serve()
    until(lambda: take(source) or step_of(source) == 4, "the next VDI of a server that is back")
    check(shows(source, 4), "a server that is back is shown")
    return live, source


def paused_from_the_start(live):
    source = simple.VDIStream(URL=live.link, Patience=PATIENCE, Pause=1)
    check(step_of(source) == 4, "a source that begins in a pause has the first VDI")
    simple.Delete(source)


def two(live, source):
    other = Folder("other")
    other.appear(5)
    other.serve()
    second = simple.VDIStream(URL=other.link, Patience=PATIENCE)
    check(step_of(second) == 5 and step_of(source) == 4, "two sources have a VDI each")
    seen = information(second, "Arrivals")
    second.URL = live.link
    check(step_of(second) == 4 and information(second, "Arrivals") > seen, "another URL brings that server's VDI")
    simple.Delete(second)
    check(step_of(source) == 4, "the first source outlives the second")
    other.kill()


def nothing_yet():
    empty = Folder("empty")
    empty.serve()
    source = simple.VDIStream(URL=empty.link, Patience=0.5)
    text = standard_error(lambda: screenshot(source))
    check(text == "", "a source that waits is no error: " + text)
    check("No VDI has arrived yet" in message_in(view), "the view says that there is no VDI yet: " + message_in(view))
    empty.appear(1)
    take_next(source, 0)
    check(step_of(source) == 1, "a source that has waited has the first VDI")
    simple.Delete(source)
    empty.kill()


def wrong_token(live):
    wrong = "0123456789abcdef-isn't-it"
    source = simple.VDIStream(URL=live.address + "#token=" + wrong, Patience=PATIENCE)

    def use():
        for _ in range(2):
            screenshot(source)
            take(source)

    text = standard_error(use)
    line = information(source, "Connection")
    check("the token is wrong" in line and "\n" not in line, "a wrong token makes one line: " + line)
    check(text.count("the token is wrong") == 1, "a wrong token is reported once: " + text)
    check("the token is wrong" in message_in(view), "the view says that the token is wrong: " + message_in(view))
    check(wrong not in text + line + message_in(view), "no message contains the wrong token")
    source.URL = live.link
    check(step_of(source) == 4, "the right link mends a wrong token")
    simple.Delete(source)


def saved_without_token(live, source):
    smtrace.start_trace()
    traced = simple.VDIStream(registrationName="traced", URL=live.link)
    applied = smtrace.PropertiesModified(traced.SMProxy)  # as Apply in the panel does
    traced.URL = live.link + "x"
    traced.URL = live.link
    applied.finalize()
    trace = smtrace.stop_trace()
    check("# Properties modified" in trace and trace.count(live.address) == 2, "a change of the URL is traced")
    simple.Delete(traced)
    texts = {"trace": trace, "description": str(source.GetClientSideObject())}
    files = {name: os.path.join(scratch, "saved." + name) for name in ("pvsm", "py", "json")}
    simple.SaveState(files["pvsm"])
    simple.SaveState(files["py"])
    settings = servermanager.vtkSMSettings.GetInstance()
    settings.SetProxySettings(source.SMProxy, None)
    settings.SaveSettingsToFile(files["json"])
    for name, path in files.items():
        with open(path, encoding="utf-8") as file:
            texts[name] = file.read()
    for name, text in texts.items():
        check(live.address in text, "the URL is in the " + name)
        check(TOKEN not in text, "the token isn't in the " + name)
    return files["pvsm"]


def loaded_without_token(live, state):
    simple.ResetSession()
    simple.LoadState(state)
    loaded, = simple.GetSources().values()
    text = standard_error(loaded.UpdatePipeline)
    check("the token is missing" in information(loaded, "Connection") and text.count("the token is missing") == 1,
          "a loaded state says once that it needs a token: " + text)
    loaded.URL = live.link
    check(step_of(loaded) == 4, "a loaded state gets its token by the link")
    return loaded


def deleted_while_connecting():
    """The server accepts connections and never answers."""
    with socket.socket() as silent:
        silent.bind(("127.0.0.1", 0))
        silent.listen()
        source = simple.VDIStream(URL="http://127.0.0.1:%d/#token=%s" % (silent.getsockname()[1], TOKEN), Patience=0)
        begin = time.monotonic()
        source.UpdatePipeline()
        simple.Delete(source)
        del source
        seconds = time.monotonic() - begin
        check(seconds < 0.5, "a source that connects in vain is deleted at once, not after %g s" % seconds)


view = make_view(SIZE, [2.2, 1.4, 2.0], [0.5, 0.5, 0.5])
live, source = shown_and_renewed()
paused_from_the_start(live)
two(live, source)
nothing_yet()
wrong_token(live)
state = saved_without_token(live, source)
if "states" in sys.argv:
    source = loaded_without_token(live, state)
deleted_while_connecting()
simple.Delete(source)
live.kill()
shutil.rmtree(scratch)
finish()
