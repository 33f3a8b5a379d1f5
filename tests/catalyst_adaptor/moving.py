"""The VDIs that catalyst_moving's own JSON text makes, by a script."""

import os

from paraview import catalyst
from paraview.simple import *  # noqa: F403

image = VolumetricDepthImage(Input=TrivialProducer(registrationName="grid"))
image.SelectInputScalars = ["CELLS", "V"]
image.Resolution = [64, 48]
GetColorTransferFunction("V").RescaleTransferFunction(0.0, 1.0)
GetOpacityTransferFunction("V").RescaleTransferFunction(0.0, 1.0)
extractor = CreateExtractor("VDI", image, registrationName="vdi")
extractor.Writer.FileName = "moving_{timestep}.vdi"
options = catalyst.Options()
options.ExtractsOutputDirectory = os.environ["VDI_OUTPUT"]
