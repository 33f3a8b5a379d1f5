"""Shared by the pvbatch tests: the plugin, sources that assign blocks to ranks, pictures and their
comparison.

Run by ctest through xvfb-run; VDI_PLUGIN names the plugin, VDI_TEST_OUTPUT a folder for pictures. With several ranks only
rank 0 runs the test script; sources run on all ranks, inside Programmable Source."""

import base64
import os
import re
import subprocess
import sys
import tempfile
import zlib

import numpy as np
from paraview import simple
from skimage.metrics import structural_similarity
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkOutputWindow, vtkUnsignedCharArray
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkIOImage import vtkNIFTIImageReader, vtkPNGReader, vtkPNGWriter

simple.LoadPlugin(os.environ["VDI_PLUGIN"], remote=False, ns=simple.__dict__)

OUTPUT = os.environ.get("VDI_TEST_OUTPUT", ".")
BRAINS = "/usr/share/mricron/templates/"

# Runs on every rank. A layered field on the unit cube in BLOCKS^3 blocks, dealt out by LAYOUT ("random", "slabs",
# "interleaved"), as point data with shared points or cell data, of a numpy type; `self` is the Programmable Source.
BLOCKS_SCRIPT = """
import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonDataModel import vtkImageData, vtkPartitionedDataSet
from vtkmodules.vtkParallelCore import vtkMultiProcessController
controller = vtkMultiProcessController.GetGlobalController()
rank, ranks = controller.GetLocalProcessId(), controller.GetNumberOfProcesses()
count, cells, layout, kind, as_cells = {count}, {cells}, "{layout}", "{kind}", {as_cells}
n = count * cells
owners = np.random.RandomState(11).randint(0, ranks, count ** 3)
if layout == "interleaved":
    owners = np.arange(count ** 3) % ranks
elif layout == "slabs":
    owners = np.arange(count ** 3) * ranks // count ** 3
output = self.GetPartitionedDataSetOutput() if hasattr(self, "GetPartitionedDataSetOutput") else self.GetOutputDataObject(0)
mine = np.flatnonzero(owners == rank)
blocks = []
for index in mine:
    at = np.array([index % count, index // count % count, index // count ** 2]) * cells
    image = vtkImageData()
    image.SetOrigin(*(at / n))
    image.SetSpacing(1 / n, 1 / n, 1 / n)
    image.SetDimensions(cells + 1, cells + 1, cells + 1)
    values = np.arange(cells) + 0.5 if as_cells else np.arange(cells + 1)
    z, y, x = np.meshgrid(*[(values + at[axis]) / n for axis in (2, 1, 0)], indexing="ij")
    field = 0.5 + 0.5 * np.sin(9 * x + 2 * np.sin(5 * y)) * np.cos(7 * z + 3 * x) * np.cos(4 * y)
    scale = 1.0 if kind == "float32" else 200.0 if kind == "uint8" else 60000.0
    array = numpy_to_vtk((field * scale).astype(kind).ravel(), deep=True)
    array.SetName("scalars")
    (image.GetCellData() if as_cells else image.GetPointData()).SetScalars(array)
    blocks.append(image)
for number, image in enumerate(blocks):
    output.SetBlock(number, image)
"""

# A ProgrammableFilter's RequestInformationScript: the time steps 0, 1 and 2.
STEPS = """
executive, info = self.GetExecutive(), self.GetOutputInformation(0)
info.Remove(executive.TIME_STEPS())
for step in range(3):
    info.Append(executive.TIME_STEPS(), float(step))
info.Remove(executive.TIME_RANGE())
info.Append(executive.TIME_RANGE(), 0.0)
info.Append(executive.TIME_RANGE(), 2.0)
"""


def vdi_in_page(page, path):
    """The .vdi file that is inside a page (docs/adr/the-page-is-one-file.md), written to `path`."""
    with open(page, encoding="utf-8") as file:
        found = re.findall(r'<script class="vdi-frame"[^>]* data-size="(\d+)">([^<]*)</script>', file.read())
    check(len(found) == 1, "a page has one VDI, not %d" % len(found))
    data = zlib.decompress(base64.b64decode(found[0][1]), wbits=-15)
    check(len(data) == int(found[0][0]), "the page's VDI takes as many bytes as the page says")
    with open(path, "wb") as file:
        file.write(data)
    return path


def blocks_source(layout, count=4, cells=8, kind="float32", as_cells=False):
    """A multiblock data set of which each rank makes its own blocks."""
    source = simple.ProgrammableSource()
    source.OutputDataSetType = "vtkMultiblockDataSet"
    source.Script = BLOCKS_SCRIPT.format(count=count, cells=cells, layout=layout, kind=kind, as_cells=as_cells)
    source.UpdatePipeline()
    return source


def image_of(values, name, spacing=(1, 1, 1), origin=(0, 0, 0), as_cells=False):
    """A lattice with an array of the values [z][y][x], of its points or its cells."""
    image = vtkImageData()
    image.SetDimensions(*[n + int(as_cells) for n in values.shape[::-1]])
    image.SetSpacing(*spacing)
    image.SetOrigin(*origin)
    array = numpy_to_vtk(np.ascontiguousarray(values).ravel(), deep=True)
    array.SetName(name)
    (image.GetCellData() if as_cells else image.GetPointData()).SetScalars(array)
    return image


def producer_of(data):
    producer = simple.TrivialProducer()
    producer.GetClientSideObject().SetOutput(data)
    return producer


def waves(shape, spacing):
    """Smooth values [z][y][x] from 0 to 250."""
    z, y, x = np.meshgrid(*[np.arange(n) * s for n, s in zip(shape, spacing[::-1])], indexing="ij")
    values = 125 + 125 * np.sin(0.15 * x + np.sin(0.12 * y)) * np.cos(0.11 * z + 0.05 * x) * np.cos(0.09 * y)
    return values.astype(np.float32)


def source_of_values(values, name, *place, **more):
    """An updated source of a lattice (image_of), and the place of the lattice's middle."""
    image = image_of(values, name, *place, **more)
    source = producer_of(image)
    source.UpdatePipeline()
    return source, np.array(image.GetCenter())


def brain_of(name, every=1):
    """Values [z][y][x] of a brain of the package mricron-data, the largest of which is 250, and their spacing. Keeps each
    `every`th voxel along an axis."""
    path = os.path.join(BRAINS, name + ".nii.gz")
    if not os.path.exists(path):
        print("FAILED  no brain: install the package mricron-data", flush=True)
        os._exit(1)
    reader = vtkNIFTIImageReader()
    reader.SetFileName(path)
    reader.Update()
    image = reader.GetOutput()
    values = vtk_to_numpy(image.GetPointData().GetScalars()).reshape(image.GetDimensions()[::-1]).astype(float)
    values = values[::every, ::every, ::every]
    return values * 250 / values.max(), [every * s for s in image.GetSpacing()]


def make_vdi(name, *options):
    """The path of a .vdi file in OUTPUT, which `vdi generate` makes."""
    path = os.path.join(OUTPUT, name)
    subprocess.run([os.environ["VDI_TOOL"], "generate", "-o", path, *options], check=True, stdout=subprocess.DEVNULL)
    return path


def set_colors(name, low, high, peak=0.8):
    """A three-hue colour map with a ramp of opacity, for both ParaView's volume rendering and ours."""
    def at(share):
        return low + share * (high - low)

    colors = simple.GetColorTransferFunction(name)
    colors.ColorSpace = "RGB"
    colors.RGBPoints = [at(0), 0.1, 0.2, 0.9, at(0.5), 0.9, 0.9, 0.2, at(1), 0.9, 0.1, 0.1]
    opacity = simple.GetOpacityTransferFunction(name)
    opacity.Points = [at(0), 0, 0.5, 0, at(0.35), 0, 0.5, 0, at(0.7), 0.2, 0.5, 0, at(1), peak, 0.5, 0]
    return colors, opacity


def make_view(size, position, focal_point, parallel_scale=None):
    view = simple.CreateView("RenderView")
    view.ViewSize = size
    view.OrientationAxesVisibility = 0
    view.UseColorPaletteForBackground = 0
    view.Background = [0, 0, 0]
    view.CameraPosition, view.CameraFocalPoint, view.CameraViewUp = position, focal_point, [0, 1, 0]
    view.CameraViewAngle = 30
    view.CameraParallelProjection = 0 if parallel_scale is None else 1
    if parallel_scale is not None:
        view.CameraParallelScale = parallel_scale
    return view


def paraview_volume(source, view, association, name, unit_distance, keep_range=False, **properties):
    """ParaView's own volume rendering, unshaded unless `properties` of the representation say otherwise, as an array of
    [rows][columns][3] bytes from the top. Stretches the colour map over the data's range, unless `keep_range`."""
    size, camera = list(view.ViewSize), [list(view.CameraPosition), list(view.CameraFocalPoint), view.CameraParallelScale]
    colors, opacity = simple.GetColorTransferFunction(name), simple.GetOpacityTransferFunction(name)
    points = list(colors.RGBPoints), list(opacity.Points)
    representation = simple.Show(source, view)
    representation.SetRepresentationType("Volume")
    simple.ColorBy(representation, (association, name))
    if keep_range:
        colors.RGBPoints, opacity.Points = points
    representation.ScalarOpacityUnitDistance = unit_distance
    representation.Shade = 0
    for key, value in properties.items():
        setattr(representation, key, value)
    simple.HideScalarBarIfNotNeeded(simple.GetColorTransferFunction(name), view)
    view.ViewSize = [64, 36]
    simple.Render(view)  # the first picture of a view moves its camera; a small one is quick
    view.ViewSize = size
    view.CameraPosition, view.CameraFocalPoint, view.CameraParallelScale = camera
    return screenshot(view, None, size)


def filter_with(source, association, name, **properties):
    """VolumetricDepthImage of an array, with these properties."""
    image = simple.VolumetricDepthImage(Input=source)
    image.SelectInputScalars = [association, name]
    for key, value in properties.items():
        setattr(image, key, value)
    return image


def vdi_filter(source, view, association, name, unit_distance, **properties):
    """VolumetricDepthImage with the view's camera and size."""
    camera = {key: getattr(view, key) for key in ("CameraPosition", "CameraFocalPoint", "CameraViewUp", "CameraViewAngle",
                                                  "CameraParallelProjection", "CameraParallelScale")}
    return filter_with(source, association, name, **{"ScalarOpacityUnitDistance": unit_distance, "Resolution": view.ViewSize,
                                                     **camera, **properties})


def picture(proxy):
    """The RGBA of a proxy's output over black, [rows][columns][3] bytes from the top."""
    proxy.UpdatePipeline()
    data = proxy.GetClientSideObject().GetOutputDataObject(0)
    if data.GetNumberOfPoints() == 0:
        return None
    width, height, _ = data.GetDimensions()
    rgba = vtk_to_numpy(data.GetPointData().GetArray("RGBA")).reshape(height, width, 4).astype(float)
    return np.flipud(np.rint(rgba[..., :3] * rgba[..., 3:] / 255)).astype(np.uint8)


DEGREES = "\u00b0"


def texts_in(view):
    """The texts of the representation VDI in a view, without line breaks."""
    actors = view.GetClientSideObject().GetNonCompositedRenderer().GetActors2D()
    actors.InitTraversal()
    texts = [actors.GetNextActor2D() for _ in range(actors.GetNumberOfItems())]
    texts = [text.GetInput() for text in texts if text.IsA("vtkTextActor") and text.GetVisibility()]
    return [text.replace("\n", " ") for text in texts if "VDI" in text]


def message_in(view):
    """The representation's notices and faults in a view; "" if there are none."""
    return " ".join(text for text in texts_in(view) if DEGREES not in text)


def angle_in(view):
    """The representation's text about how far the view is turned; "" if there is none."""
    return " ".join(text for text in texts_in(view) if DEGREES in text)


def text_boxes(view, part="VDI"):
    """The lowest and highest row of each of these texts that contains `part`."""
    renderer = view.GetClientSideObject().GetNonCompositedRenderer()
    boxes = []
    for actor in renderer.GetViewProps():
        if actor.IsA("vtkTextActor") and actor.GetVisibility() and part in actor.GetInput():
            box = [0, 0, 0, 0]
            actor.GetBoundingBox(renderer, box)
            middle = actor.GetPositionCoordinate().GetComputedViewportValue(renderer)[1]
            boxes.append([middle + box[2], middle + box[3]])
    return boxes


def pixels(window, front=1):
    """The window's pixels, without rendering."""
    data = vtkUnsignedCharArray()
    width, height = window.GetSize()
    window.GetPixelData(0, 0, width - 1, height - 1, front, data, 0)
    return vtk_to_numpy(data).reshape(height, width, -1)[::-1, :, :3].copy()


def screenshot(view, name, size):
    """A picture of the view, [rows][columns][3] bytes from the top. Its file stays in OUTPUT if it has a name."""
    path = os.path.join(OUTPUT, name or "screenshot_{}.png".format(os.getpid()))  # tests run side by side
    simple.SaveScreenshot(path, view, ImageResolution=size)
    seen = read_png(path)
    if name is None:
        os.remove(path)
    return seen


def read_png(path):
    reader = vtkPNGReader()
    reader.SetFileName(path)
    reader.Update()
    data = reader.GetOutput()
    width, height, _ = data.GetDimensions()
    scalars = vtk_to_numpy(data.GetPointData().GetScalars())
    return np.flipud(scalars.reshape(height, width, -1)[..., :3])


def write_png(name, rgb):
    data = vtkImageData()
    data.SetDimensions(rgb.shape[1], rgb.shape[0], 1)
    data.GetPointData().SetScalars(numpy_to_vtk(np.flipud(rgb).reshape(-1, 3).copy(), deep=True))
    writer = vtkPNGWriter()
    writer.SetFileName(os.path.join(OUTPUT, name))
    writer.SetInputData(data)
    writer.Write()


def ssim(a, b):
    return structural_similarity(a, b, channel_axis=2, gaussian_weights=True, sigma=1.5, use_sample_covariance=False,
                                 data_range=255)


def wrong_share(a, b, object_only=None):
    """Share of the object's pixels (those that aren't black in `object_only`) with a channel off by more than 16."""
    off = np.abs(a.astype(int) - b.astype(int)).max(axis=2) > 16
    inside = (object_only if object_only is not None else b).max(axis=2) > 8
    return off[inside].mean()


class Messages:
    """The texts of VTK's events, errors or warnings, while this context is entered."""

    def __init__(self, *events):
        self.events, self.texts = events, []

    def __enter__(self):
        def note(caller, event, text):
            self.texts.append(text)

        note.CallDataType = "string0"
        self.observers = [vtkOutputWindow.GetInstance().AddObserver(event, note) for event in self.events]
        return self.texts

    def __exit__(self, *error):
        for observer in self.observers:
            vtkOutputWindow.GetInstance().RemoveObserver(observer)


def errors_of(action):
    """The errors of VTK and Python while `action` runs."""
    with Messages("ErrorEvent") as texts:
        try:
            action()
        except RuntimeError as error:
            texts.append(str(error))
    return texts


def errors_of_update(proxy):
    """The errors of an update. It has a time: without one, ParaView skips the update when nothing has changed."""
    return "\n".join(errors_of(lambda: proxy.UpdatePipeline(0.0)))


def standard_error(action):
    """The text that `action` writes to the standard error."""
    with tempfile.TemporaryFile("w+") as file:
        own = os.dup(2)
        os.dup2(file.fileno(), 2)
        try:
            action()
        finally:
            os.dup2(own, 2)
            os.close(own)
        file.seek(0)
        return file.read()


failures = []


def check(good, what):
    print(("ok      " if good else "FAILED  ") + what, flush=True)
    if not good:
        failures.append(what)


def finish():
    sys.stdout.flush()
    if failures:
        # Satellites wait in their event loop; leaving by os._exit makes mpirun end them.
        os._exit(1)
