"""A simulation in Python: numpy's arrays, mpi4py's communicator, one block of cells per rank. Arguments: the library, how
ctypes loads it (CDLL, which releases Python's lock in a call, or PyDLL), the script, the first of the steps up to 2."""

import ctypes
import os
import sys
import threading

import numpy as np
from mpi4py import MPI


class Block(ctypes.Structure):
    _fields_ = [("cells", ctypes.c_int32 * 3), ("ghost_lo", ctypes.c_int32 * 3), ("ghost_hi", ctypes.c_int32 * 3),
                ("origin", ctypes.c_double * 3), ("spacing", ctypes.c_double * 3)]


F64, CELLS = 7, 1
N = 12

library = getattr(ctypes, sys.argv[2])(sys.argv[1])
script = sys.argv[3]
rank = MPI.COMM_WORLD.Get_rank()
beats = []
done = threading.Event()


def beat():
    """A second Python thread, such as simulations use for their output."""
    while not done.wait(0.01):
        beats.append(len(beats))


def check(code, what):
    if code != 0:
        sys.exit("FAILED: %s returned %d" % (what, code))


before = dict(os.environ)
beating = threading.Thread(target=beat)
beating.start()
catalyst = ctypes.c_void_p()
check(library.vdi_catalyst_initialize(MPI.COMM_WORLD.py2f(), 1, (ctypes.c_char_p * 1)(script.encode()),
                                      ctypes.byref(catalyst)), "initialize")
z, y, x = np.meshgrid(*[(np.arange(N) + 0.5) / N] * 3, indexing="ij")
block = Block((N, N, N), (0, 0, 0), (0, 0, 0), (rank, 0, 0), (1 / N, 1 / N, 1 / N))
check(library.vdi_catalyst_set_blocks(catalyst, 1, ctypes.byref(block)), "set_blocks")
for step in range(int(sys.argv[4]), 3):
    values = np.ascontiguousarray(0.1 * step * (1 + np.sin(9 * (x + rank)) * np.cos(7 * y) * np.cos(5 * z)))
    pointers = (ctypes.c_void_p * 1)(values.ctypes.data)
    check(library.vdi_catalyst_set_array(catalyst, b"V", F64, CELLS, pointers), "set_array")
    check(library.vdi_catalyst_execute(catalyst, ctypes.c_int64(step), ctypes.c_double(0.5 * step)), "execute")
check(library.vdi_catalyst_finalize(catalyst), "finalize")
done.set()
beating.join()
if not beats:
    sys.exit("FAILED: the other thread didn't run")
if dict(os.environ) != before:
    sys.exit("FAILED: os.environ has changed: %s" % (set(os.environ.items()) ^ set(before.items())))
