"""Catalyst script that shows a running simulation in browsers: a Volumetric Depth Image of the array V at every step, which the
first rank serves. The link to open is in the file vdi-stream.link; docs/live.md says how to reach it from another machine.

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

stream = CreateExtractor("VDIStream", image, registrationName="stream")
stream.Writer.Port = 0  # a port that is free; one of your own stays the same from run to run
# 1: whoever has the link may steer, that is, change viewpoint, colours and the parameters that the simulation declares.
stream.Writer.Steer = int(os.environ.get("VDI_STEER", 0))
stream.Writer.SteeringLog = os.path.join(os.environ.get("VDI_OUTPUT", "."), "vdi-steering.jsonl")
stream.Writer.LinkFile = os.path.join(os.environ.get("VDI_OUTPUT", "."), "vdi-stream.link")

options = catalyst.Options()
options.ExtractsOutputDirectory = os.environ.get("VDI_OUTPUT", ".")
