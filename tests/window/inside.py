"""Runs inside the real ParaView: answers the calls of window.py's Inside, in the folder VDI_TEST_OUTPUT."""

import json
import os
import traceback

from paraview import simple

OUTPUT = os.environ["VDI_TEST_OUTPUT"]
kept = []  # keeps objects that only VTK refers to, because Python would collect them


def leave(name, text):
    """Writes a file whole or not at all."""
    path = os.path.join(OUTPUT, name)
    with open(path + ".new", "w") as file:
        file.write(text)
    os.replace(path + ".new", path)


def answer(interactor, names):
    """From now on, evaluates each expression in the file "do", and writes its result to "done"."""
    def obey(*_):
        path = os.path.join(OUTPUT, "do")
        if not os.path.exists(path):
            return
        with open(path) as file:
            wanted = file.read()
        os.remove(path)
        try:
            leave("done", json.dumps(eval(wanted, names)))
        except Exception:
            leave("done", json.dumps(traceback.format_exc()))

    interactor.AddObserver("TimerEvent", obey)
    interactor.CreateRepeatingTimer(100)
    kept.extend([interactor, obey])


def show_and_answer(information, data, array, names):
    """Loads the plugin, and shows the output of a programmable source, which has the scripts `information` and `data`, as a
    volume coloured by `array`. Says "ready". From then on it answers calls of the functions in `names`."""
    try:
        simple.LoadPlugin(os.environ["VDI_PLUGIN"], remote=False, ns=names)
        view = simple.GetActiveViewOrCreate("RenderView")
        source = simple.ProgrammableSource(registrationName="Scene", OutputDataSetType="vtkImageData",
                                           ScriptRequestInformation=information, Script=data)
        source.UpdatePipeline(0.0)
        shown = simple.Show(source, view)
        simple.ColorBy(shown, ("POINTS", array))
        shown.SetRepresentationType("Volume")
        view.ResetCamera()
        simple.GetAnimationScene().UpdateAnimationUsingDataTimeSteps()
        simple.SetActiveSource(source)
        simple.Render(view)
        answer(view.GetInteractor(), names)
        leave("ready", "ok")
    except Exception:
        leave("ready", traceback.format_exc())
