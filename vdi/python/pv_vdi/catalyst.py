"""Makes VDIs of a running simulation's NumPy arrays, by scripts in ParaView's in situ engine or by a JSON text.

    from mpi4py import MPI
    from pv_vdi.catalyst import Block, Catalyst

    with Catalyst(MPI.COMM_WORLD, ["minimal.py"]) as catalyst:
        catalyst.set_blocks([Block(cells=(64, 64, 64), origin=(rank, 0, 0), spacing=(1 / 64, 1 / 64, 1 / 64))])
        for step in range(100):
            ...
            catalyst.set_array("V", [values])     # values: float64 [z][y][x], of cells
            catalyst.execute(step, 0.1 * step)

With `Catalyst(MPI.COMM_WORLD, json={"field": "V", "every": 10})` neither a script nor ParaView is needed.
All calls are collective over the communicator. vdi_catalyst.h says more about each.
"""

import contextlib
import ctypes
import dataclasses
import json as json_module
import os

import numpy as np

from ._location import LIBRARY

__all__ = ["Block", "Catalyst", "CatalystError"]

BAD_ARGUMENT, ENGINE, SCRIPT = 1, 2, 3  # CatalystError.code

_TYPES = {np.dtype(name): number
          for number, name in enumerate(["uint8", "int8", "uint16", "int16", "uint32", "int32", "float32", "float64", "int64",
                                         "uint64"])}
_POINTS, _CELLS = 0, 1
_SUM, _DENSITY = 0, 1


class CatalystError(RuntimeError):
    """A call that failed, on all ranks. `code` is BAD_ARGUMENT, ENGINE or SCRIPT. The next step works again."""

    def __init__(self, code, message):
        super().__init__(message)
        self.code = code


@dataclasses.dataclass
class Block:
    """One block of a uniform lattice; each field has x, y and z. `cells` counts ghost cells too; `origin` is the lower corner
    of the first cell, ghost or not, and so the position of the first point; `spacing` is the size of a cell. Both are in world
    units."""

    cells: tuple
    origin: tuple = (0.0, 0.0, 0.0)
    spacing: tuple = (1.0, 1.0, 1.0)
    ghost_lo: tuple = (0, 0, 0)
    ghost_hi: tuple = (0, 0, 0)


class _Block(ctypes.Structure):
    _fields_ = [("cells", ctypes.c_int32 * 3), ("ghost_lo", ctypes.c_int32 * 3), ("ghost_hi", ctypes.c_int32 * 3),
                ("origin", ctypes.c_double * 3), ("spacing", ctypes.c_double * 3)]


class _Strides(ctypes.Structure):
    _fields_ = [("strides", ctypes.c_int64 * 3), ("component_stride", ctypes.c_int64)]


class _Particles(ctypes.Structure):
    _fields_ = [("count", ctypes.c_int64), ("kind", ctypes.c_int32), ("position_type", ctypes.c_int32),
                ("positions", ctypes.c_void_p * 3), ("position_stride", ctypes.c_int64),
                ("weights", ctypes.c_void_p), ("weight_stride", ctypes.c_int64),
                ("lengths", ctypes.c_void_p), ("length_stride", ctypes.c_int64),
                ("weight_type", ctypes.c_int32), ("length_type", ctypes.c_int32)]


def _columns(positions):
    """The columns x, y and z, which share type and stride."""
    if isinstance(positions, np.ndarray):
        if positions.ndim != 2 or positions.shape[1] != 3:
            raise ValueError("positions are %s, not [particle][3]" % (positions.shape,))
        columns = [positions[:, axis] for axis in range(3)]
    else:
        columns = [np.asarray(column) for column in positions]
        if len(columns) != 3 or any(column.ndim != 1 for column in columns):
            raise ValueError("positions are neither one array [particle][3] nor three of x, y and z")
    if len({(column.dtype, column.shape, column.strides) for column in columns}) > 1:
        raise ValueError("the columns of positions differ in type, length or stride")
    return columns


def _numbers(what, given, count):
    """The array of the particles' numbers, and its stride, which is 0 for one number for all."""
    array = np.asarray(given)
    if array.ndim > 1 or (array.ndim == 1 and len(array) != count):
        raise ValueError("%s are %s, for %d particles" % (what, array.shape, count))
    if array.dtype not in (np.dtype("float32"), np.dtype("float64")):
        array = array.astype("float64") if array.ndim == 0 else array
    return array, array.strides[0] if array.ndim == 1 else 0


def _float_type(what, dtype):
    if dtype not in (np.dtype("float32"), np.dtype("float64")):
        raise ValueError("%s are %s; they must be float32 or float64" % (what, dtype))
    return _TYPES[dtype]


def _particles(positions, weights, lengths, density):
    """The particles as the engine takes them, and the arrays that they point to. Raises ValueError."""
    columns = _columns(positions)
    count = len(columns[0])
    made = _Particles(count, _DENSITY if density else _SUM, _float_type("positions", columns[0].dtype),
                      (ctypes.c_void_p * 3)(*(column.ctypes.data for column in columns)), columns[0].strides[0])
    kept = [columns]
    if weights is not None:
        array, made.weight_stride = _numbers("weights", weights, count)
        made.weights, made.weight_type = array.ctypes.data, _float_type("weights", array.dtype)
        kept.append(array)
    if lengths is not None:
        array, made.length_stride = _numbers("lengths", lengths, count)
        made.lengths, made.length_type = array.ctypes.data, _float_type("lengths", array.dtype)
        kept.append(array)
    return made, kept


def _load():
    library = ctypes.CDLL(os.path.join(os.path.dirname(os.path.abspath(__file__)), LIBRARY))
    handle, text = ctypes.c_void_p, ctypes.c_char_p
    library.vdi_catalyst_initialize.argtypes = [ctypes.c_int32, ctypes.c_int32, ctypes.POINTER(text), ctypes.POINTER(handle)]
    library.vdi_catalyst_initialize_json.argtypes = [ctypes.c_int32, text, ctypes.POINTER(handle)]
    library.vdi_catalyst_set_blocks.argtypes = [handle, ctypes.c_int32, ctypes.POINTER(_Block)]
    library.vdi_catalyst_set_array_strided.argtypes = [
        handle, text, ctypes.c_int32, ctypes.c_int32, ctypes.c_int32, ctypes.POINTER(ctypes.c_void_p), ctypes.POINTER(_Strides)]
    library.vdi_catalyst_set_array_offset.argtypes = [handle, text, ctypes.c_int32, ctypes.c_double * 3]
    library.vdi_catalyst_set_particles.argtypes = [handle, text, ctypes.POINTER(_Particles)]
    library.vdi_catalyst_wants.argtypes = [handle, ctypes.c_int64, ctypes.c_double]
    library.vdi_catalyst_execute.argtypes = [handle, ctypes.c_int64, ctypes.c_double]
    library.vdi_catalyst_parameter_f64.argtypes = [handle, text, ctypes.c_double, ctypes.c_double, ctypes.c_double]
    library.vdi_catalyst_parameter_f64.restype = ctypes.c_double
    library.vdi_catalyst_parameter_i64.argtypes = [handle, text, ctypes.c_int64, ctypes.c_int64, ctypes.c_int64]
    library.vdi_catalyst_parameter_i64.restype = ctypes.c_int64
    library.vdi_catalyst_finalize.argtypes = [handle]
    library.vdi_catalyst_error.argtypes = [handle]
    library.vdi_catalyst_error.restype = text
    return library


def _as_pairs(array):
    """Complex numbers as their real and imaginary parts, along an additional axis; other arrays unchanged."""
    if array is None or array.dtype.kind != "c":
        return array
    part = array.real
    return np.lib.stride_tricks.as_strided(part, array.shape + (2,), array.strides + (part.dtype.itemsize,), writeable=False)


@contextlib.contextmanager
def _or_refused(call, *arguments):
    """If the block raises, makes the call with arguments that fail on all ranks, because other ranks wait in it."""
    try:
        yield
    except Exception:
        call(*arguments)
        raise


class Catalyst:
    """The engine, driven by scripts or by `json`. A process can make one with scripts in all, and one at a time with json.
    close() or the end of its `with` ends it."""

    def __init__(self, communicator, scripts=None, json=None):
        """`communicator`: mpi4py's, or None for a simulation without MPI. Either `scripts`, paths of Catalyst scripts, or
        `json`, a dict, a JSON text or a file's name: what docs/vdi-run.schema.json describes."""
        if (scripts is None) == (json is None):
            raise ValueError("either scripts or json")
        if communicator is None:
            from mpi4py import MPI  # the engine needs MPI in any case
            communicator = MPI.COMM_SELF
        self._library = _load()
        self._handle = ctypes.c_void_p()
        self._blocks = []
        self._kept = {}  # arrays that the engine points to, by association and name
        if json is not None:
            text = json_module.dumps(json) if isinstance(json, dict) else json
            self._check(self._library.vdi_catalyst_initialize_json(
                communicator.py2f(), os.fsencode(text), ctypes.byref(self._handle)))
            return
        paths = [os.fsencode(script) for script in scripts]
        self._check(self._library.vdi_catalyst_initialize(
            communicator.py2f(), len(paths), (ctypes.c_char_p * len(paths))(*paths), ctypes.byref(self._handle)))

    def set_blocks(self, blocks):
        """Sets this rank's blocks, of which there may be none; forgets all arrays."""
        with _or_refused(self._library.vdi_catalyst_set_blocks, self._handle, -1, None):
            blocks = list(blocks)
            made = (_Block * max(len(blocks), 1))(
                *(_Block(tuple(b.cells), tuple(b.ghost_lo), tuple(b.ghost_hi), tuple(b.origin), tuple(b.spacing))
                  for b in blocks))
        self._check(self._library.vdi_catalyst_set_blocks(self._handle, len(blocks), made))
        self._blocks = blocks
        self._kept = {}

    def set_array(self, name, arrays, points=False, offset=None):
        """The values of one named array: arrays[i] belongs to block i, and is None if the block lacks it. It is [z][y][x], or
        [z][y][x][component] for vectors, of which a run shows the magnitude unless told otherwise. Complex numbers are vectors
        of two. Values are of cells, or of points, of which a block has one more per axis. On staggered grids the values lie
        `offset` cells (x, y, z; -0.5 to 0.5) beside these.

        Arrays are kept alive: change them in place between steps, or set others. They are used in place, whatever their
        strides: slices, transposed arrays, one field of several. Raises ValueError for a shape that the block doesn't have and
        for a type that the engine doesn't know; ranks without such a fault raise CatalystError then."""
        association = _POINTS if points else _CELLS
        with _or_refused(self._library.vdi_catalyst_set_array_strided, self._handle, b"refused", -1, association, 1, None,
                         (_Strides * 1)()):
            arrays = list(arrays)
            number, components, pointers, strides = self._given(name, arrays, points)
            offsets = None if offset is None else (ctypes.c_double * 3)(*offset)
        self._check(self._library.vdi_catalyst_set_array_strided(
            self._handle, name.encode(), number, association, components, pointers, strides))
        self._kept[association, name] = arrays
        if offsets is not None:
            self._check(self._library.vdi_catalyst_set_array_offset(self._handle, name.encode(), association, offsets))

    def _given(self, name, arrays, points):
        """The type, the number of components, the pointers and the strides of one array for each block. Raises ValueError."""
        if len(arrays) != len(self._blocks):
            raise ValueError("%d arrays for %d blocks" % (len(arrays), len(self._blocks)))
        # A view of complex numbers as pairs is no copy, and follows the values when these change.
        views = [_as_pairs(array) for array in arrays]
        present = [view for view in views if view is not None]
        types = {view.dtype for view in present} or {np.dtype("float64")}
        if len(types) > 1 or not types <= set(_TYPES):
            raise ValueError("the values of '%s' are %s; all must be of one of %s" % (
                name, " and ".join(sorted(map(str, types))), ", ".join(map(str, _TYPES))))
        components = {view.shape[3] if view.ndim == 4 else 1 for view in present} or {1}
        for view, block in zip(views, self._blocks):
            shape = tuple(count + bool(points) for count in reversed(block.cells))
            if view is not None and (view.shape[:3] != shape or view.ndim > 4 or len(components) > 1):
                raise ValueError("an array of '%s' is %s, its block has %s values [z][y][x]" % (name, view.shape, shape))
        pointers = (ctypes.c_void_p * max(len(views), 1))(*(None if view is None else view.ctypes.data for view in views))
        strides = (_Strides * max(len(views), 1))(
            *(_Strides() if view is None else _Strides(view.strides[2::-1], view.strides[3] if view.ndim == 4 else 0)
              for view in views))
        return _TYPES[types.pop()], components.pop(), pointers, strides

    def set_particles(self, name, positions, weights=None, lengths=None, density=False):
        """Makes a cell array of this rank's particles, which may lie in blocks of any rank: the particles' weight in each
        cell, with `density` divided by the cell's volume. `positions` is [particle][3], or three arrays x, y and z. `weights`
        (1 unless given) and smoothing lengths `lengths` (cloud in cell unless given) are an array each, or a number for all.
        vdi_catalyst.h has the rules.

        Arrays are kept alive and used in place: change them in place between steps, or set others when their number
        changes. Raises ValueError for shapes that don't fit and for types other than float32 and float64; ranks without such
        a fault raise CatalystError then."""
        with _or_refused(self._library.vdi_catalyst_set_particles, self._handle, b"refused", None):
            made, kept = _particles(positions, weights, lengths, density)
        self._check(self._library.vdi_catalyst_set_particles(self._handle, name.encode(), made))
        self._kept[_CELLS, name] = kept  # an array of cells, as far as the engine is concerned

    def wants(self, step, time=0.0):
        """True if this step makes anything, the same on all ranks; if not, there is no need to call execute."""
        return self._library.vdi_catalyst_wants(self._handle, step, time) != 0

    def execute(self, step, time=0.0):
        """Makes what the scripts or the JSON ask for, from the current values. `step` is the same on all ranks and at least 0,
        with scripts below 2**31, and `time` is finite."""
        self._check(self._library.vdi_catalyst_execute(self._handle, step, time))

    def parameter(self, name, value, low, high):
        """A number from `low` to `high` that viewers may change, if a script or the JSON lets them. Returns the value in force,
        the same on all ranks: the `value` of the first rank's first call, until a viewer sets another. Other ranks may pass any
        value, and later calls any bounds, too. The parameter takes only whole numbers if all three are of type int. Call it at
        each step, on all ranks; values change only in execute. Raises ValueError on all ranks unless the first value lies
        between finite bounds, and for an invalid name, another type than before, or a 65th parameter."""
        whole = all(isinstance(number, int) for number in (value, low, high))
        ask = self._library.vdi_catalyst_parameter_i64 if whole else self._library.vdi_catalyst_parameter_f64
        in_force = ask(self._handle, name.encode(), value, low, high)
        error = self._library.vdi_catalyst_error(self._handle)  # empty after a success
        if error:
            raise ValueError(error.decode(errors="replace"))
        return in_force

    def close(self):
        """Ends the run and its engine, before MPI is finalized. A second call does nothing."""
        if self._handle:
            handle, self._handle = self._handle, ctypes.c_void_p()
            self._kept = {}
            code = self._library.vdi_catalyst_finalize(handle)
            if code != 0:
                raise CatalystError(code, "the engine didn't end well")

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.close()

    def _check(self, code):
        if code != 0:
            text = self._library.vdi_catalyst_error(self._handle) or b"the first rank has said why"
            raise CatalystError(code, text.decode(errors="replace"))
