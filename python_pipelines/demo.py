"""The demo's Catalyst script. At each step it makes a VDI of V, and pictures of it from the VDI's
viewpoint and from 5, 20 and 50 degrees away from it. It renders the volume from the same viewpoints and
compares each pair of pictures by SSIM.

Environment: VDI_PLUGIN (the plugin, which the adaptor sets), VDI_OUTPUT (the folder), VDI_WIDTH and
VDI_HEIGHT (of the pictures), VDI_LIVE (1: browsers show the VDIs and may steer; the link is in
vdi-stream.link)."""

import os

import numpy as np
from paraview import catalyst
from paraview.simple import *  # noqa: F403
from paraview.modules.vtkRemotingCore import vtkProcessModule
from skimage.metrics import structural_similarity
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkIOImage import vtkPNGWriter

LoadPlugin(os.environ["VDI_PLUGIN"], remote=False, ns=globals())

OUTPUT = os.environ.get("VDI_OUTPUT", ".")
SIZE = [int(os.environ.get("VDI_WIDTH", 640)), int(os.environ.get("VDI_HEIGHT", 360))]
ANGLES = [0, 5, 20, 50]
BACKGROUND = 24  # grey level, up to 255
IS_ROOT = vtkProcessModule.GetProcessModule().GetPartitionId() == 0

POSITION = np.array([2.05, 1.75, 2.45])
FOCAL_POINT = np.array([0.5, 0.5, 0.5])


def turned(degrees):
    """The camera's position, turned about the focal point around the y axis."""
    angle = np.radians(degrees)
    x, y, z = POSITION - FOCAL_POINT
    return FOCAL_POINT + [x * np.cos(angle) + z * np.sin(angle), y, z * np.cos(angle) - x * np.sin(angle)]


def set_camera(proxy, degrees):
    proxy.CameraPosition = list(turned(degrees))
    proxy.CameraFocalPoint = list(FOCAL_POINT)
    proxy.CameraViewUp = [0, 1, 0]
    proxy.CameraViewAngle = 26
    proxy.Resolution = SIZE


def volume_filter(degrees, picture_only):
    """A VolumetricDepthImage of V from that viewpoint."""
    proxy = VolumetricDepthImage(Input=grid)
    proxy.SelectInputScalars = ["CELLS", "V"]
    proxy.LookupTable = colors
    proxy.ScalarOpacityFunction = opacities
    proxy.ScalarOpacityUnitDistance = 0.04
    proxy.PictureOnly = picture_only
    set_camera(proxy, degrees)
    return proxy


grid = TrivialProducer(registrationName="grid")

colors = GetColorTransferFunction("V")
colors.ColorSpace = "RGB"
colors.RGBPoints = [0.0, 0.05, 0.10, 0.40, 0.12, 0.10, 0.55, 0.85, 0.22, 0.95, 0.90, 0.60,
                    0.30, 0.95, 0.50, 0.15, 0.42, 0.60, 0.05, 0.10]
colors.ScalarRangeInitialized = 1  # keeps ParaView's views, which aren't used here, from moving the points to the data's range
opacities = GetOpacityTransferFunction("V")
opacities.Points = [0.0, 0.0, 0.5, 0.0, 0.06, 0.0, 0.5, 0.0, 0.14, 0.10, 0.5, 0.0,
                    0.24, 0.35, 0.5, 0.0, 0.34, 0.85, 0.5, 0.0, 0.42, 0.95, 0.5, 0.0]
opacities.ScalarRangeInitialized = 1

image = volume_filter(0, False)
seen = {angle: RenderVDI(Input=image) for angle in ANGLES}
truth = {angle: volume_filter(angle, True) for angle in ANGLES}
for angle, proxy in seen.items():
    set_camera(proxy, angle)

extractor = CreateExtractor("VDI", image, registrationName="vdi")
extractor.Writer.FileName = "vdi_{timestep:06d}.vdi"

if os.environ.get("VDI_LIVE") == "1":
    stream = CreateExtractor("VDIStream", image, registrationName="stream")
    stream.Writer.LinkFile = os.path.join(OUTPUT, "vdi-stream.link")
    stream.Writer.Steer = 1
    stream.Writer.SteeringLog = os.path.join(OUTPUT, "vdi-steering.jsonl")

options = catalyst.Options()
options.ExtractsOutputDirectory = OUTPUT

summary = []


def picture_of(proxy, time):
    """Returns the proxy's picture over the background on rank 0, rows from the top, and None on the
    other ranks. Collective."""
    proxy.UpdatePipeline(time)
    data = proxy.GetClientSideObject().GetOutputDataObject(0)
    if not IS_ROOT:
        return None
    if data.GetNumberOfPoints() == 0:
        raise RuntimeError("there is no picture; see the error above")
    rgba = vtk_to_numpy(data.GetPointData().GetArray("RGBA")).reshape(SIZE[1], SIZE[0], 4).astype(float)
    alpha = rgba[..., 3:] / 255.0
    return np.flipud(np.rint(rgba[..., :3] * alpha + BACKGROUND * (1.0 - alpha))).astype(np.uint8)


def write_png(name, picture):
    data = vtkImageData()
    data.SetDimensions(picture.shape[1], picture.shape[0], 1)
    data.GetPointData().SetScalars(numpy_to_vtk(np.flipud(picture).reshape(-1, 3).copy(), deep=True))
    writer = vtkPNGWriter()
    writer.SetFileName(os.path.join(OUTPUT, name))
    writer.SetInputData(data)
    writer.Write()


def catalyst_execute(info):
    image.UpdatePipeline(info.time)
    report = image.Report
    rows = []
    similarities = []
    for angle in ANGLES:
        vdi = picture_of(seen[angle], info.time)
        dvr = picture_of(truth[angle], info.time)
        if not IS_ROOT:
            continue
        rows.append(np.hstack([vdi, dvr]))
        similarities.append(
            structural_similarity(vdi, dvr, channel_axis=2, gaussian_weights=True, sigma=1.5,
                                  use_sample_covariance=False, data_range=255))
    if not IS_ROOT:
        return
    write_png("vdi_%06d.png" % info.timestep, np.vstack(rows))
    for angle, row in zip(ANGLES, rows):
        write_png("vdi_%06d_%02ddeg.png" % (info.timestep, angle), row)
    text = "  ".join("%d deg %.4f" % pair for pair in zip(ANGLES, similarities))
    print("step %d: SSIM of the VDI with volume rendering: %s" % (info.timestep, text), flush=True)
    summary.append((info.timestep, similarities, report))


def catalyst_finalize():
    if not IS_ROOT or not summary:
        return
    print("\nSSIM of the VDI with volume rendering, by degrees from its viewpoint")
    print("  step  " + "  ".join("%6d" % angle for angle in ANGLES))
    for step, similarities, _ in summary:
        print("%6d  " % step + "  ".join("%6.4f" % s for s in similarities))
    print("\nStages of the last VDI on each rank")
    print(summary[-1][2])
