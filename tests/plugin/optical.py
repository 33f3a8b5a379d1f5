"""The optical model alone, in double precision: emission and absorption along a ray through a
trilinear field. It shares nothing with the product: no table of samples, no slabs, no blocks, no
shader. VTK's own functions give colours and opacities."""

import functools

import numpy as np

SAMPLES_PER_VOXEL = 64
TABLE = 65537  # places at which a function is sampled


def rays_of(view):
    """Origins and directions [rows][columns][3] from the top; a direction is one unit of depth long."""
    columns, rows = view.ViewSize
    position, focal = np.array(view.CameraPosition, float), np.array(view.CameraFocalPoint, float)
    forward = (focal - position) / np.linalg.norm(focal - position)
    right = np.cross(forward, np.array(view.CameraViewUp, float))
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    parallel = view.CameraParallelProjection
    half = view.CameraParallelScale if parallel else np.tan(np.radians(view.CameraViewAngle / 2))
    x = ((np.arange(columns) + 0.5) / columns * 2 - 1) * half * columns / rows
    y = (1 - (np.arange(rows) + 0.5) / rows * 2) * half
    offsets = y[:, None, None] * up + x[None, :, None] * right
    if parallel:
        return position + offsets, np.broadcast_to(forward, offsets.shape)
    return np.broadcast_to(position, offsets.shape), forward + offsets


def trilinear(values, places):
    """Interpolates values [z][y][x], which lie at integer places, at places [...][x, y, z]. Clamps the places."""
    last = np.array(values.shape[::-1]) - 1
    places = np.clip(places, 0, last)
    base = np.minimum(places.astype(int), last - 1)
    share = places - base
    x, y, z = base[..., 0], base[..., 1], base[..., 2]
    total = np.zeros(x.shape)
    for dz in (0, 1):
        for dy in (0, 1):
            for dx in (0, 1):
                weight = (np.abs(1 - dx - share[..., 0]) * np.abs(1 - dy - share[..., 1]) * np.abs(1 - dz - share[..., 2]))
                total += weight * values[z + dz, y + dy, x + dx]
    return total


class Rays:
    """The scalars along each pixel's ray through point data with spacing 1 and origin 0, of double precision."""

    def __init__(self, view, values):
        origins, directions = rays_of(view)
        high = np.array(values.shape[::-1]) - 1.0
        with np.errstate(divide="ignore"):
            a, b = (0.0 - origins) / directions, (high - origins) / directions
        enter = np.maximum(np.minimum(a, b).max(axis=-1), 0.0)
        leave = np.maximum(a, b).min(axis=-1)
        self.shape = enter.shape
        self.hits = leave > enter
        origins, directions = origins[self.hits], directions[self.hits]
        enter, leave = enter[self.hits], leave[self.hits]
        lengths = (leave - enter) * np.linalg.norm(directions, axis=-1)
        count = int(np.ceil(lengths.max() * SAMPLES_PER_VOXEL))
        depths = enter[:, None] + (np.arange(count) + 0.5) / count * (leave - enter)[:, None]
        self.scalars = trilinear(values, origins[:, None] + depths[..., None] * directions[:, None])
        self.length = lengths[:, None] / count  # of a sample, in world units
        self.low, self.high = self.scalars.min(), self.scalars.max()
        self.tables = {}

    def places(self, logarithmic):
        """The index of each sample's nearest entry in a table from the lowest to the highest scalar."""
        if logarithmic not in self.tables:
            scalars, low, high = self.scalars, self.low, self.high
            if logarithmic:
                scalars, low, high = np.log10(scalars), np.log10(low), np.log10(high)
            self.tables[logarithmic] = np.rint((scalars - low) / (high - low) * (TABLE - 1)).astype(int)
        return self.tables[logarithmic]

    def picture(self, colors, opacity, unit_distance):
        """Premultiplied colours [rows][columns][3] times 255. `colors`: a vtkColorTransferFunction; `opacity`: a
        vtkPiecewiseFunction."""
        rgb = color_table(colors, self.low, self.high)[self.places(is_logarithmic(colors))]
        transparency = np.maximum(1.0 - opacity_table(opacity, self.low, self.high), 1e-300)
        depth = (-np.log(transparency) / unit_distance)[self.places(False)] * self.length
        behind = np.cumsum(depth, axis=1)
        through = np.exp(-behind)  # to the far end of each sample
        weight = np.hstack([1.0 - through[:, :1], through[:, :-1] - through[:, 1:]])
        result = np.zeros(self.shape + (3,))
        result[self.hits] = np.einsum("rs,rsc->rc", weight, rgb)
        return 255.0 * result


def is_logarithmic(colors):
    return colors.GetScale() == 1 and colors.GetRange()[0] > 0  # VTK_CTF_LOG10


@functools.lru_cache(2)
def table_of(function, changed, low, high, components):
    """A function's values at evenly spaced places. `changed`, its modification time, is part of the cache's key."""
    table = np.zeros(components * TABLE)
    function.GetTable(low, high, TABLE, table)
    table.flags.writeable = False
    return table


def color_table(colors, low, high):
    """The colours from one scalar to another, as Volume asks for them: through the control points, without discrete values
    and categories. By VTK's rule at evenly spaced logarithms where the map is logarithmic, else at evenly spaced scalars."""
    return table_of(colors, colors.GetMTime(), low, high, 3).reshape(-1, 3)


def opacity_table(opacity, low, high):
    return table_of(opacity, opacity.GetMTime(), low, high, 1)
