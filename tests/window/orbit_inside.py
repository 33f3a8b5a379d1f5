"""The calls that orbit.py makes inside ParaView (orbit_notes.py), without the mouse. Each returns
at once, and its effect then shows in the window."""

import numpy as np
import pvtest
from paraview import servermanager, simple
from paraview.modules.vtkRemotingServerManager import vtkSMPropertyHelper
from pvtest import pixels
from vtkmodules.vtkCommonCore import vtkCollection

CENTER = [0.5, 0.5, 0.5]
shown = {}  # what the calls leave for the next ones


def views_in(view):
    """The proxies of a comparative view's views; of any other the view's."""
    if not hasattr(view.SMProxy, "GetViews"):
        return [view.SMProxy]
    views = vtkCollection()
    view.SMProxy.GetViews(views)
    return [views.GetItemAsObject(index) for index in range(views.GetNumberOfItems())]


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
    display = simple.Show(shown["reader"], view)
    display.SetRepresentationType("VDI")
    display.VDIAngle = 0  # screenshots don't have it
    simple.Render(view)  # the first picture of a view moves its camera
    place(view)
    simple.Render(view)


def what_angle_is_said():
    return pvtest.angle_in(simple.GetActiveView())


def be_small(size):
    """Hides all sources in the view, and gives it this size from the next call on."""
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
    """Goes to a time step and renders once."""
    shown["view"].ViewTime = shown["reader"].TimestepValues[step]
    shown["view"].SMProxy.StillRender()


def sees(step):
    return same(pixels(shown["view"].GetRenderWindow()), shown["steps"][step])


def show_comparative():
    simple.GetLayout(shown["view"]).PreviewMode = [0, 0]
    layout = simple.CreateLayout("Comparative")
    view = simple.CreateView("ComparativeRenderView")
    simple.AssignViewToLayout(view, layout, 0)
    display = simple.Show(shown["reader"], view)
    display.SetRepresentationType("VDI")
    display.VDIAngle = 0
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


def show_made():
    """A VDI that is made here, in place of what is shown."""
    view = shown["view"]
    for source in simple.GetSources().values():
        simple.Hide(source, view)
    wavelet = simple.Wavelet()
    wavelet.UpdatePipeline()
    shown["vdi"] = image = simple.VolumetricDepthImage(Input=wavelet, Resolution=[160, 120])
    simple.Show(image, view)
    simple.Render(view)
    view.CameraPosition, view.CameraFocalPoint, view.CameraViewUp = [45, 30, 60], [0, 0, 0], [0, 1, 0]
    simple.Render(view)


def is_held():
    """Whether a VDI is being made in the background, or will be soon."""
    proxy = shown["vdi"].SMProxy
    proxy.UpdatePropertyInformation()
    return proxy.GetProperty("Held").GetElement(0) == 1


def screenshot(name):
    simple.SaveScreenshot(pvtest.os.path.join(pvtest.OUTPUT, name), shown["view"])
    return pvtest.read_png(pvtest.os.path.join(pvtest.OUTPUT, name))


def edit_and_capture(peak, prepares):
    """Takes a screenshot right after an edit of the opacity, or when the VDI is being made. Returns
    whether the window was held until then, and whether the picture differs from the one before the
    edit."""
    before = screenshot("before_edit.png")
    pvtest.set_colors("RTData", 40, 270, peak)
    if prepares:
        shown["vdi"].SMProxy.InvokeCommand("Prepare")
    held = is_held()
    shown["captured"] = screenshot("after_edit.png")
    return [held, not same(before, shown["captured"])]


def captures_the_same():
    return same(screenshot("later.png"), shown["captured"])


def compare_distances(distances):
    """The VDI in a comparative view, with another unit distance in each of two cells."""
    layout = simple.CreateLayout("Distances")
    view = simple.CreateView("ComparativeRenderView")
    simple.AssignViewToLayout(view, layout, 0)
    view.Dimensions = [2, 1]
    simple.Show(shown["vdi"], view)
    simple.Render(view)
    cue = servermanager.ProxyManager().NewProxy("animation", "ComparativeAnimationCue")
    for name, value in (("AnimatedProxy", shown["vdi"].SMProxy), ("AnimatedPropertyName", "ScalarOpacityUnitDistance")):
        vtkSMPropertyHelper(cue, name).Set(value)
    cue.UpdateVTKObjects()
    cue.UpdateXRange(0, *distances)
    vtkSMPropertyHelper(view.SMProxy, "Cues").Set(0, cue)
    view.SMProxy.UpdateVTKObjects()
    simple.Render(view)
    shown["comparative"] = view


def compared():
    """The mean brightness of each of the two cells."""
    return [float(pixels(view.GetRenderWindow()).mean()) for view in views_in(shown["comparative"])]


def show_in_two_views():
    """Shows the VDI in two views of one layout, 90 degrees apart and each far from the VDI's viewpoint."""
    first, image = shown["view"], shown["vdi"]
    layout = simple.GetLayout(first)
    layout.SplitHorizontal(layout.GetViewLocation(first), 0.5)
    second = simple.CreateView("RenderView")
    simple.AssignViewToLayout(second, layout, 2)
    simple.Show(image, second)
    shown["views"], shown["makings"] = [first, second], 0
    for view, position in zip(shown["views"], ([0, 0, 80], [80, 0, 0])):
        simple.Render(view)
        view.CameraPosition, view.CameraFocalPoint, view.CameraViewUp = position, [0, 0, 0], [0, 1, 0]
        simple.Render(view)
    image.CameraPosition, image.CameraFocalPoint = [-50, 60, -50], [0, 0, 0]
    simple.Render(first)
    shown["values"] = values_of(image)
    image.GetClientSideObject().AddObserver("EndEvent", lambda *_: count_making())


def values_of(image):
    """Identifies the output's values, which are new each time the VDI is made."""
    array = image.GetClientSideObject().GetOutputDataObject(0).GetPointData().GetArray(0)
    return array.__this__ if array else ""


def count_making():
    """An update that finds its VDI made hands out the same values."""
    values = values_of(shown["vdi"])
    if values != shown["values"]:
        shown.update(values=values, makings=shown["makings"] + 1)


def forget_makings():
    shown["makings"] = 0


def turn_auto(on):
    shown["vdi"].Auto = on
    shown["vdi"].UpdateVTKObjects()


def move(index, position):
    view = shown["views"][index]
    view.CameraPosition = position
    simple.Render(view)


def activate(index):
    simple.SetActiveView(shown["views"][index])


def makings_from(index):
    """The number of times that the VDI has been made, if it is from that view by now; otherwise 0."""
    wanted = shown["views"][index].GetActiveCamera().GetPosition()
    made = shown["vdi"].CameraPosition
    return 0 if is_held() or max(abs(a - b) for a, b in zip(wanted, made)) > 1e-6 else shown["makings"]


def close_second_view():
    """Closes the second view and deletes the filter."""
    simple.Delete(shown.pop("vdi"))
    second, layout = shown["views"][1], simple.GetLayout(shown["view"])
    cell = layout.GetViewLocation(second)
    simple.Delete(second)
    layout.Collapse(cell)
