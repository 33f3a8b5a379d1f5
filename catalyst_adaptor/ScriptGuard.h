// Python that stands between ParaView's engine and the scripts that it calls.
#pragma once

namespace vdi::catalyst {

/// Run once, before the first script. Wraps the functions through which the engine calls scripts, for three
/// reasons:
/// - left alone, the engine prints an exception to where nobody can collect it, and SystemExit ends the
/// process;
/// - a script that fails on one rank must stop on all, or the others wait for it in the extracts that follow;
/// - an exception belongs into VTK's log, where all other errors are found.
inline constexpr const char* scriptGuard = R"python(
def _vdi_guard_scripts():
    import sys, traceback
    from paraview.catalyst import v2_internals
    from vtkmodules.vtkCommonCore import vtkIntArray, vtkLogger
    from vtkmodules.vtkParallelCore import vtkCommunicator, vtkMultiProcessController

    class ScriptFailed(Exception):
        """Reported already."""

    other_hook = sys.excepthook

    def hook(kind, error, trace):
        if kind is not ScriptFailed:
            other_hook(kind, error, trace)

    sys.excepthook = hook

    def text_of(error):
        skip = ("<string>", v2_internals.__file__, "<frozen importlib")
        frames = [frame for frame in traceback.extract_tb(error.__traceback__) if not frame.filename.startswith(skip)]
        what = "".join(traceback.format_exception_only(type(error), error)).strip()
        return (what + "\n" + "".join(traceback.format_list(frames))).strip()

    def failed_anywhere(failed):
        controller = vtkMultiProcessController.GetGlobalController()
        here, worst = vtkIntArray(), vtkIntArray()
        here.InsertNextValue(1 if failed else 0)
        worst.SetNumberOfValues(1)
        controller.AllReduce(here, worst, vtkCommunicator.MAX_OP)
        return worst.GetValue(0) > 0

    def guarded(function):
        def call(*arguments):
            result, failed = None, False
            try:
                result = function(*arguments)
            except BaseException as error:
                failed = True
                vtkLogger.Log(vtkLogger.VERBOSITY_ERROR, "script", 0, text_of(error))
            if failed_anywhere(failed):
                raise ScriptFailed()
            return result
        return call

    for name in ("register_module", "import_and_validate", "do_catalyst_initialize", "do_catalyst_execute",
                 "do_catalyst_finalize"):
        setattr(v2_internals, name, guarded(getattr(v2_internals, name)))

_vdi_guard_scripts()
del _vdi_guard_scripts
)python";

}  // namespace vdi::catalyst
