"""A Catalyst script that writes pictures of the array V as PNG at each step: from the VDI's own
viewpoint and turned by 40 degrees. It needs no view and no display, on any number of ranks."""

from paraview import catalyst
from paraview.simple import *  # noqa: F403

image = VolumetricDepthImage(Input=TrivialProducer(registrationName="grid"))
image.SelectInputScalars = ["CELLS", "V"]
image.LookupTable = GetColorTransferFunction("V")
image.LookupTable.RescaleTransferFunction(0.0, 0.45)  # V's range in the whole run
image.ScalarOpacityFunction = GetOpacityTransferFunction("V")
image.ScalarOpacityFunction.Points = [0.0, 0.0, 0.5, 0.0, 0.45, 1.0, 0.5, 0.0]
image.Resolution = [640, 360]
image.CameraPosition = [2.6, 2.0, 3.1]
image.CameraFocalPoint = [0.5, 0.5, 0.5]
turned = RenderVDI(Input=image, UseOriginalCamera=1, Azimuth=40)

for name, source in (("front", image), ("turned", turned)):
    extractor = CreateExtractor("VDIPicture", source, registrationName=name)
    extractor.Writer.FileName = name + "_{timestep:06d}.png"
    extractor.Writer.Background = [1.0, 1.0, 1.0]

options = catalyst.Options()
options.ExtractsOutputDirectory = "."
