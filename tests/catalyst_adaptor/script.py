"""Makes a VDI of V at each step and checks its picture. VDI_TEST_FAIL: then "raise:STEP:RANK" raises an exception on
that rank, and "exit:STEP:RANK" calls sys.exit, so that the step's extract isn't written. VDI_TEST_FILE: the extracts'
name."""

import os
import sys

from paraview import catalyst
from paraview.simple import *  # noqa: F403
from paraview.modules.vtkRemotingCore import vtkProcessModule
from vtkmodules.util.numpy_support import vtk_to_numpy

LoadPlugin(os.environ["VDI_PLUGIN"], remote=False, ns=globals())

rank = vtkProcessModule.GetProcessModule().GetPartitionId()
grid = TrivialProducer(registrationName="grid")
image = VolumetricDepthImage(Input=grid)
image.SelectInputScalars = ["POINTS", "V"]
image.Resolution = [64, 48]
image.CameraPosition = [16, 8, 70]
image.CameraFocalPoint = [16, 8, 8]
extractor = CreateExtractor("VDI", image, registrationName="vdi")
extractor.Writer.FileName = os.environ.get("VDI_TEST_FILE", "vdi_{timestep:06d}.vdi")
options = catalyst.Options()
options.ExtractsOutputDirectory = os.environ["VDI_OUTPUT"]

how, step, where = (os.environ.get("VDI_TEST_FAIL") or "never:0:0").split(":")


def catalyst_execute(info):
    image.UpdatePipeline(info.time)
    if rank == 0:
        data = image.GetClientSideObject().GetOutputDataObject(0)
        if data.GetNumberOfPoints() == 0:
            raise RuntimeError("no picture")
        if vtk_to_numpy(data.GetPointData().GetArray("RGBA"))[:, 3].max() == 0:
            raise RuntimeError("an empty picture")
    if info.timestep == int(step) and rank == int(where):
        if how == "raise":
            raise ValueError("asked to fail")
        sys.exit(7)
