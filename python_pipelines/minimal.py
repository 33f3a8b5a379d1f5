"""The shortest Catalyst script. It writes a Volumetric Depth Image of the array V at each step, to
files vdi_000100.vdi and so on. Each file contains the step's number and time.

The adaptor has loaded the plugin already. Copy this file and change array, range, camera and
colours."""

import os

from paraview import catalyst
from paraview.simple import *  # noqa: F403

# V's range in the whole run. The default is the range of the first step, which a restart changes.
RANGE = [0.0, 0.45]

grid = TrivialProducer(registrationName="grid")
image = VolumetricDepthImage(Input=grid)
image.SelectInputScalars = ["CELLS", "V"]
colors = GetColorTransferFunction("V")
colors.ApplyPreset("Cool to Warm (Extended)")
colors.RescaleTransferFunction(*RANGE)
opacities = GetOpacityTransferFunction("V")
# value, opacity, midpoint, sharpness
opacities.Points = [RANGE[0], 0.0, 0.5, 0.0, RANGE[1], 1.0, 0.5, 0.0]
for function in (colors, opacities):
    function.ScalarRangeInitialized = 1  # keeps ParaView's views from moving it to the data's range
image.LookupTable = colors
image.ScalarOpacityFunction = opacities
image.Resolution = [640, 360]
image.CameraPosition = [2.6, 2.0, 3.1]  # shows the whole unit cube
image.CameraFocalPoint = [0.5, 0.5, 0.5]

extractor = CreateExtractor("VDI", image, registrationName="vdi")
extractor.Writer.FileName = "vdi_{timestep:06d}.vdi"

options = catalyst.Options()
options.ExtractsOutputDirectory = os.environ.get("VDI_OUTPUT", ".")
