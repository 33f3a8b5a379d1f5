"""Two VDIs of V and a picture of the second one at each step, for the run's log. VDI_TEST_FAIL=STEP: at that step, the
second rank's script raises an exception after the first VDI."""

import os

from paraview import catalyst
from paraview.simple import *  # noqa: F403
from paraview.modules.vtkRemotingCore import vtkProcessModule

rank = vtkProcessModule.GetProcessModule().GetPartitionId()
grid = TrivialProducer(registrationName="grid")
images = []
for name, distance in (("near", 50), ("far", 90)):
    image = VolumetricDepthImage(registrationName=name, Input=grid)
    image.SelectInputScalars = ["POINTS", "V"]
    image.Resolution = [64, 48]
    image.CameraPosition = [16, 8, distance]
    image.CameraFocalPoint = [16, 8, 8]
    extractor = CreateExtractor("VDI", image, registrationName="vdi of " + name)
    extractor.Writer.FileName = name + "_{timestep}.vdi"
    images.append(image)
view = RenderVDI(Input=images[1])
picture = CreateExtractor("VDIPicture", view, registrationName="picture")
picture.Writer.FileName = "far_{timestep}.png"
options = catalyst.Options()
options.ExtractsOutputDirectory = os.environ["VDI_OUTPUT"]


def catalyst_execute(info):
    images[0].UpdatePipeline(info.time)
    if info.timestep == int(os.environ.get("VDI_TEST_FAIL", "-1")) and rank == 1:
        raise ValueError("asked to fail")
