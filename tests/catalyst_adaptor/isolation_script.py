"""A script that starts children at step 1, ends each by SIGTERM and notes how it ended: a program, one of Python's
multiprocessing, and a fork. At step 2 it ends its process on the first rank. It makes no frames."""

import multiprocessing
import os
import signal
import subprocess
import time

from paraview import catalyst
from paraview.modules.vtkRemotingCore import vtkProcessModule

options = catalyst.Options()
is_first = vtkProcessModule.GetProcessModule().GetPartitionId() == 0


def ends_of_children():
    program = subprocess.Popen(["sleep", "60"])
    program.terminate()
    fork = multiprocessing.get_context("fork").Process(target=time.sleep, args=(60,))
    fork.start()
    fork.terminate()
    fork.join(30)
    child = os.fork()
    if child == 0:
        os.kill(os.getpid(), signal.SIGTERM)
        os._exit(0)
    return [program.wait(30), fork.exitcode, os.waitpid(child, 0)[1]]


def catalyst_execute(info):
    if info.timestep == 1 and is_first:
        with open("children", "w") as file:
            file.write(str(ends_of_children()))
    if info.timestep == 2 and is_first:
        os._exit(7)
