"""The parts of recipes that ParaView itself makes, in pvbatch or pvpython.

    recipe_paraview.py state SCRIPT    a sample of the simulation, colours as the Color Map Editor exports them
                                       (viridis.json), and the state that the recipe's SCRIPT saves of the sample
    recipe_paraview.py follow SCRIPT   the window of the recipe's SCRIPT, while files appear in the folder
"""

import os
import runpy
import sys
import time

import numpy as np
from paraview import simple
from paraview.servermanager import vtkSMTransferFunctionPresets
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkIOXML import vtkXMLImageDataWriter

SCRIPT = sys.argv[2]


def save_state():
    sample = vtkImageData()
    sample.SetDimensions(9, 9, 9)
    sample.SetSpacing(1 / 8, 1 / 8, 1 / 8)
    values = numpy_to_vtk(np.linspace(0, 0.45, 512), deep=True)
    values.SetName("V")
    sample.GetCellData().AddArray(values)
    writer = vtkXMLImageDataWriter()
    writer.SetFileName("sample.vti")
    writer.SetInputData(sample)
    writer.Write()
    presets = vtkSMTransferFunctionPresets.GetInstance()
    names = [presets.GetPresetName(index) for index in range(presets.GetNumberOfPresets())]
    with open("viridis.json", "w") as file:
        file.write("[%s]" % presets.GetPresetAsString([name.split()[0] for name in names].index("Viridis")))
    sys.argv[1:] = ["sample.vti", "state.py"]
    runpy.run_path(SCRIPT)


def follow():
    """Checks the window after the first file and after the second. The files appear while the
    recipe sleeps."""
    waits = []

    def sleep(seconds):
        waits.append(seconds)
        if len(waits) == 5:
            os.rename("later/a_000000.vdi", "a_000000.vdi")
        elif len(waits) == 10:
            simple.SaveScreenshot("first.png", simple.GetActiveView())
            os.rename("later/a_000010.vdi", "a_000010.vdi")
        elif len(waits) == 15:
            simple.SaveScreenshot("second.png", simple.GetActiveView())
            simple.GetActiveView().GetInteractor().TerminateApp()
        assert len(waits) < 20, "the program continues after its window is closed"

    time.sleep = sleep
    sys.argv[1:] = ["."]
    runpy.run_path(SCRIPT)
    assert len(waits) == 15, "the program ends before its window is closed"


{"state": save_state, "follow": follow}[sys.argv[1]]()
