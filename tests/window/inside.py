"""Runs inside the real ParaView: answers the calls of window.py's Inside, in the folder VDI_TEST_OUTPUT."""

import json
import os
import traceback

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
