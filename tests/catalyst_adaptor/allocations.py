"""One small VDI per step, for allocations.cpp."""

from paraview import catalyst
from paraview.simple import *  # noqa: F403

grid = TrivialProducer(registrationName="grid")
image = VolumetricDepthImage(Input=grid)
image.SelectInputScalars = ["CELLS", "density_of_the_particles"]
image.Resolution = [32, 24]
image.Supersegments = 4
image.CameraPosition = [40, 20, 50]
image.CameraFocalPoint = [8, 4, 8]

extractor = CreateExtractor("VDI", image, registrationName="vdi")
extractor.Writer.FileName = "step_{timestep:06d}.vdi"

options = catalyst.Options()
options.ExtractsOutputDirectory = "."
