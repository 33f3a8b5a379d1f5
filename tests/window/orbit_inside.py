"""What orbit.py asks for inside ParaView (orbit_notes.py), without the mouse: each call returns at once, and what comes of it
shows in the window by itself."""

import numpy as np
import pvtest
from paraview import simple
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkCollection, vtkUnsignedCharArray

CENTER = [0.5, 0.5, 0.5]
shown = {}  # what the calls leave for the next ones


def views_in(view):
    """The proxies of a comparative view's views; of any other the view's."""
    if not hasattr(view.SMProxy, "GetViews"):
        return [view.SMProxy]
    views = vtkCollection()
    view.SMProxy.GetViews(views)
    return [views.GetItemAsObject(index) for index in range(views.GetNumberOfItems())]


def pixels(window, front=1):
    """What the window shows, without rendering."""
    data = vtkUnsignedCharArray()
    width, height = window.GetSize()
    window.GetPixelData(0, 0, width - 1, height - 1, front, data, 0)
    return vtk_to_numpy(data).reshape(height, width, -1)[::-1, :, :3].copy()


def in_full(view):
    """A picture as screenshots are taken."""
    window = view.GetRenderWindow()
    window.SetSwapBuffers(0)
    view.StillRender()
    picture = pixels(window, 0)
    window.SetSwapBuffers(1)
    return picture


def same(one, other):
    return one.shape == other.shape and bool(np.abs(one.astype(int) - other).max() <= 2)


def place(view):
    view.CameraPosition, view.CameraFocalPoint, view.CameraViewUp = [2.2, 1.4, 2.0], CENTER, [0, 1, 0]
    view.OrientationAxesVisibility = view.CenterAxesVisibility = view.UseColorPaletteForBackground = 0
    view.Background = [0, 0, 0]


def show(files, view):
    shown["reader"] = simple.OpenDataFile(files)
    simple.Show(shown["reader"], view).SetRepresentationType("VDI")
    simple.Render(view)  # the first picture of a view moves its camera
    place(view)
    simple.Render(view)


def be_small(size):
    """From the next call on."""
    shown["view"] = view = simple.GetActiveView()
    for source in simple.GetSources().values():
        simple.Hide(source, view)
    simple.GetLayout(view).PreviewMode = size


def show_steps(files):
    view = shown["view"]
    show(files, view)
    shown["steps"] = []
    for step in range(len(files)):
        view.ViewTime = shown["reader"].TimestepValues[step]
        shown["steps"].append(in_full(view.SMProxy))
    simple.Render(view)
    return [list(view.GetRenderWindow().GetSize()), float(shown["steps"][0].std()), same(*shown["steps"][:2])]


def go_to(step):
    """And renders once."""
    shown["view"].ViewTime = shown["reader"].TimestepValues[step]
    shown["view"].SMProxy.StillRender()


def sees(step):
    return same(pixels(shown["view"].GetRenderWindow()), shown["steps"][step])


def show_comparative():
    simple.GetLayout(shown["view"]).PreviewMode = [0, 0]
    layout = simple.CreateLayout("Comparative")
    view = simple.CreateView("ComparativeRenderView")
    simple.AssignViewToLayout(view, layout, 0)
    simple.Show(shown["reader"], view).SetRepresentationType("VDI")
    simple.Render(view)
    place(view)
    simple.Render(view)
    shown["comparative"] = view


def comparative_is_whole():
    views = views_in(shown["comparative"])
    seen = [pixels(view.GetRenderWindow()) for view in views]
    for index, picture in enumerate(seen):
        pvtest.write_png("comparative_{}.png".format(index), picture)
    return [len(views), min(float(picture.std()) for picture in seen),
            [same(picture, in_full(view)) for picture, view in zip(seen, views)]]


def close_comparative():
    layout = simple.GetLayout(shown["comparative"])
    simple.Delete(shown.pop("comparative"))
    simple.RemoveLayout(layout)


def show_and_lose(file, lose):
    """A VDI whose picture in full loses each device, while there's the file `lose`."""
    view = shown["view"]
    simple.SetActiveView(view)
    simple.Hide(shown["reader"], view)
    open(lose, "w").close()
    shown["frames"] = 0
    view.GetRenderWindow().AddObserver("EndEvent", lambda *_: shown.update(frames=shown["frames"] + 1))
    show([file], view)


def what_is_said():
    picture = pixels(shown["view"].GetRenderWindow())
    pvtest.write_png("said.png", picture)
    return [pvtest.message_in(shown["view"]), float(picture.std()), shown["frames"]]
