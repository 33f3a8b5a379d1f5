"""A small simulation in which recipes run: V peaks in the middle of the unit cube, at 0.15 at step 0 and
at 0.45 at step 30. Each rank has a slab of its cells. Steps are 0, 5, 10 and so on.

    recipe_simulation.py json RUNS           a file's list of [folder, document, first step, end], in turn
    recipe_simulation.py scripts SCRIPT...   two steps
    recipe_simulation.py grid SCRIPT         a step of ParaView's Catalyst, on tetrahedra
"""

import json
import os
import shutil
import sys

import numpy as np
from mpi4py import MPI

N = 16
WORLD = MPI.COMM_WORLD
LOW, HIGH = N * WORLD.rank // WORLD.size, N * (WORLD.rank + 1) // WORLD.size


def field(step, x, z):
    """The values, [z][y][x]. `x` holds the coordinates along both x and y."""
    squares = x[None, None, :] ** 2 + x[None, :, None] ** 2 + z[:, None, None] ** 2
    return (0.15 + 0.01 * step) * np.exp(-8 * squares)


def simulate(steps, first=0, **what):
    from pv_vdi.catalyst import Block, Catalyst
    centres = (np.arange(N) + 0.5) / N - 0.5
    with Catalyst(WORLD, **what) as catalyst:
        catalyst.set_blocks([Block((N, N, HIGH - LOW), (0, 0, LOW / N), (1 / N,) * 3)])
        for step in range(first, steps, 5):
            catalyst.set_array("V", [field(step, centres, centres[LOW:HIGH])])
            catalyst.execute(step, 0.1 * step)
        if os.path.exists("vdi-stream.link") and WORLD.rank == 0:
            shutil.copy("vdi-stream.link", "link")


def run_documents(path):
    with open(path) as file:
        runs = json.load(file)
    for folder, document, first, end in runs:
        os.chdir(folder)
        simulate(end, first, json=document)


def tetrahedra(step):
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonDataModel import vtkImageData
    from vtkmodules.vtkFiltersGeneral import vtkDataSetTriangleFilter
    points = np.arange(N + 1) / N - 0.5
    lattice = vtkImageData()
    lattice.SetExtent(0, N, 0, N, LOW, HIGH)
    lattice.SetSpacing(1 / N, 1 / N, 1 / N)
    values = numpy_to_vtk(field(step, points, points[LOW:HIGH + 1]).ravel(), deep=True)
    values.SetName("V")
    lattice.GetPointData().AddArray(values)
    triangulate = vtkDataSetTriangleFilter()
    triangulate.SetInputData(lattice)
    triangulate.Update()
    return triangulate.GetOutput()


def run_grid(script):
    from paraview.catalyst import bridge
    bridge.initialize()
    bridge.add_pipeline(script, 2)
    bridge.coprocess(3.0, 30, tetrahedra(30), "grid")
    bridge.finalize()


if sys.argv[1] == "json":
    run_documents(sys.argv[2])
elif sys.argv[1] == "scripts":
    simulate(10, scripts=sys.argv[2:])
else:
    run_grid(sys.argv[2])
