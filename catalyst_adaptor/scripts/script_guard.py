"""Guards the scripts that ParaView's engine calls. libvdi_catalyst_engine.so contains this module as text.

`install`, called once before the first script, wraps the functions through which the engine calls scripts, because:
- the engine prints an exception where no caller can collect it, and SystemExit ends the process;
- a script that fails on one rank must stop on all, or the others wait for it;
- an exception belongs into VTK's log, which has all other errors;
- a view that is drawn without a display ends the process (vtkXOpenGLRenderWindow aborts);
- ParaView reports once that the folder for extracts can't be made, and leaves out all extracts from then on;
- a script that can't be loaded leaves its proxies behind, at each attempt."""

import ast
import contextlib
import importlib
import os
import sys
import traceback


disabled = []  # extractors that this step leaves out
modules = []  # modules of the loaded scripts


def end_step():
    """Call it when the engine has run all scripts."""
    set_enabled(disabled, True)
    disabled.clear()


plugin_file = ""


@contextlib.contextmanager
def plugin_named():
    """Gives scripts the plugin as os.environ["VDI_PLUGIN"]. This bypasses the mapping's methods,
    because they would change the environment of the process, which is the simulation's."""
    variables = os.environ._data
    name = os.environ.encodekey("VDI_PLUGIN")
    before = variables.get(name)
    variables[name] = os.environ.encodevalue(plugin_file)
    try:
        yield
    finally:
        if before is None:
            variables.pop(name, None)
        else:
            variables[name] = before


class ScriptFailed(Exception):
    """A failure that has been reported already."""


def check_script(path):
    with plugin_named():
        return what_is_wrong_with(path)


def what_is_wrong_with(path):
    """Returns the fault of a script that is visible before it runs; "" if there is none."""
    if not os.path.exists(path):
        return "the script '%s' isn't there" % path
    if not os.access(path, os.R_OK):
        return "the script '%s' can't be read" % path
    if os.path.isdir(path):
        if os.path.exists(os.path.join(path, "__init__.py")):
            return ""
        return "the script '%s' is a folder without __init__.py" % path
    if path.lower().endswith(".zip"):
        return ""
    try:
        with open(path, "rb") as file:
            tree = ast.parse(file.read(), path)
    except (SyntaxError, ValueError, OSError) as error:
        line = getattr(error, "lineno", None)
        return "the script '%s'%s: %s" % (path, "" if line is None else ", line %d" % line, getattr(error, "msg", error))
    for statement in tree.body:
        call = getattr(statement, "value", None)
        if isinstance(call, ast.Call) and call.args:
            name = getattr(call.func, "id", getattr(call.func, "attr", None))
            if name in ("LoadPlugin", "LoadPlugins"):
                wrong = check_plugin(path, call.args[0])
                if wrong:
                    return "the script '%s', line %d: %s" % (path, statement.lineno, wrong)
    return ""


def check_plugin(script, argument):
    try:
        plugin = eval(compile(ast.Expression(argument), script, "eval"), {"os": os, "__file__": script})
    except KeyError as error:
        return ("the environment has no %s, which is to name the plugin that LoadPlugin loads, "
                "VolumetricDepthImages.so" % error.args[0])
    except Exception:
        return ""  # only the script can evaluate it
    if not isinstance(plugin, str):
        return ""
    return what_is_wrong_with_plugin(plugin)


def what_is_wrong_with_plugin(plugin):
    """Returns the reason why the plugin can't be loaded; "" if it can."""
    if not os.path.isfile(plugin):
        return "the plugin '%s' isn't there" % plugin
    import ctypes
    try:
        ctypes.CDLL(os.path.abspath(plugin))
    except OSError as error:
        return "the plugin can't be loaded: %s" % error
    return ""


def load_plugin():
    """Loads our plugin, so that `from paraview.simple import *` has its filters: scripts that
    ParaView writes load no plugin. Returns "" or the reason of a failure."""
    wrong = what_is_wrong_with_plugin(plugin_file)
    if wrong:
        return wrong
    from paraview import simple
    try:
        simple.LoadPlugin(plugin_file, remote=False, ns=simple.__dict__)
    except Exception as error:
        return "the plugin '%s' can't be loaded: %s" % (plugin_file, error)
    return ""


def text_of(error, skip):
    frames = [frame for frame in traceback.extract_tb(error.__traceback__) if not frame.filename.startswith(skip)]
    what = "".join(traceback.format_exception_only(type(error), error)).strip()
    return (what + "\n" + "".join(traceback.format_list(frames))).strip()


def install(leave, plugin):
    """Wraps the engine's functions. `leave(failed)` waits until a part of a script has ended on all ranks, and returns whether
    it failed on any. `plugin` is the path of our plugin."""
    global plugin_file
    plugin_file = plugin
    from paraview.catalyst import v2_internals as engine
    other_hook = sys.excepthook

    def hook(kind, error, trace):
        if kind is not ScriptFailed:
            other_hook(kind, error, trace)

    sys.excepthook = hook
    skip = (__name__, "<string>", engine.__file__, "<frozen importlib", importlib.__file__)
    extracts = Extracts(loading, leave)

    def guard(name, **hooks):
        setattr(engine, name, guarded(getattr(engine, name), leave, skip, **hooks))

    guard("register_module", before=lambda path: loading.start())
    guard("import_and_validate", failed=loading.forget)
    guard("do_catalyst_initialize", after=lambda result, module: loading.note(module),
          failed=lambda module: loading.forget(module.__name__))
    guard("do_catalyst_execute", before=lambda module: set_time_step(), after=lambda result, module: extracts.prepare(module))
    guard("do_catalyst_finalize")


def guarded(function, leave, skip, before=None, after=None, failed=None):
    """Returns the function between calls of `before` and `after`. If any of these fails on any rank, each rank calls `failed`
    and raises ScriptFailed, which is reported without the frames of the files `skip`."""
    def call(*arguments):
        result, wrong = None, False
        try:
            if before:
                before(*arguments)
            with plugin_named():
                result = function(*arguments)
            if after:
                after(result, *arguments)
        except BaseException as error:
            wrong = True
            log_error(text_of(error, skip))
        if leave(wrong):
            if failed:
                failed(*arguments)
            raise ScriptFailed()
        return result
    return call


def log_error(text):
    from vtkmodules.vtkCommonCore import vtkLogger
    vtkLogger.Log(vtkLogger.VERBOSITY_ERROR, "script", 0, text)


class Loading:
    """The script that is being loaded, and what the loaded ones have made."""

    def __init__(self):
        self.first_proxies = None  # the proxies that existed before any script was loaded
        self.proxies = None  # those that existed before this one was loaded
        self.folders = {}  # folders of extracts, by module's name
        self.owners = {}  # modules' names, by extractor

    def start(self):
        extend_proxies()
        self.proxies = registered_proxies()
        if self.first_proxies is None:
            self.first_proxies = self.proxies

    def note(self, module):
        modules.append(module)
        for group, _, proxy in registered_proxies() - (self.proxies or set()):
            if group == "extractors":
                self.owners[proxy] = module.__name__
        self.folders[module.__name__] = os.environ.get("PARAVIEW_OVERRIDE_EXTRACTS_OUTPUT_DIRECTORY",
                                                       module.options.ExtractsOutputDirectory)

    def forget(self, name):
        self.forget_module(name)
        forget_new_proxies(self.proxies)

    def forget_all(self):
        for module in list(modules):
            self.forget_module(module.__name__)
        forget_new_proxies(self.first_proxies)
        self.__init__()

    @staticmethod
    def forget_module(name):
        from paraview.catalyst import importers
        importers._path_finder_instance._registered_files.pop(name, None)
        sys.modules.pop(name, None)
        modules[:] = [module for module in modules if module.__name__ != name]

    def folder_of(self, extractor):
        return self.folders.get(self.owners.get(extractor.SMProxy, ""), "")


loading = Loading()


def forget_scripts():
    """Removes the modules of all scripts and the proxies that they have made."""
    loading.forget_all()


class Extracts:
    """Prepares the files of a step before the engine writes them."""

    def __init__(self, loading, leave):
        self.loading = loading
        self.leave = leave

    def prepare(self, module):
        due = self.leave_out_same_files(due_extractors())
        if due:
            make_folder(self.loading.folders.get(module.__name__, ""))
        drawn = [extractor for extractor in due if draws(extractor)]
        if self.leave(not all([has_display(extractor) for extractor in drawn])):
            leave_out(drawn)

    def leave_out_same_files(self, due):
        """Returns the extractors without those that would replace another one's file in this step; reports and disables
        these."""
        writers = {}
        for extractor in due:
            writers.setdefault((self.loading.folder_of(extractor), extractor.Writer.FileName), []).append(extractor)
        for (_, name), same in writers.items():
            if len(same) > 1:
                log_error("%d extractors write the same file '%s'; the first one does, the others need names of their own" %
                          (len(same), name))
                leave_out(same[1:])
        return [extractor for same in writers.values() for extractor in same[:1]]


def has_display(extractor):
    try:
        require_display("the extractor of '%s'" % extractor.Writer.FileName)
    except RuntimeError as error:
        log_error(str(error))
        return False
    return True


def leave_out(extractors):
    """Disables extractors until the step's end."""
    set_enabled(extractors, False)
    disabled.extend(extractors)


def registered_proxies():
    """Returns the set of (group, name, proxy) of all groups."""
    from paraview import servermanager
    iterator = servermanager.vtkSMProxyIterator()
    iterator.SetSessionProxyManager(servermanager.ProxyManager().SMProxyManager)
    iterator.SkipPrototypesOn()
    found = set()
    iterator.Begin()
    while not iterator.IsAtEnd():
        found.add((iterator.GetGroup(), iterator.GetKey(), iterator.GetProxy()))
        iterator.Next()
    return found


def forget_new_proxies(before):
    if before is None:
        return
    from paraview import servermanager
    controller = servermanager.ParaViewPipelineController()
    manager = servermanager.ProxyManager().SMProxyManager
    new = registered_proxies() - before
    for proxy in sorted({proxy for _, _, proxy in new}, key=lambda proxy: -proxy.GetGlobalID()):
        controller.UnRegisterProxy(proxy)  # its dependents go, too
    for group, name, proxy in registered_proxies() - before:
        manager.UnRegisterProxy(group, name, proxy)


def set_time_step():
    """Gives the step to filters whose VDI a script itself saves. Extractors give it to their own
    filters."""
    from paraview import servermanager
    from paraview.modules.vtkPVInSitu import vtkInSituInitializationHelper as helper
    for source in servermanager.ProxyManager().GetProxiesInGroup("sources").values():
        if source.GetXMLName() == "VolumetricDepthImage":
            source.TimeStep = helper.GetTimeStep()


def wanted_steps(first, count):
    """For each of so many steps, a byte: whether the scripts do anything at that step, or may do
    so. All scripts must be loaded."""
    from paraview import servermanager
    extractors = enabled_extractors()
    always = any(hasattr(module, "catalyst_execute") for module in modules)
    if always or not all(counts_steps(extractor.Trigger) for extractor in extractors):
        return bytes([1]) * count
    controller = servermanager.vtkSMExtractsController()

    def is_wanted(step):
        controller.SetTimeStep(step)
        return any(controller.IsTriggerActivated(extractor.SMProxy) for extractor in extractors)

    return bytes(map(is_wanted, range(first, first + count)))


def due_extractors():
    """Returns the extractors that the engine will call in this step."""
    from paraview import servermanager
    from paraview.modules.vtkPVInSitu import vtkInSituInitializationHelper as helper
    controller = servermanager.vtkSMExtractsController()
    controller.SetTimeStep(helper.GetTimeStep())
    controller.SetTime(helper.GetTime())

    def due(extractor):
        trigger = extractor.Trigger
        # Other triggers count how often they are asked.
        return not counts_steps(trigger) or controller.IsTriggerActivated(extractor.SMProxy)

    return [extractor for extractor in enabled_extractors() if due(extractor)]


def enabled_extractors():
    from paraview import servermanager
    extractors = servermanager.ProxyManager().GetProxiesInGroup("extractors").values()
    return [extractor for extractor in extractors
            if servermanager.vtkSMExtractsController.IsExtractorEnabled(extractor.SMProxy)]


def counts_steps(trigger):
    return trigger is not None and trigger.GetXMLName() == "TimeStep"


def draws(extractor):
    return extractor.Producer is not None and extractor.Producer.GetXMLGroup() == "views"


def set_enabled(extractors, enabled):
    from paraview import servermanager
    for extractor in extractors:
        servermanager.vtkSMExtractsController.SetExtractorEnabled(extractor.SMProxy, enabled)


def make_folder(folder):
    if not folder:
        raise RuntimeError("options.ExtractsOutputDirectory is empty, so this step's files aren't written; '.' is here")
    try:
        os.makedirs(folder, exist_ok=True)
    except OSError as error:
        raise RuntimeError("the folder '%s' for this step's files can't be made, they aren't written: %s" %
                           (folder, error.strerror)) from None
    if not os.access(folder, os.W_OK | os.X_OK):
        raise RuntimeError("the folder '%s' can't be written to, so this step's files aren't written" % folder)


def require_display(what):
    from paraview.modules.vtkRemotingViews import vtkPVRenderingCapabilitiesInformation as capabilities
    if not capabilities.GetLocalCapabilities() & capabilities.RENDERING:
        raise RuntimeError("%s needs a display to draw, and there is none (DISPLAY is %s): run the simulation under "
                           "xvfb-run -a, or set DISPLAY; the extractors VDI and VDIPicture need none"
                           % (what, os.environ.get("DISPLAY", "not set")))


def extend_proxies():
    """Lets scripts make and fill views without a display, as exported scripts do, but not draw them. Also gives
    VolumetricDepthImage the attribute Report, because ParaView makes no attributes of information properties."""
    from paraview import servermanager
    if hasattr(servermanager.Proxy, "_vdi_guarded"):
        return
    servermanager.Proxy._vdi_guarded = True
    attribute_of = servermanager.Proxy.__getattr__
    drawing = {"StillRender", "InteractiveRender", "WriteImage", "WriteAnimation", "CaptureWindow", "SaveExtracts"}

    def __getattr__(self, name):
        if name == "Report" and self.SMProxy.GetXMLName() == "VolumetricDepthImage":
            self.SMProxy.UpdatePropertyInformation()
            return self.SMProxy.GetProperty(name).GetElement(0)
        if name in drawing or (name == "Write" and self.SMProxy.GetXMLGroup() == "exporters"):
            require_display("%s of %s" % (name, self.SMProxy.GetXMLLabel()))
        return attribute_of(self, name)

    servermanager.Proxy.__getattr__ = __getattr__
