"""Scripts with faults, of which VDI_TEST_FAULT selects one. Unless a comment says otherwise, steps 1 and 2 fail and
step 3 succeeds. Of several faults, separated by commas, each has three steps in turn."""

import os

from paraview import catalyst
from paraview.simple import *  # noqa: F403
from paraview.modules.vtkRemotingCore import vtkProcessModule

LoadPlugin(os.environ["VDI_PLUGIN"], remote=False, ns=globals())

FAULT = TURNS = os.environ["VDI_TEST_FAULT"]
OUTPUT = os.environ["VDI_TEST_FOLDER"] if "VDI_TEST_FOLDER" in os.environ else os.environ["VDI_OUTPUT"]
rank = vtkProcessModule.GetProcessModule().GetPartitionId()

grid = TrivialProducer(registrationName="gird" if FAULT == "channel" else "grid")
image = VolumetricDepthImage(Input=grid)
image.SelectInputScalars = ["CELLS" if FAULT == "cells" else "POINTS", "V"]
image.Resolution = [64, 48]
extractor = CreateExtractor("VDI", image, registrationName="vdi")
extractor.Writer.FileName = "vdi_{timestep:06d}.vdi"
if FAULT == "wants":
    extractor.Trigger.Frequency = 2
if FAULT in ("view", "screenshot", "picture"):
    view = CreateView("RenderView")  # no fault: scripts that ParaView exports always do
    Show(grid, view)
if FAULT == "same file":
    other = CreateExtractor("VDI", image, registrationName="other")
    other.Writer.FileName = "vdi_{timestep:06d}.vdi"
    other.Trigger.UseEndTimeStep = 1
    other.Trigger.EndTimeStep = 2
if FAULT == "picture":
    pictures = CreateExtractor("PNG", view, registrationName="png")
    pictures.Trigger.UseEndTimeStep = 1
    pictures.Trigger.EndTimeStep = 2
options = catalyst.Options()
options.ExtractsOutputDirectory = OUTPUT

if FAULT == "module":
    raise RuntimeError("this module fails at its end")


def make_room():
    """Removes the file that has the name of the folder; another rank may be faster."""
    try:
        if os.path.isfile(OUTPUT):
            os.remove(OUTPUT)
    except OSError:
        pass


def map_range():
    points = list(GetColorTransferFunction("V").RGBPoints)
    return [points[0], points[-4]]


def execute(info):
    global FAULT
    step_of_fault = info.timestep
    if "," in TURNS:
        FAULT = TURNS.split(",")[(info.timestep - 1) // 3]
        step_of_fault = (info.timestep - 1) % 3 + 1
    if FAULT == "defaults" and info.timestep > 1:
        # No fault: checks what the previous step has left, in which only the extractor updated the filter.
        if map_range() != [0, 240]:
            raise RuntimeError("the colour map isn't on the first step's range, but on %s" % map_range())
        written = VDIReader(FileNames=[os.path.join(OUTPUT, "vdi_%06d.vdi" % (info.timestep - 1))])
        written.UpdatePipeline()
        if rank == 0:
            data = written.GetClientSideObject().GetOutputDataObject(0)
            step = data.GetFieldData().GetArray("VDI.parameters").GetValue(3)
            if step != info.timestep - 1:
                raise RuntimeError("the file has step %s" % step)
            alpha = [data.GetPointData().GetArray("RGBA").GetComponent(i, 3) for i in range(64 * 48)]
            if max(alpha) == 0 or max(alpha[:64]) > 0 or max(alpha[-64:]) > 0:
                raise RuntimeError("the picture doesn't show the whole scene")
    if FAULT == "save":
        # No fault: the file has its step, and the filter reports its costs.
        name = os.path.join(OUTPUT, "saved_%d.vdi" % info.timestep)
        SaveData(name, proxy=image)
        if rank == 0 and "generate s" not in image.Report:
            raise RuntimeError("the report is '%s'" % image.Report)
        saved = VDIReader(FileNames=[name])
        saved.UpdatePipeline()
        data = saved.GetClientSideObject().GetOutputDataObject(0)
        if rank == 0 and data.GetFieldData().GetArray("VDI.parameters").GetValue(3) != info.timestep:
            raise RuntimeError("the file that SaveData wrote has another step")
    if step_of_fault > 2:
        if FAULT == "folder":
            make_room()
        return
    if FAULT == "raise before" and rank == 1:
        raise ValueError("asked to fail before the update")
    if FAULT == "raise before":
        image.UpdatePipeline(info.time)
    if FAULT == "update alone" and rank == 0:
        image.UpdatePipeline(info.time)
    if FAULT == "other order":
        other = RenderVDI(Input=image) if rank == 0 else VolumetricDepthImage(Input=grid)
        other.UpdatePipeline(info.time)
    if FAULT == "view":
        Render(view)
    if FAULT == "screenshot":
        SaveScreenshot(os.path.join(OUTPUT, "screenshot.png"), view)


# A script that ParaView exports has no catalyst_execute, and runs only when an extractor is due.
if FAULT not in ("picture", "wants"):
    catalyst_execute = execute
