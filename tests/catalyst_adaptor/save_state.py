"""Saves a Catalyst state as ParaView's *File, Save Catalyst State* does: a VDI of a file whose source has the name of the
simulation's channel, and what is left to defaults. Arguments: the state, the file to be made, the folder of the extracts."""

import os
import sys

from paraview import catalyst, simple
from paraview.detail.catalyst_export import save_catalyst_state

simple.LoadPlugin(os.environ["VDI_PLUGIN"], remote=False, ns=simple.__dict__)

state, sample, folder = sys.argv[1:]
values = simple.Calculator(Input=simple.Wavelet(), ResultArrayName="V", Function="RTData")
simple.SaveData(sample, values)

grid = simple.XMLImageDataReader(registrationName="grid", FileName=[sample])
image = simple.VolumetricDepthImage(registrationName="image", Input=grid)
image.SelectInputScalars = ["POINTS", "V"]
image.Resolution = [64, 48]
image.UpdatePipeline()
extractor = simple.CreateExtractor("VDI", image, registrationName="VDI1")
extractor.Writer.FileName = "vdi_{timestep:06d}.vdi"
options = catalyst.Options()
options.ExtractsOutputDirectory = folder
save_catalyst_state(state, options.SMProxy)
text = open(state).read()
if "VolumetricDepthImage(" not in text:
    sys.exit("FAILED: this isn't what ParaView is known to save:\n" + text)
os.remove(sample)
