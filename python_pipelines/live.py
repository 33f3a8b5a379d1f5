"""A Catalyst script that shows a running simulation in browsers. It makes a VDI of the array V at
each step, and the first rank serves it. The file vdi-stream.link has the link to open.
docs/live.md explains how to reach the first rank from another machine.

The adaptor has loaded the plugin already. Change array, range, camera and colours."""

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

stream = CreateExtractor("VDIStream", image, registrationName="stream")
stream.Writer.Port = 0  # any free port. A fixed one keeps the link's address from run to run
# 1: whoever has the link may change viewpoint, colours and the simulation's parameters.
stream.Writer.Steer = int(os.environ.get("VDI_STEER", 0))
stream.Writer.SteeringLog = os.path.join(os.environ.get("VDI_OUTPUT", "."), "vdi-steering.jsonl")
stream.Writer.LinkFile = os.path.join(os.environ.get("VDI_OUTPUT", "."), "vdi-stream.link")

options = catalyst.Options()
options.ExtractsOutputDirectory = os.environ.get("VDI_OUTPUT", ".")
