"""Catalyst script that lets viewers steer. Each rank writes one line per step, with the properties that are in force, to
view_RANK.txt."""
import json
import os

from paraview import catalyst
from paraview.simple import *  # noqa: F403
from paraview.modules.vtkRemotingCore import vtkProcessModule

OUTPUT = os.environ["VDI_OUTPUT"]
rank = vtkProcessModule.GetProcessModule().GetPartitionId()

grid = TrivialProducer(registrationName="grid")
image = VolumetricDepthImage(Input=grid)
image.SelectInputScalars = ["POINTS", "V"]
colors = GetColorTransferFunction("V")
colors.RescaleTransferFunction(0.0, 1.0)
opacities = GetOpacityTransferFunction("V")
opacities.RescaleTransferFunction(0.0, 1.0)
for function in (colors, opacities):
    function.ScalarRangeInitialized = 1
image.LookupTable = colors  # the map uses these opacities
image.Resolution = [96, 54]
image.CameraPosition = [18.0, 20.0, 60.0]
image.CameraFocalPoint = [18.0, 6.0, 6.0]

stream = CreateExtractor("VDIStream", image, registrationName="stream")
stream.Writer.Steer = 1
stream.Writer.LinkFile = os.path.join(OUTPUT, "vdi-stream.link")
stream.Writer.SteeringLog = os.path.join(OUTPUT, "vdi-steering.jsonl")

options = catalyst.Options()
options.ExtractsOutputDirectory = OUTPUT

file = open(os.path.join(OUTPUT, "view_%d.txt" % rank), "w")


def catalyst_execute(info):
    """Runs before the step's extractors."""
    line = {"step": info.timestep, "position": list(image.CameraPosition), "angle": image.CameraViewAngle,
            "resolution": list(image.Resolution), "supersegments": image.Supersegments, "rate": image.SamplingRate,
            "colours": [colors.RGBPoints[0], colors.RGBPoints[-4]], "opacities": [opacities.Points[0], opacities.Points[-4]],
            "first": list(colors.RGBPoints[1:4])}
    print(json.dumps(line), file=file, flush=True)
