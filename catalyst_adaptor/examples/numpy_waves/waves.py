"""Refraction of sound by a slow sphere: the wave equation in NumPy, on slabs of z, one per rank.

    mpirun -n 4 python3 waves.py [vdi.json]

The program writes the last pressure to waves.npy. Without vdi.json it draws nothing, and the result
has the same bits.
"""

import sys

import numpy as np
from mpi4py import MPI

N, STEPS = 32, 48
COMM = MPI.COMM_WORLD
RANK, RANKS = COMM.Get_rank(), COMM.Get_size()
FIRST, LAST = N * RANK // RANKS, N * (RANK + 1) // RANKS  # this rank's layers
INSIDE = (slice(1, -1),) * 3


def exchange(field):
    """Fills the outer layers in z with the neighbours' values; the others stay 0, as walls."""
    below = RANK - 1 if RANK > 0 else MPI.PROC_NULL
    above = RANK + 1 if RANK + 1 < RANKS else MPI.PROC_NULL
    COMM.Sendrecv(field[1], below, recvbuf=field[-1], source=above)
    COMM.Sendrecv(field[-2], above, recvbuf=field[0], source=below)


def laplacian(f):
    return (f[2:, 1:-1, 1:-1] + f[:-2, 1:-1, 1:-1] + f[1:-1, 2:, 1:-1] + f[1:-1, :-2, 1:-1]
            + f[1:-1, 1:-1, 2:] + f[1:-1, 1:-1, :-2] - 6 * f[INSIDE])


def main():
    centers = (np.arange(N) + 0.5) / N
    z, y, x = np.meshgrid(centers[FIRST:LAST], centers, centers, indexing="ij")
    slow = (x - 0.55) ** 2 + (y - 0.5) ** 2 + (z - 0.5) ** 2 < 0.22 ** 2
    courant = np.where(slow, 0.08, 0.3)  # (speed * time step / spacing) squared
    now, before = (np.zeros((LAST - FIRST + 2, N + 2, N + 2)) for _ in range(2))
    # Uses only squares: exp's last bit may depend on the place of its argument in a vector.
    distance = ((x - 0.15) ** 2 + (y - 0.4) ** 2 + (z - 0.45) ** 2) / 0.15 ** 2
    now[INSIDE] = before[INSIDE] = np.maximum(1 - distance, 0) ** 2

    catalyst = None
    if len(sys.argv) > 1:
        from pv_vdi.catalyst import Block, Catalyst
        catalyst = Catalyst(COMM, json=sys.argv[1])
        catalyst.set_blocks([Block((N, N, LAST - FIRST), (0, 0, FIRST / N), (1 / N,) * 3)])
    for step in range(1, STEPS + 1):
        exchange(now)
        before[INSIDE] = 2 * now[INSIDE] - before[INSIDE] + courant * laplacian(now)
        now, before = before, now
        if catalyst and catalyst.wants(step):
            # The two arrays take turns, so each wanted step names one. No halo is needed.
            catalyst.set_array("pressure", [now[INSIDE]])
            catalyst.execute(step, step / N)
    if catalyst:
        catalyst.close()

    slabs = COMM.gather(now[INSIDE])
    if RANK == 0:
        np.save("waves.npy", np.concatenate(slabs))


main()
