"""A simulation on tetrahedra, with neither VTK nor ParaView. A VDI needs a lattice, so the values
are interpolated at a lattice's points. Usage: mpirun -n 3 python3 tetrahedra.py"""

import numpy as np
from mpi4py import MPI
from pv_vdi.catalyst import Block, Catalyst

N = 48  # points along an axis of the lattice, about as far apart as the mesh's nodes
ORIGIN, SPACING = np.zeros(3), np.full(3, 1 / (N - 1))  # of the lattice, x, y, z
WORLD = MPI.COMM_WORLD


class Lattice:
    """Interpolates the values of a mesh's nodes. Make another one when the mesh changes. Each rank
    has any tetrahedra, and gets the lattice's points of some layers along z."""

    def __init__(self, nodes, tetrahedra):
        corners = nodes[tetrahedra]  # [tetrahedron][corner][x, y, z]
        low = np.ceil((corners.min(axis=1) - ORIGIN) / SPACING - 1e-9).astype(int).clip(0)
        high = np.floor((corners.max(axis=1) - ORIGIN) / SPACING + 1e-9).astype(int).clip(max=N - 1)
        inverse = np.linalg.inv((corners[:, 1:] - corners[:, :1]).swapaxes(1, 2))
        points, nodes_of, weights_of = [], [], []
        for offset in np.ndindex(*(high - low + 1).max(axis=0, initial=0)):
            point = low + offset  # one in each tetrahedron's box
            boxed = (point <= high).all(axis=1)
            from_corner = ORIGIN + SPACING * point[boxed] - corners[boxed, 0]
            weights = np.einsum("tij,tj->ti", inverse[boxed], from_corner)
            weights = np.column_stack([1 - weights.sum(axis=1), weights])
            inside = (weights > -1e-9).all(axis=1)
            points.append(point[boxed][inside] @ [1, N, N * N])
            nodes_of.append(tetrahedra[boxed][inside])
            weights_of.append(weights[inside])
        self.points = np.concatenate([np.zeros(0, int), *points])
        self.nodes = np.concatenate([np.zeros((0, 4), int), *nodes_of])
        self.weights = np.concatenate([np.zeros((0, 4)), *weights_of])
        ends = [N * rank // WORLD.size for rank in range(WORLD.size + 1)]
        self.counts = np.diff(ends) * N * N  # of the ranks' points
        self.values = np.empty((np.diff(ends)[WORLD.rank], N, N), np.float32)  # of this rank's
        cells = np.array(self.values.shape[::-1]) - 1
        self.block = Block(cells, ORIGIN + SPACING * [0, 0, ends[WORLD.rank]], SPACING)

    def interpolate(self, field):
        """Sets the values. NaN stands for points outside all tetrahedra, where nothing is shown."""
        own = np.full(N ** 3, -np.inf, np.float32)
        own[self.points] = (field[self.nodes] * self.weights).sum(axis=1)
        WORLD.Reduce_scatter(own, self.values, self.counts, MPI.MAX)
        self.values[np.isinf(self.values)] = np.nan


def twisted_bar(n=24):
    """The mesh: nodes [node][x, y, z] and this rank's tetrahedra [tetrahedron][4 nodes]."""
    place = np.indices((n + 1,) * 3).reshape(3, -1).T / n - 0.5
    angle = 2 * place[:, 2]
    x, y = 0.6 * place[:, 0], 0.6 * place[:, 1]
    turned = [x * np.cos(angle) - y * np.sin(angle), x * np.sin(angle) + y * np.cos(angle)]
    nodes = np.column_stack([*turned, 0.95 * place[:, 2]]) + 0.5
    cube = np.arange((n + 1) ** 3).reshape((n + 1,) * 3)[:-1, :-1, :-1].ravel()
    along = [(n + 1) ** 2, n + 1, 1]  # from node to node along x, y and z
    steps = [(0, 1, 2), (0, 2, 1), (1, 0, 2), (1, 2, 0), (2, 0, 1), (2, 1, 0)]
    paths = [np.cumsum([0, *(along[axis] for axis in path)]) for path in steps]
    tetrahedra = np.concatenate([cube[:, None] + path for path in paths])
    return nodes, np.array_split(tetrahedra, WORLD.size)[WORLD.rank]


def heat(nodes, step):
    """The values of the nodes: two hot spots, of which one cools down."""
    spots = [((nodes - place) ** 2).sum(axis=1) for place in ([0.4, 0.5, 0.3], [0.6, 0.5, 0.7])]
    return 0.45 * (np.exp(-30 * spots[0]) + 0.5 ** step * np.exp(-30 * spots[1]))


def main():
    run = {
        "field": "V",
        "colors": {"range": [0.0, 0.45]},  # V's range in the whole run
        "orbit": {"azimuth": 60, "elevation": 20},
        "resolution": [640, 360],
        "output": "bar_{timestep:06d}.vdi",
    }
    nodes, tetrahedra = twisted_bar()
    lattice = Lattice(nodes, tetrahedra)
    with Catalyst(WORLD, json=run) as catalyst:
        catalyst.set_blocks([lattice.block])
        catalyst.set_array("V", [lattice.values], points=True)
        for step in range(2):
            if catalyst.wants(step):
                lattice.interpolate(heat(nodes, step))
            catalyst.execute(step, 0.1 * step)


if __name__ == "__main__":
    main()
