"""The installed Python package makes a VDI from arrays without a script, reads it, and draws it. Runs on
two ranks, without a display. Argument: the folder where the package was installed."""

import os
import sys
import tempfile

import numpy as np
from mpi4py import MPI

sys.path.insert(0, sys.argv[1])
import pv_vdi  # noqa: E402
from pv_vdi.catalyst import Block, Catalyst  # noqa: E402

N = 16  # cells along an axis of each rank's block
assert os.path.samefile(os.path.dirname(os.path.dirname(pv_vdi.__file__)), sys.argv[1]), pv_vdi.__file__
world = MPI.COMM_WORLD
folder = world.bcast(tempfile.mkdtemp() if world.rank == 0 else None)
output = os.path.join(folder, "{timestep}.vdi")
run = {"field": "V", "colors": {"range": [0, 1]}, "resolution": [160, 90], "output": output}
with Catalyst(world, json=run) as catalyst:
    catalyst.set_blocks([Block(cells=(N, N, N), origin=(world.rank, 0, 0), spacing=(1 / N,) * 3)])
    catalyst.set_array("V", [np.full((N, N, N), (1 + world.rank) / world.size)])
    catalyst.execute(0, 0.0)

if world.rank == 0:
    file = output.format(timestep=0)
    vdi = pv_vdi.read(file)
    assert vdi.size == (160, 90) and len(vdi.segments) > 0, vdi.size
    colors, depths = vdi.render(vdi.camera.azimuth(20.0))
    shown = np.isfinite(depths).mean()
    assert 0.02 < shown < 0.9 and colors[..., 3].max() > 0.1, (shown, colors[..., 3].max())
    os.remove(file)
    os.rmdir(folder)
