"""Runs inside the real ParaView (--script, which sets no __file__): loads the plugin and prepares
the view. From then on it notes what the view shows after each drag of the mouse: view.png, and
camera.json with the camera. In between it runs the requested calls (orbit_inside.py). orbit.py
drives the window."""

import json
import os
import sys
import traceback

sys.path[:0] = [os.environ["VDI_TEST_SOURCE"], os.path.join(os.path.dirname(os.environ["VDI_TEST_SOURCE"]), "window")]
from inside import OUTPUT, answer, kept, leave  # noqa: E402


def use():
    import orbit_inside  # loads the plugin
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

    answer(view.GetInteractor(), vars(orbit_inside))
    window.AddObserver("EndEvent", count)
    view.GetInteractor().AddObserver("EndInteractionEvent", note)
    kept.extend([view, window, count, note])


try:
    use()
    leave("ready", "ok")
except Exception:
    leave("ready", traceback.format_exc())
