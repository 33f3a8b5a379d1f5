"""A simulation on all ranks but the last, which does something else meanwhile. The ranks that
simulate make the VDIs. Usage: mpirun -n 3 python3 subcommunicator.py"""

import numpy as np
from mpi4py import MPI
from pv_vdi.catalyst import Block, Catalyst

N = 16  # cells along an axis of each rank's block
world = MPI.COMM_WORLD
is_simulating = world.rank < world.size - 1
part = world.Split(color=int(is_simulating), key=world.rank)

if is_simulating:
    run = {
        "field": "V",
        "colors": {"range": [0, 1]},  # V's range in the whole run
        "resolution": [640, 360],
        "output": "part_{timestep:06d}.vdi",
    }
    with Catalyst(part, json=run) as catalyst:
        block = Block(cells=(N, N, N), origin=(part.rank, 0, 0), spacing=(1 / N,) * 3)
        catalyst.set_blocks([block])
        values = np.linspace(0, 1, N ** 3).reshape(N, N, N)
        catalyst.set_array("V", [values])
        for step in range(2):
            values *= 0.9
            catalyst.execute(step, 0.1 * step)
            world.send(values.mean(), dest=world.size - 1)
else:
    for step in range(2):
        means = [world.recv(source=rank) for rank in range(world.size - 1)]
        print("step %d: the mean is %.3f" % (step, np.mean(means)), flush=True)
