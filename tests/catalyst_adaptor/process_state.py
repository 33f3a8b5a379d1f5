"""Makes a VDI at each step, sends the simulation a signal, and changes what a script can change in the process that runs it.
The environment variables that it sets are still set at the next step."""

import errno
import locale
import os
import resource
import signal
import tempfile

from paraview import catalyst
from paraview.simple import *  # noqa: F403

LoadPlugin(os.environ["VDI_PLUGIN"], remote=False, ns=globals())

grid = TrivialProducer(registrationName="grid")
image = VolumetricDepthImage(Input=grid)
image.SelectInputScalars = ["CELLS", "V"]
image.Resolution = [32, 24]
extractor = CreateExtractor("VDI", image, registrationName="vdi")
extractor.Writer.FileName = "vdi_{timestep:06d}.vdi"
options = catalyst.Options()
options.ExtractsOutputDirectory = os.environ["VDI_OUTPUT"]


def in_c(name):
    """A variable as libraries see it, whatever value Python has cached."""
    import ctypes
    getenv = ctypes.CDLL(None).getenv
    getenv.restype = ctypes.c_char_p
    return getenv(name.encode())


def is_refused_beyond_a_limit():
    """Whether a file beyond the limit of sizes is an error. With the signal's default action it would end the process."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    with tempfile.TemporaryFile(buffering=0) as file:
        resource.setrlimit(resource.RLIMIT_FSIZE, (0, before[1]))
        try:
            file.write(b"x")
        except OSError as error:
            return error.errno == errno.EFBIG
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, before)
    return False


def catalyst_execute(info):
    os.kill(os.getpid(), signal.SIGTERM)
    image.UpdatePipeline(info.time)
    if not is_refused_beyond_a_limit():
        raise RuntimeError("a file grew beyond the limit")
    if info.timestep > 1 and (in_c("SCRIPTS_OWN") != b"1" or in_c("SIMULATION_OWN") != b"changed"):
        raise RuntimeError("what the script has set is forgotten")
    os.environ["SCRIPTS_OWN"] = "1"
    os.environ["SIMULATION_OWN"] = "changed"
    os.chdir(os.environ["VDI_OUTPUT"])
    os.umask(0o077)
    locale.setlocale(locale.LC_ALL, "C")
    for which in (signal.SIGTERM, signal.SIGINT, signal.SIGUSR1):
        signal.signal(which, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGUSR2])
    resource.setrlimit(resource.RLIMIT_CORE, (0, resource.getrlimit(resource.RLIMIT_CORE)[1]))
