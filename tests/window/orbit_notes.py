"""Runs inside the real ParaView (--script, which sets no __file__): loads the plugin, prepares the view, and from
then on notes what the view shows after each drag of the mouse: view.png, and camera.json with the camera; and calls what it's
asked to in between (orbit_inside.py). What is done with the window is in orbit.py."""

import json
import os
import sys
import traceback

sys.path[:0] = [os.environ["VDI_TEST_SOURCE"], os.path.join(os.path.dirname(os.environ["VDI_TEST_SOURCE"]), "window")]
OUTPUT = os.environ["VDI_TEST_OUTPUT"]


def leave(name, text):
    """Whole or not at all."""
    path = os.path.join(OUTPUT, name)
    with open(path + ".new", "w") as file:
        file.write(text)
    os.replace(path + ".new", path)


def use():
    import pvtest  # loads the plugin
    from paraview import simple

    view = simple.GetActiveViewOrCreate("RenderView")
    view.OrientationAxesVisibility = view.CenterAxesVisibility = 0
    view.UseColorPaletteForBackground = 0
    view.Background = [0, 0, 0]
    simple.Render(view)
    frames = []
    window = view.GetRenderWindow()

    def count(*_):
        frames.append(window.GetDesiredUpdateRate())

    def note(*_):
        camera = view.GetActiveCamera()
        simple.SaveScreenshot(os.path.join(OUTPUT, "view.png"), view, ImageResolution=view.ViewSize)
        shown = [simple.GetRepresentation(source, view) for source in simple.GetSources().values()]
        leave("camera.json", json.dumps({
            "size": list(view.ViewSize), "position": camera.GetPosition(), "focal-point": camera.GetFocalPoint(),
            "view-up": camera.GetViewUp(), "view-angle": camera.GetViewAngle(), "mode": view.InteractionMode.GetData(),
            "interactive frames": sum(rate >= 1 for rate in frames),
            "representations": [each.Representation.GetData() for each in shown if each and each.Visibility]}))
        frames.clear()

    def obey(*_):
        """The file "do" has an expression, "done" gets what comes of it."""
        path = os.path.join(OUTPUT, "do")
        if not os.path.exists(path):
            return
        with open(path) as file:
            wanted = file.read()
        os.remove(path)
        try:
            import orbit_inside
            leave("done", json.dumps(eval(wanted, vars(orbit_inside))))
        except Exception:
            leave("done", json.dumps(traceback.format_exc()))

    view.GetInteractor().AddObserver("TimerEvent", obey)
    view.GetInteractor().CreateRepeatingTimer(100)
    window.AddObserver("EndEvent", count)
    view.GetInteractor().AddObserver("EndInteractionEvent", note)
    # Python would take what only VTK's objects know of for garbage, and call what is left of it.
    pvtest.kept = [view, window, view.GetInteractor(), count, note, obey]
    return pvtest.failures


try:
    use()
    leave("ready", "ok")
except Exception:
    leave("ready", traceback.format_exc())
