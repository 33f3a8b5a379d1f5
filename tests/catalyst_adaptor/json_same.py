"""json_same.json as a script: the files are the same."""

import json
import os

from paraview import catalyst
from paraview.simple import *  # noqa: F403

RANGE = [0.2, 1.0]
grid = TrivialProducer(registrationName="grid")
image = VolumetricDepthImage(Input=grid)
image.SelectInputScalars = ["CELLS", os.environ.get("VDI_TEST_FIELD", "V")]
# ParaView 5.13 imports presets on only one rank, so their points come from the file.
with open(os.path.join(os.path.dirname(os.path.abspath(__file__)), "json_preset.json")) as file:
    preset = next(one for one in json.load(file) if one["Name"] == "blue to red")
colors = GetColorTransferFunction("V")
colors.ColorSpace = preset["ColorSpace"]
colors.RGBPoints = preset["RGBPoints"]
colors.RescaleTransferFunction(*RANGE)
opacities = GetOpacityTransferFunction("V")
opacities.Points = [RANGE[0], 0.0, 0.5, 0.0, 0.5, 0.1, 0.5, 0.0, RANGE[1], 0.9, 0.5, 0.0]
image.LookupTable = colors
image.ScalarOpacityFunction = opacities
image.Resolution = [96, 64]
image.Supersegments = 12
image.Margin = 0.1
image.CameraPosition = [2.6, 2.0, 3.1]
image.CameraFocalPoint = [0.5, 0.5, 0.5]

extractor = CreateExtractor("VDI", image, registrationName="vdi")
extractor.Writer.FileName = "script_{timestep:06d}.vdi"
extractor.Trigger.Frequency = 2

options = catalyst.Options()
options.ExtractsOutputDirectory = os.environ["VDI_OUTPUT"]
