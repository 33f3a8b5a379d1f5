"""The shortest Catalyst script: a Volumetric Depth Image of the array V at every step, as files vdi_000100.vdi, ..., each with
its step's number and time inside.

The adaptor has loaded the plugin before. Copy this file and change array, range, camera and colours."""

import os

from paraview import catalyst
from paraview.simple import *  # noqa: F403

RANGE = [0.0, 0.45]  # of V in the whole run; left out, it is that of the first step seen, which a restart changes

grid = TrivialProducer(registrationName="grid")
image = VolumetricDepthImage(Input=grid)
image.SelectInputScalars = ["CELLS", "V"]
colors = GetColorTransferFunction("V")
colors.ApplyPreset("Cool to Warm (Extended)")
colors.RescaleTransferFunction(*RANGE)
opacities = GetOpacityTransferFunction("V")
opacities.Points = [RANGE[0], 0.0, 0.5, 0.0, RANGE[1], 1.0, 0.5, 0.0]  # value, opacity, midpoint, sharpness
for function in (colors, opacities):
    function.ScalarRangeInitialized = 1  # or views of ParaView move it to the data's range
image.LookupTable = colors
image.ScalarOpacityFunction = opacities
image.Resolution = [640, 360]
image.CameraPosition = [2.6, 2.0, 3.1]  # of the unit cube, all of it
image.CameraFocalPoint = [0.5, 0.5, 0.5]

extractor = CreateExtractor("VDI", image, registrationName="vdi")
extractor.Writer.FileName = "vdi_{timestep:06d}.vdi"

options = catalyst.Options()
options.ExtractsOutputDirectory = os.environ.get("VDI_OUTPUT", ".")
