"""Compares the arrays of strided.c with one that has the same values in order, and writes to the
one that is used in place. Makes VDIs of some arrays, which are equal, without copies of their
values."""

import os

import numpy as np
from paraview import catalyst
from paraview.simple import *  # noqa: F403
from vtkmodules.util.numpy_support import vtk_to_numpy

_, compared = catalyst.get_args()  # --compare NAME
grid = TrivialProducer(registrationName="grid")
image = VolumetricDepthImage(Input=grid)
image.SelectInputScalars = ["CELLS", "untouched"]
image.Resolution = [64, 48]
others = {name: VolumetricDepthImage(Input=grid, Resolution=[64, 48]) for name in (compared, "partial", "shifted")}
for name, other in others.items():
    other.SelectInputScalars = ["CELLS", name]
    other.CameraPosition, other.CameraFocalPoint = [60, 50, 70], [20, 8, 9]
    other.LookupTable, other.ScalarOpacityFunction = GetColorTransferFunction("all"), GetOpacityTransferFunction("all")
image.CameraPosition, image.CameraFocalPoint = [60, 50, 70], [20, 8, 9]
image.LookupTable, image.ScalarOpacityFunction = GetColorTransferFunction("all"), GetOpacityTransferFunction("all")
extractor = CreateExtractor("VDI", image, registrationName="vdi")
extractor.Writer.FileName = "vdi_{timestep:06d}.vdi"
options = catalyst.Options()
options.ExtractsOutputDirectory = os.environ["VDI_OUTPUT"]


def check(name, values, wanted):
    if values.dtype != wanted.dtype or not np.array_equal(values, wanted):
        raise RuntimeError("the array '%s' has %s, not %s" % (name, values[:5], wanted[:5]))


def lists(filter):
    """The VDI's arrays, which the first rank has."""
    output = filter.GetClientSideObject().GetOutputDataObject(0)
    fields = output.GetFieldData()
    names = [fields.GetArrayName(i) for i in range(fields.GetNumberOfArrays())]
    of_lists = [name for name in names if name in ("VDI.offsets", "VDI.codes", "VDI.depthCode")]
    return {name: vtk_to_numpy(fields.GetArray(name)).tobytes() for name in of_lists}


def catalyst_execute(info):
    grid.UpdatePipeline(info.time)
    block = grid.GetClientSideObject().GetOutputDataObject(0).GetPartition(0)
    image.UpdatePipeline(info.time)
    for other in others.values():
        other.UpdatePipeline(info.time)
    for name in ("untouched", "partial", "shifted"):
        array = block.GetCellData().GetArray(name)
        in_place = "VDI_ISOLATION" not in os.environ  # a separate process has values in order
        if in_place and array is not None and array.GetActualMemorySize() != 0:
            raise RuntimeError("the filter has copied '%s'" % name)
    if lists(image) != lists(others[compared]):
        raise RuntimeError("the VDI differs from that of values in order")

    def values(name):
        return vtk_to_numpy(block.GetCellData().GetArray(name))

    plain = values(compared)
    if plain[0] < 1000 * info.timestep or plain.size != 20 * 17 * 18:
        raise RuntimeError("the values aren't this step's")
    for name in ("in order", "interleaved", "padded", "z fastest", "with halo", "backwards", "packed"):
        check(name, values(name), plain)
    check("vectors", values("vectors"), plain[:, None] + np.arange(3))
    check("integers", values("integers"), (4 * plain).astype(np.int64) + 2 ** 40)
    check("one", values("one"), np.full_like(plain, plain[0]))
    values("in order")[3 + 20 * (2 + 17 * 1)] = -info.timestep
