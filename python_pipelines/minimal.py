"""The shortest Catalyst script: a Volumetric Depth Image of the array V at every step, as files vdi_000100.vdi, ..., each with
its step's number and time inside.

The adaptor has loaded the plugin before. Copy this file and change array, camera and colours."""

import os

from paraview import catalyst
from paraview.simple import *  # noqa: F403

grid = TrivialProducer(registrationName="grid")
image = VolumetricDepthImage(Input=grid)
image.SelectInputScalars = ["CELLS", "V"]
image.Resolution = [640, 360]
image.CameraPosition = [2.6, 2.0, 3.1]  # of the unit cube, all of it
image.CameraFocalPoint = [0.5, 0.5, 0.5]

extractor = CreateExtractor("VDI", image, registrationName="vdi")
extractor.Writer.FileName = "vdi_{timestep:06d}.vdi"

options = catalyst.Options()
options.ExtractsOutputDirectory = os.environ.get("VDI_OUTPUT", ".")
