"""A simulation in Python: 8 blocks of a field, distributed over the ranks and handed over by
pv_vdi.catalyst. Argument: the script."""

import glob
import os
import shutil
import sys

import numpy as np
from mpi4py import MPI

from pv_vdi.catalyst import BAD_ARGUMENT, SCRIPT, Block, Catalyst, CatalystError

N = 12
RANK, RANKS = MPI.COMM_WORLD.Get_rank(), MPI.COMM_WORLD.Get_size()
if RANK == 0:
    shutil.rmtree(os.environ["VDI_OUTPUT"], ignore_errors=True)
    os.makedirs(os.environ["VDI_OUTPUT"])
MPI.COMM_WORLD.Barrier()


def expect(error, action, words):
    try:
        action()
    except error as raised:
        assert words in str(raised), raised
        return raised
    raise AssertionError("no %s" % error.__name__)


def simulate(catalyst):
    for step in (1, 2):
        for value, corner in zip(values, corners):  # in place: no array is set again
            z, y, x = np.meshgrid(*[(np.arange(N) + 0.5) * 0.5 / N + start for start in reversed(corner)], indexing="ij")
            value[...] = 0.1 * step * (1 + np.sin(9 * x) * np.cos(7 * y) * np.cos(5 * z))
        assert catalyst.wants(step, 0.5 * step)
        catalyst.execute(step, 0.5 * step)


def take_files():
    """The bytes of the files of this run, which are gone afterwards."""
    MPI.COMM_WORLD.Barrier()
    files = {}
    for path in glob.glob(os.path.join(os.environ["VDI_OUTPUT"], "*.vdi")) if RANK == 0 else []:
        with open(path, "rb") as file:
            files[os.path.basename(path)] = file.read()
        os.remove(path)
    return files


failed = expect(CatalystError, lambda: Catalyst(MPI.COMM_WORLD, ["none.py"]), "rank 0: the script 'none.py' isn't there")
assert failed.code == SCRIPT, failed.code
corners = [np.array([i & 1, i >> 1 & 1, i >> 2]) / 2 for i in range(8) if i % RANKS == RANK]
with Catalyst(MPI.COMM_WORLD, [sys.argv[1]]) as catalyst:
    catalyst.set_blocks(Block((N, N, N), corner, (0.5 / N,) * 3) for corner in corners)
    # Every second one is a field of a larger array, z fastest, and mirrored.
    values = [np.empty((N, N, N)) if i % 2 == 0 else np.empty((N, N, N + 3, 2))[:, :, :N, 1].transpose()[:, ::-1]
              for i, _ in enumerate(corners)]
    expect(ValueError, lambda: catalyst.set_array("V", values[1:] + values + values), "blocks")
    expect(ValueError, lambda: catalyst.set_array("V", [v[1:] for v in values]), "[z][y][x]")
    expect(ValueError, lambda: catalyst.set_array("V", [v > 0 for v in values]), "bool")
    # A fault of one rank fails the call on all of them, and no rank waits.
    if RANK == RANKS - 1:
        expect(ValueError, lambda: catalyst.set_blocks([Block(cells=(0.5, N, N))]), "cells of block 0 is (0.5, 12, 12); write ")
        expect(ValueError, lambda: catalyst.set_array("V", [v[1:] for v in values]), "[z][y][x]")
        expect(ValueError, lambda: catalyst.set_array("V", values, offset="abc"), "write x, y and z")
        expect(ValueError, lambda: catalyst.set_particles("P", np.zeros((5, 2))), "[particle][3]")
        expect(ValueError, lambda: catalyst.parameter(5, 1, 0, 9), "write a text")
        expect(ValueError, lambda: catalyst.execute(1.5), "write int(step)")
    else:
        for error, refused, reason in [
                (CatalystError, lambda: catalyst.set_blocks([]), "cells of block 0 is (0.5, 12, 12)"),
                (CatalystError, lambda: catalyst.set_array("V", values), "an array of 'V' is (11, 12, 12)"),
                (CatalystError, lambda: catalyst.set_array("V", values, offset=(0, 0, 0)), "the offset of 'V' is 'abc'"),
                (CatalystError, lambda: catalyst.set_particles("P", np.zeros((5, 3))), "positions are (5, 2)"),
                (ValueError, lambda: catalyst.parameter("p", 1, 0, 9), "the name is 5"),
                (CatalystError, lambda: catalyst.execute(1), "")]:
            raised = expect(error, refused, "rank %d: %s" % (RANKS - 1, reason))
            assert error is ValueError or raised.code == BAD_ARGUMENT, raised.code
    expect(CatalystError, lambda: catalyst.execute(-1), "")
    assert catalyst.parameter("feed", 0.037, 0, 0.1) == 0.037
    whole = catalyst.parameter("waves", 3, 1, 9)
    assert whole == 3 and isinstance(whole, int), whole
    assert catalyst.parameter("feed", 0.05, 0, 0.1) == 0.037  # the first call has declared it
    assert catalyst.parameter("feed", 1.0, 2, 0) == 0.037  # and its bounds
    for _ in range(2):
        expect(ValueError, lambda: catalyst.parameter("level", 9.0 if RANK == 0 else 0.5, 0, 1), '"level" is out of its bounds')
    assert catalyst.parameter("level", 0.5 if RANK == 0 else -7, 0, 1.0) == 0.5  # the first rank's value counts
    expect(ValueError, lambda: catalyst.parameter("high", 1, 0, float("inf")), "aren't finite")
    catalyst.set_array("W", values)
    expect(CatalystError, lambda: catalyst.execute(0, 0.0), " is named 'V'")
    catalyst.set_array("V", values)
    simulate(catalyst)
catalyst.close()
error = expect(CatalystError, lambda: catalyst.execute(3), "")
assert error.code == BAD_ARGUMENT, error.code

# ParaView starts once in a process, but another run may follow: after an end, and after a failure that all ranks share, in
# whose traceback the run goes on. One that is lost ends when the next one begins.
first = take_files()
try:
    with Catalyst(MPI.COMM_WORLD, [sys.argv[1]]) as catalyst:
        catalyst.set_blocks([])
        catalyst.execute(-1)
except CatalystError:
    pass
else:
    raise AssertionError("step -1 is taken")
lost = Catalyst(MPI.COMM_WORLD, [sys.argv[1]])
if RANK == 0:
    lost = None
catalyst = Catalyst(MPI.COMM_WORLD, [sys.argv[1]])
assert catalyst.parameter("waves", 5, 1, 9) == 5  # not the first run's
catalyst.set_blocks(Block((N, N, N), corner, (0.5 / N,) * 3) for corner in corners)
catalyst.set_array("V", values)
simulate(catalyst)
catalyst.close()
again = take_files()
assert again == first and len(first) == (2 if RANK == 0 else 0), (sorted(first), sorted(again))
for name, content in first.items():  # for the comparison of ranks
    with open(os.path.join(os.environ["VDI_OUTPUT"], name), "wb") as file:
        file.write(content)
