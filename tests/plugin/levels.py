"""Levels, blanked cells and points as ParaView hands them over, and arrays that are too short."""

import numpy as np
from pvtest import *  # noqa: F403
from vtkmodules.vtkCommonDataModel import (
    VTK_XYZ_GRID, vtkAMRBox, vtkDataSetAttributes, vtkMultiBlockDataSet, vtkOverlappingAMR, vtkUniformGrid)

HIDDEN_POINT, HIDDEN_CELL, REFINED_CELL = (
    vtkDataSetAttributes.HIDDENPOINT, vtkDataSetAttributes.HIDDENCELL, vtkDataSetAttributes.REFINEDCELL)


def filter_of(data, association):
    """A filter that shows the data's values in a thin opaque band and a faint one, from an oblique direction."""
    return filter_with(producer_of(data), association, "f", ScalarOpacityUnitDistance=0.05, Resolution=[120, 90],
                       CameraPosition=[1.6, 1.3, 2.4], CameraFocalPoint=[0.5, 0.5, 0.5], LookupTable=colors,
                       ScalarOpacityFunction=opacity, PictureOnly=1)


def picture_of(data, association="CELLS"):
    return picture(filter_of(data, association)).astype(int)


colors = simple.GetColorTransferFunction("f")
colors.RGBPoints = [0, 0.2, 0.4, 0.9, 0.5, 0.9, 0.9, 0.3, 1, 0.9, 0.2, 0.1]
colors.AutomaticRescaleRangeMode = "Never"
colors.ScalarRangeInitialized = 1
opacity = simple.GetOpacityTransferFunction("f")
opacity.Points = [0.3, 0, 0.5, 0, 0.33, 0.2, 0.5, 0, 0.36, 0, 0.5, 0, 0.47, 0, 0.5, 0, 0.5, 0.9, 0.5, 0, 0.53, 0, 0.5, 0]


def values_on(lo, hi, count, field):
    """The field's values at the centres of `count` cells per axis from lo to hi, x fastest."""
    axes = [lo[a] + (np.arange(count[a]) + 0.5) * (hi[a] - lo[a]) / count[a] for a in (2, 1, 0)]
    z, y, x = np.meshgrid(*axes, indexing="ij")
    return field(x, y, z).ravel()


def grid_of(lo, hi, count, values, flags=None, kind=vtkUniformGrid):
    grid = kind()
    grid.SetOrigin(*lo)
    grid.SetSpacing(*[(hi[a] - lo[a]) / count[a] for a in range(3)])
    grid.SetDimensions(*[n + 1 for n in count])
    array = numpy_to_vtk(values.astype("float32"), deep=True)
    array.SetName("f")
    grid.GetCellData().AddArray(array)
    if flags is not None:
        ghosts = numpy_to_vtk(flags.astype("uint8"), deep=True)
        ghosts.SetName("vtkGhostType")
        grid.GetCellData().AddArray(ghosts)
    return grid


# The field varies only along x, so that the domain's faces, where half a coarse cell has nothing beside it, look the
# same on any level.
def along(x, y, z):
    return x


zero, one = [0.0] * 3, [1.0] * 3
truth = picture_of(grid_of(zero, one, [32] * 3, values_on(zero, one, [32] * 3, along)))
check((truth.max(axis=2) > 8).mean() > 0.1, "there is something to see")
lo, hi = [0.25] * 3, [0.75] * 3
for ratio in (2, 4):
    n = 32 // ratio
    middle = slice(n // 4, 3 * n // 4)
    coarse = values_on(zero, one, [n] * 3, along).reshape(n, n, n)
    coarse[middle, middle, middle] = 0.5  # opaque, were it seen
    fine = values_on(lo, hi, [16] * 3, along)

    amr = vtkOverlappingAMR()
    amr.Initialize(2, [1, 1])
    amr.SetGridDescription(VTK_XYZ_GRID)
    amr.SetOrigin(zero)
    for level, (first, last, cells) in enumerate([(0, n - 1, 1 / n), (8, 23, 1 / 32)]):
        amr.SetSpacing(level, [cells] * 3)
        amr.SetRefinementRatio(level, ratio)
        amr.SetAMRBox(level, 0, vtkAMRBox([first] * 3, [last] * 3))
    amr.SetDataSet(0, 0, grid_of(zero, one, [n] * 3, coarse.ravel()))
    amr.SetDataSet(1, 0, grid_of(lo, hi, [16] * 3, fine))
    worst = np.abs(picture_of(amr) - truth).max()
    check(worst <= 2, "AMR levels of ratio %d: the picture of a uniform grid, off by %d" % (ratio, worst))

    flags = np.zeros((n, n, n))
    flags[middle, middle, middle] = REFINED_CELL
    blocks = vtkMultiBlockDataSet()
    blocks.SetBlock(0, grid_of(zero, one, [n] * 3, coarse.ravel(), flags.ravel()))
    blocks.SetBlock(1, grid_of(lo, hi, [16] * 3, fine))
    worst = np.abs(picture_of(blocks) - truth).max()
    check(worst <= 2, "refined cells under a finer block, ratio %d: the picture of a uniform grid, off by %d" % (ratio, worst))

# Hidden cells and points aren't drawn, and don't bleed into their neighbours.
n = 16
half = np.zeros((n, n, n))
half[:, :, n // 2:] = HIDDEN_CELL
values = values_on(zero, one, [n] * 3, lambda x, y, z: 0.33 + 0 * x).reshape(n, n, n)
left = picture_of(grid_of(zero, [0.5, 1.0, 1.0], [n // 2, n, n], values[:, :, : n // 2].ravel()))
values[:, :, n // 2:] = 0.5
worst = np.abs(picture_of(grid_of(zero, one, [n] * 3, values.ravel(), half.ravel())) - left).max()
check(left.max() > 8 and worst <= 2, "hidden cells aren't seen, off by %d" % worst)


def points_of(count, values, flags=None):
    grid = vtkImageData()
    grid.SetDimensions(*count)
    grid.SetSpacing(1 / n, 1 / n, 1 / n)
    for name, content, kind in (("f", values, "float32"), ("vtkGhostType", flags, "uint8")):
        if content is not None:
            array = numpy_to_vtk(content.astype(kind).ravel(), deep=True)
            array.SetName(name)
            grid.GetPointData().AddArray(array)
    return grid


values = np.full((n + 1, n + 1, n + 1), 0.33)
left = picture_of(points_of([n // 2 + 1, n + 1, n + 1], values[:, :, : n // 2 + 1]), "POINTS")
values[:, :, n // 2 + 1:] = 0.5
flags = np.where(values == 0.5, HIDDEN_POINT, 0)
worst = np.abs(picture_of(points_of([n + 1] * 3, values, flags), "POINTS") - left).max()
check(left.max() > 8 and worst <= 2, "hidden points aren't seen, off by %d" % worst)


def update_with_second(grid, association):
    blocks = vtkMultiBlockDataSet()
    blocks.SetBlock(0, points_of([3] * 3, np.zeros(27)))
    blocks.GetBlock(0).GetCellData().AddArray(numpy_to_vtk(np.zeros(8), deep=True))
    blocks.GetBlock(0).GetCellData().GetArray(0).SetName("f")
    blocks.SetBlock(1, grid)
    filter_of(blocks, association).UpdatePipeline()


def says(texts, name):
    text = " ".join(texts)
    return "block 2 of vtkMultiBlockDataSet" in text and "'%s'" % name in text


# Arrays as a simulation hands them over; VTK's own filters ensure that lengths fit.
short = points_of([n + 1] * 3, values[:-2])
check(says(errors_of(lambda: update_with_second(short, "POINTS")), "f"), "a short array is refused, with its name and block")
short = points_of([n + 1] * 3, values, flags[:-2])
check(says(errors_of(lambda: update_with_second(short, "POINTS")), "vtkGhostType"),
      "a short vtkGhostType of points is refused, with its block")
short = grid_of(zero, one, [n] * 3, np.zeros(n ** 3), half.ravel()[:-5])
check(says(errors_of(lambda: update_with_second(short, "CELLS")), "vtkGhostType"),
      "a short vtkGhostType of cells is refused, with its block")
check(np.abs(picture_of(points_of([n // 2 + 1, n + 1, n + 1], values[:, :, : n // 2 + 1]), "POINTS") - left).max() == 0,
      "after all that, a picture is made as before")
finish()
