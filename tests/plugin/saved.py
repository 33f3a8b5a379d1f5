"""Tests the settings of a filter that ParaView saves: as defaults of later filters, and in scripts
that make the same VDI anew."""

import re

import numpy as np

import pvtest
from paraview import simple, smstate
from paraview.modules.vtkRemotingServerManager import vtkSMSettings
from pvtest import check

SIZE, POSITION = [120, 90], [40, 30, 50]


def shown_wavelet(**properties):
    """A wavelet that the active view shows as a volume."""
    wavelet = simple.Wavelet(WholeExtent=[-8, 8, -8, 8, -8, 8])
    view = pvtest.make_view(SIZE, POSITION, [1, 0, -1])
    pvtest.paraview_volume(wavelet, view, "POINTS", "RTData", 2.5, **properties)
    simple.SetActiveView(view)
    return wavelet, view


def save_as_default(proxy):
    """Saves the settings as the panel's button Save current settings as default does."""
    vtkSMSettings.GetInstance().SetProxySettings(proxy.SMProxy, None, True)


def defaults():
    """The first update of a filter takes what its view shows, whatever an earlier filter took."""
    wavelet, view = shown_wavelet(Shade=1, Diffuse=0.6, UseCropping=1, CroppingScale=[0.5, 0.6, 0.7],
                                  BlendMode="Isosurface", IsosurfaceValues=[150])
    first = simple.VolumetricDepthImage(Input=wavelet, PictureOnly=1, Supersegments=12)
    first.UpdatePipeline()
    first.TimeStep = 7
    check(first.Shade == 1 and first.Cropping == 1 and first.BlendMode == "Isosurface" and
          list(first.Resolution) == SIZE and list(first.CameraPosition) == POSITION, "the filter takes what the view shows")
    rendered = simple.RenderVDI(Input=first, Resolution=[64, 48], CameraPosition=POSITION, CameraFocalPoint=[1, 0, -1],
                                CameraViewUp=[0, 0, 1], CameraViewAngle=20, CameraParallelProjection=1,
                                CameraParallelScale=9)
    save_as_default(first)
    save_as_default(rendered)
    fresh = simple.VolumetricDepthImage(Input=simple.Wavelet())
    again = simple.RenderVDI(Input=fresh)
    check(fresh.Supersegments == 12 and fresh.PictureOnly == 1 and list(again.Resolution) == [64, 48],
          "later filters begin with the settings that were saved as default")
    taken = ("ScalarOpacityUnitDistance", "Resolution", "Shade", "Ambient", "Diffuse", "Lights", "Cropping", "CroppingBox",
             "BlendMode", "IsosurfaceValues", "TimeStep")
    camera = ("CameraPosition", "CameraFocalPoint", "CameraViewUp", "CameraViewAngle", "CameraParallelProjection",
              "CameraParallelScale")
    kept = [name for name in taken + camera if not fresh.SMProxy.GetProperty(name).IsValueDefault()]
    kept += [name for name in camera if not again.SMProxy.GetProperty(name).IsValueDefault()]
    check(not kept, "later filters have no earlier filter's viewpoint, nor its display settings; kept: %s" % kept)
    vtkSMSettings.GetInstance().ClearAllSettings()


DISPLAY = dict(Shade=1, Diffuse=0.6, UseCropping=1, CroppingScale=[0.5, 0.6, 0.7])


def sets(script, name, setting):
    """Whether the script sets the property, alone or, as from ParaView 6 on, together with others
    by Set."""
    together = "".join(re.findall(r"^%s\.Set\((.*?)^\)" % name, script, re.MULTILINE | re.DOTALL))
    return bool(re.search(r"^%s\.%s = " % (name, setting), script, re.MULTILINE) or
                re.search(r"^ *%s=" % setting, together, re.MULTILINE))


def python_state():
    """A script leaves out values that are the default. The volume's own display settings mustn't take their place."""
    wavelet, view = shown_wavelet()
    image = simple.VolumetricDepthImage(registrationName="vdi", Input=wavelet)
    simple.Show(image, view)
    simple.Render(view)
    volume = simple.GetRepresentation(wavelet, view)
    for name, value in DISPLAY.items():
        setattr(volume, name, value)
    view.UseLight = 0  # other lights
    simple.AddLight(view=view).Coords = "Headlight"
    expected = pvtest.picture(image)
    script = smstate.get_state()
    check(expected.max() > 60 and sets(script, "vdi", "Resolution") and not sets(script, "vdi", "Shade")
          and sets(script, r"\w+", "Shade"),
          "the state has the VDI's size, and, of the volume's display, only the shading")
    simple.ResetSession()
    exec(script, {})
    again = simple.FindSource("vdi")
    seen = pvtest.picture(again)
    check(again.Shade == 0 and again.Cropping == 0 and len(again.Lights) == 0,
          "the script's VDI keeps its display settings: Shade %d, Cropping %d, %d numbers of lights"
          % (again.Shade, again.Cropping, len(again.Lights)))
    check(np.abs(seen.astype(int) - expected).max() <= 1, "the script makes the same VDI")
    simple.ResetSession()


def what_is_set():
    """Checks what the first update takes of the view's display settings if camera, size or both are set."""
    wavelet, view = shown_wavelet(**DISPLAY)
    camera = dict(CameraPosition=POSITION, CameraFocalPoint=[1, 0, -1])
    for what, properties, takes in (("nothing", {}, 1), ("a camera", camera, 1), ("a size", dict(Resolution=[64, 48]), 1),
                                    ("camera and size", dict(camera, Resolution=[64, 48]), 0)):
        image = simple.VolumetricDepthImage(Input=wavelet, **properties)
        image.UpdatePipeline()
        check(image.Shade == takes and image.Cropping == takes and (image.ScalarOpacityUnitDistance == 2.5) == bool(takes),
              "a filter of which %s is set takes %s of the volume's display settings" % (what, "all" if takes else "none"))
        check(list(image.CameraPosition) == POSITION, "a filter of which %s is set has the view's camera" % what)


defaults()
python_state()
what_is_set()
pvtest.finish()
