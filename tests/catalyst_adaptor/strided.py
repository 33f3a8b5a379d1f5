"""Compares the arrays of strided.c with one that has the same values in order, writes to the one that is used where it is, and
makes a VDI of one that isn't."""

import os

import numpy as np
from paraview import catalyst
from paraview.simple import *  # noqa: F403
from vtkmodules.util.numpy_support import vtk_to_numpy

_, compared = catalyst.get_args()  # --compare NAME
grid = TrivialProducer(registrationName="grid")
image = VolumetricDepthImage(Input=grid)
image.SelectInputScalars = ["CELLS", "z fastest"]
image.Resolution = [64, 48]
extractor = CreateExtractor("VDI", image, registrationName="vdi")
extractor.Writer.FileName = "vdi_{timestep:06d}.vdi"
options = catalyst.Options()
options.ExtractsOutputDirectory = os.environ["VDI_OUTPUT"]


def check(name, values, wanted):
    if values.dtype != wanted.dtype or not np.array_equal(values, wanted):
        raise RuntimeError("the array '%s' has %s, not %s" % (name, values[:5], wanted[:5]))


def catalyst_execute(info):
    grid.UpdatePipeline(info.time)
    block = grid.GetClientSideObject().GetOutputDataObject(0).GetPartition(0)

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
