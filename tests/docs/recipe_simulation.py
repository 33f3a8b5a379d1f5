"""A small simulation in which recipes run: V peaks in the middle of the unit cube, at 0.15 at step 0 and
at 0.45 at step 30. Each rank has a slab of its cells. Steps are 0, 5, 10 and so on.

    recipe_simulation.py json RUNS           a file's list of [folder, document, first step, end], in turn
    recipe_simulation.py scripts SCRIPT...   two steps
    recipe_simulation.py grid SCRIPT RECIPE  a step of ParaView's own bridge, on the mesh of tetrahedra.py
    recipe_simulation.py lattice RECIPE      checks the lattice of tetrahedra.py
"""

import importlib.util
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


def module_of(path):
    spec = importlib.util.spec_from_file_location("recipe", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def run_grid(script, recipe):
    """The script's version must be found in its text, as for any script that a user adds."""
    from paraview.catalyst import bridge
    from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import VTK_TETRA, vtkCellArray, vtkUnstructuredGrid
    module = module_of(recipe)
    nodes, tetrahedra = module.twisted_bar()
    values = numpy_to_vtk(module.heat(nodes, 0), deep=True)
    values.SetName("V")
    points = vtkPoints()
    points.SetData(numpy_to_vtk(nodes, deep=True))
    cells = vtkCellArray()
    cells.SetData(numpy_to_vtkIdTypeArray(np.arange(0, tetrahedra.size + 1, 4), deep=True),
                  numpy_to_vtkIdTypeArray(tetrahedra.ravel(), deep=True))
    grid = vtkUnstructuredGrid()
    grid.SetPoints(points)
    grid.SetCells(VTK_TETRA, cells)
    grid.GetPointData().AddArray(values)
    bridge.initialize()
    bridge.add_pipeline(script)
    bridge.coprocess(3.0, 30, grid, "grid")
    bridge.finalize()


def check_lattice(recipe):
    """A linear field is interpolated exactly, at as many points as the bar's volume holds. Twisting keeps it."""
    module = module_of(recipe)
    nodes, tetrahedra = module.twisted_bar()
    lattice = module.Lattice(nodes, tetrahedra)
    lattice.interpolate(nodes @ [1.0, 2.0, 3.0])
    first = round(lattice.block.origin[2] * (module.N - 1))
    z, y, x = np.indices(lattice.values.shape) / (module.N - 1)
    expected = x + 2 * y + 3 * (z + first / (module.N - 1))
    inside = ~np.isnan(lattice.values)
    assert abs(lattice.values - expected)[inside].max(initial=0) < 1e-5
    share = WORLD.allreduce(int(inside.sum())) / (module.N - 1) ** 3
    assert abs(share - 0.6 * 0.6 * 0.95) < 0.02, share


if sys.argv[1] == "json":
    run_documents(sys.argv[2])
elif sys.argv[1] == "scripts":
    simulate(10, scripts=sys.argv[2:])
elif sys.argv[1] == "grid":
    run_grid(*sys.argv[2:])
else:
    check_lattice(sys.argv[2])
