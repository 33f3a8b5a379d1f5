"""Saves a Catalyst script for a sample of the simulation's data, as ParaView's window does by
*File, Save Catalyst State*. Usage: pvbatch save_state.py SAMPLE STATE, such as sample.vti and
state.py."""

import sys

from paraview import catalyst
from paraview.detail.catalyst_export import save_catalyst_state
from paraview.simple import *  # noqa: F403

LoadDistributedPlugin("VolumetricDepthImages", remote=False, ns=globals())
sample, state = sys.argv[1:]

grid = OpenDataFile(sample, registrationName="grid")  # the simulation's blocks have this name
image = VolumetricDepthImage(Input=grid)
image.SelectInputScalars = ["CELLS", "V"]
image.LookupTable = GetColorTransferFunction("V")
image.ScalarOpacityFunction = GetOpacityTransferFunction("V")
for function in (image.LookupTable, image.ScalarOpacityFunction):
    function.RescaleTransferFunction(0.0, 0.45)  # V's range in the whole run
image.Resolution = [640, 360]
image.UpdatePipeline()

extractor = CreateExtractor("VDI", image, registrationName="vdi")
extractor.Writer.FileName = "state_{timestep:06d}.vdi"

options = catalyst.Options()
options.ExtractsOutputDirectory = "."
save_catalyst_state(state, options.SMProxy)
