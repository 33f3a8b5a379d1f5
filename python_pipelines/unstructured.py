# script-version: 2.0
"""A Catalyst script for simulations that hand unstructured grids to ParaView's Catalyst by an
adaptor of their own. Resample To Image turns the grid into a lattice, of which a VDI is made. The
first line tells ParaView's Python bridge that this isn't a script of Catalyst 1."""

from paraview import catalyst
from paraview.simple import *  # noqa: F403

LoadDistributedPlugin("VolumetricDepthImages", remote=False, ns=globals())

grid = TrivialProducer(registrationName="grid")
lattice = ResampleToImage(Input=grid)
lattice.SamplingDimensions = [64, 64, 64]  # about as fine as the grid where it matters
lattice.UseInputBounds = 0
lattice.SamplingBounds = [0.0, 1.0, 0.0, 1.0, 0.0, 1.0]  # the same at each step, on all ranks

image = VolumetricDepthImage(Input=lattice)
image.SelectInputScalars = ["POINTS", "V"]  # cell data become point data
image.LookupTable = GetColorTransferFunction("V")
image.LookupTable.RescaleTransferFunction(0.0, 0.45)  # V's range in the whole run
image.ScalarOpacityFunction = GetOpacityTransferFunction("V")
image.ScalarOpacityFunction.Points = [0.0, 0.0, 0.5, 0.0, 0.45, 1.0, 0.5, 0.0]
image.Resolution = [640, 360]
image.CameraPosition = [2.6, 2.0, 3.1]
image.CameraFocalPoint = [0.5, 0.5, 0.5]

extractor = CreateExtractor("VDI", image, registrationName="vdi")
extractor.Writer.FileName = "vdi_{timestep:06d}.vdi"

options = catalyst.Options()
options.ExtractsOutputDirectory = "."
