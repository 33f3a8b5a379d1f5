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
import sys

import numpy as np

from . import _device, _faults
from ._location import LIBRARY

__all__ = ["Block", "Catalyst", "CatalystError"]

BAD_ARGUMENT, ENGINE, SCRIPT, BUSY = 1, 2, 3, 4  # CatalystError.code

_TYPES = {np.dtype(name): number
          for number, name in enumerate(["uint8", "int8", "uint16", "int16", "uint32", "int32", "float32", "float64", "int64",
                                         "uint64"])}
_COMPLEX = [np.dtype("complex64"), np.dtype("complex128")]
_POINTS, _CELLS = 0, 1
_SUM, _DENSITY = 0, 1


class CatalystError(RuntimeError):
    """A call that failed, on all ranks, with the reason of the first rank that has one. `code` is BAD_ARGUMENT, ENGINE or
    SCRIPT. The next step works again. BUSY isn't collective: another thread of this rank is in a call."""

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


def _made(i, block):
    """The block as the engine takes it. Raises ValueError."""
    def whole(field):
        return _faults.whole_triple("%s of block %d" % (field, i), getattr(block, field), _EXAMPLES[field])

    def real(field):
        return _faults.triple("%s of block %d" % (field, i), getattr(block, field), float, _EXAMPLES[field])

    missing = [field for field in _EXAMPLES if not hasattr(block, field)]
    if missing:
        raise ValueError("block %d is %r; write Block(cells=(64, 64, 64), origin=(0, 0, 0), spacing=(1, 1, 1))" % (i, block))
    return _Block(whole("cells"), whole("ghost_lo"), whole("ghost_hi"), real("origin"), real("spacing"))


_EXAMPLES = {"cells": "(64, 64, 64)", "ghost_lo": "(1, 0, 0)", "ghost_hi": "(0, 0, 1)", "origin": "(0.0, 0.0, 0.0)",
             "spacing": "(0.1, 0.1, 0.1)"}


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
                ("weight_type", ctypes.c_int32), ("length_type", ctypes.c_int32), ("periodic", ctypes.c_int32 * 3)]


def _columns(positions, taken):
    """The columns x, y and z, which share type and stride. `taken` gives NumPy's array for another library's."""
    positions = taken("positions", positions)
    if isinstance(positions, np.ndarray):
        if positions.ndim != 2 or positions.shape[1] != 3:
            raise ValueError("positions are %s, not [particle][3]%s" % (
                positions.shape, "; write positions.T" if positions.ndim == 2 and len(positions) == 3 else ""))
        columns = [positions[:, axis] for axis in range(3)]
    else:
        columns = [np.asarray(taken("positions", column)) for column in positions]
        if len(columns) != 3 or any(column.ndim != 1 for column in columns):
            raise ValueError("positions are neither one array [particle][3] nor three of x, y and z")
    if len({(column.dtype, column.shape, column.strides) for column in columns}) > 1:
        raise ValueError("the columns of positions differ in type, length or stride")
    return columns


def _numbers(what, given, count, taken):
    """The array of the particles' numbers, and its stride, which is 0 for one number for all."""
    array = np.asarray(taken(what, given))
    if array.ndim == 0 and _device.is_array(given) and not isinstance(given, np.ndarray):
        raise ValueError("%s are one number in an array of type %s; write float(%s)" % (what, type(given).__name__, what))
    if array.ndim > 1 or (array.ndim == 1 and len(array) != count):
        raise ValueError("%s are %s, for %d particles" % (what, array.shape, count))
    if array.dtype not in (np.dtype("float32"), np.dtype("float64")):
        array = array.astype("float64") if array.ndim == 0 else array
    return array, array.strides[0] if array.ndim == 1 else 0


def _float_type(what, dtype):
    if dtype not in (np.dtype("float32"), np.dtype("float64")):
        raise ValueError("%s are %s, and must be float32 or float64; write %s.astype('float64'): that is a copy, so set it "
                         "again when the values change" % (what, dtype, what))
    return _TYPES[dtype]


def _particles(positions, weights, lengths, density, periodic, taken):
    """The particles as the engine takes them, and the arrays that they point to. Raises ValueError."""
    columns = _columns(positions, taken)
    count = len(columns[0])
    made = _Particles(count, _DENSITY if density else _SUM, _float_type("positions", columns[0].dtype),
                      (ctypes.c_void_p * 3)(*(column.ctypes.data for column in columns)), columns[0].strides[0])
    made.periodic[:] = [int(bool(axis)) for axis in np.broadcast_to(periodic, 3)]
    kept = [columns]
    if weights is not None:
        array, made.weight_stride = _numbers("weights", weights, count, taken)
        made.weights, made.weight_type = array.ctypes.data, _float_type("weights", array.dtype)
        kept.append(array)
    if lengths is not None:
        array, made.length_stride = _numbers("lengths", lengths, count, taken)
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
    library.vdi_catalyst_set_array_missing.argtypes = [handle, text, ctypes.c_int32, ctypes.c_int32,
                                                       ctypes.POINTER(ctypes.c_double)]
    library.vdi_catalyst_set_particles.argtypes = [handle, text, ctypes.POINTER(_Particles)]
    library.vdi_catalyst_set_stream.argtypes = [handle, handle]
    library.vdi_catalyst_wants.argtypes = [handle, ctypes.c_int64, ctypes.c_double]
    library.vdi_catalyst_execute.argtypes = [handle, ctypes.c_int64, ctypes.c_double]
    library.vdi_catalyst_parameter_f64.argtypes = [handle, text, ctypes.c_double, ctypes.c_double, ctypes.c_double]
    library.vdi_catalyst_parameter_f64.restype = ctypes.c_double
    library.vdi_catalyst_parameter_i64.argtypes = [handle, text, ctypes.c_int64, ctypes.c_int64, ctypes.c_int64]
    library.vdi_catalyst_parameter_i64.restype = ctypes.c_int64
    library.vdi_catalyst_refuse.argtypes = [handle, text]
    library.vdi_catalyst_end_run.argtypes = [handle]
    library.vdi_catalyst_error.argtypes = [handle]
    library.vdi_catalyst_error.restype = text
    return library


class _Masked:
    """Memory for a copy of a masked array, in which masked values are NaN. `fill` makes the copy, from the values and the
    mask as they are then."""

    def __init__(self, array):
        self._array = array
        kind, size = array.dtype.kind, array.dtype.itemsize
        narrow = kind in "iub" and size < 4  # floats hold all values of these types
        self.values = np.empty(array.shape, array.dtype if kind not in "iub" else "float32" if narrow else "float64")

    def fill(self):
        np.copyto(self.values, self._array.data)
        self.values[np.ma.getmaskarray(self._array)] = np.nan


def _as_pairs(array):
    """Complex numbers as their real and imaginary parts, along an additional axis; other arrays unchanged."""
    if array is None or array.dtype.kind != "c":
        return array
    part = array.real
    return np.lib.stride_tricks.as_strided(part, array.shape + (2,), array.strides + (part.dtype.itemsize,), writeable=False)


class _Run:
    """A handle, which outlives the Catalyst object that is lost without an end. Only calls of all ranks can end a run, and
    Python collects objects at a time of its own on each rank. So the next run ends it."""

    live = {}  # by kind: scripts, json

    def __init__(self, library, kind, communicator):
        self.library = library
        self.kind = kind
        self.group = communicator.Get_group()
        self.process = os.getpid()
        self.handle = ctypes.c_void_p()

    def end(self):
        """Returns the code; BUSY if another thread is in a call, and then the run goes on."""
        if not self.handle:
            return 0
        code = self.library.vdi_catalyst_end_run(self.handle)
        if code != BUSY:
            self.handle = ctypes.c_void_p()
            if _Run.live.get(self.kind) is self:
                del _Run.live[self.kind]
        return code

    def make_way(self, communicator):
        """Collective: ends the run if a new one of its kind begins on the same ranks."""
        from mpi4py import MPI
        group = communicator.Get_group()
        if MPI.Group.Compare(self.group, group) == MPI.UNEQUAL or self.process != os.getpid():
            return
        if communicator.Get_rank() == 0:
            sys.stderr.write("vdi_catalyst: a new run ends the earlier one, which wasn't closed\n")
        if self.end() == BUSY:
            raise CatalystError(BUSY, "the earlier run can't end, because another thread is in one of its calls")


def _text_of_json(json):
    """The JSON text, or the name of a file, of what the user gives. Raises ValueError or TypeError."""
    if not isinstance(json, dict):
        return os.fspath(json)
    return json_module.dumps(json, default=lambda given: given.tolist())  # NumPy's numbers and arrays


class Catalyst:
    """The engine, driven by scripts or by `json`. A process can have one run with scripts at a time, and one with json.
    close() or the end of its `with` ends it. A run that was lost, or that goes on in a variable, ends when the next one of its
    kind begins on the same ranks."""

    def __init__(self, communicator, scripts=None, json=None):
        """`communicator`: mpi4py's, or None for a simulation without MPI. Either `scripts`, paths of Catalyst scripts, or
        `json`, a dict, a JSON text or a file's name: what docs/vdi-run.schema.json describes."""
        if (scripts is None) == (json is None):
            raise ValueError("write either scripts=[\"minimal.py\"] or json={\"field\": \"V\"}")
        if isinstance(scripts, (str, bytes, os.PathLike)):
            raise ValueError("scripts is %r; write a list, [%r]" % (scripts, os.fspath(scripts)))
        if communicator is None:
            from mpi4py import MPI  # the engine needs MPI in any case
            communicator = MPI.COMM_SELF
        if not hasattr(communicator, "py2f"):
            raise ValueError("the communicator is of type %s; write mpi4py's, such as MPI.COMM_WORLD, or None for one process" %
                             type(communicator).__name__)
        kind = "scripts" if json is None else "json"
        # Before any collective call, because other ranks would wait for one that raises.
        text = None if json is None else os.fsencode(_text_of_json(json))
        paths = [] if scripts is None else [os.fsencode(script) for script in scripts]
        self._library = _load()
        self._blocks = []
        self._kept = {}  # arrays that the engine points to, by association and name
        self._masked = {}  # those that are copies of masked arrays
        self._offsets = {}  # of arrays of cells
        self._stream = None  # that of set_stream
        self._array_stream = None  # that of the arrays, if set_stream wasn't called
        self._shared_error = None  # the last one, which all ranks have raised
        self._is_alone = communicator.Get_size() == 1
        self._run = _Run(self._library, kind, communicator)
        if kind in _Run.live:
            _Run.live[kind].make_way(communicator)
        handle = ctypes.byref(self._run.handle)
        if json is not None:
            self._check(self._library.vdi_catalyst_initialize_json(communicator.py2f(), text, handle))
        else:
            self._check(self._library.vdi_catalyst_initialize(
                communicator.py2f(), len(paths), (ctypes.c_char_p * len(paths))(*paths), handle))
        _Run.live[kind] = self._run

    @property
    def _handle(self):
        return self._run.handle

    def set_blocks(self, blocks):
        """Sets this rank's blocks, of which there may be none; forgets all arrays."""
        with self._or_refused():
            blocks = list(blocks)
            made = (_Block * max(len(blocks), 1))(*(_made(i, block) for i, block in enumerate(blocks)))
        self._check(self._library.vdi_catalyst_set_blocks(self._handle, len(blocks), made))
        self._blocks = blocks
        self._kept = {}
        self._masked = {}
        self._offsets = {}
        if self._array_stream is not None:
            self._array_stream = None
            self._library.vdi_catalyst_set_stream(self._handle, None)

    def set_array(self, name, arrays, points=False, offset=None, missing=None):
        """The values of one named array: arrays[i] belongs to block i, and is None if the block lacks it. It is [z][y][x], or
        [z][y][x][component] for vectors, of which a run shows the magnitude unless told otherwise. Complex numbers are vectors
        of two. Values are of cells, or of points, of which a block has one more per axis. On staggered grids the values lie
        `offset` cells (x, y, z; -0.5 to 0.5) beside these. An array of cells that has one value more along one axis is one of
        the faces across that axis, as on C-grids.

        Missing values are transparent, and count in no range of colours: NaN, values that equal one of the numbers `missing`,
        such as a file's fill value, and those that a masked array masks. execute() copies masked arrays each time, integers as
        floats.

        Arrays are kept alive: change them in place between steps, or set others. They are used in place, whatever their
        strides: slices, transposed arrays, one field of several. Raises ValueError, which says what to write, for a shape that
        the block doesn't have and for a type that the engine doesn't know; ranks without such a fault raise CatalystError with
        the same reason.

        Arrays may be those of other libraries, such as CuPy, PyTorch, JAX and Numba, in CUDA's memory or the host's: whatever
        has __cuda_array_interface__ or __dlpack__. An array that names its stream has execute() wait for it; set_stream()
        names another one."""
        association = _POINTS if points else _CELLS
        with self._or_refused():
            key = _faults.name_bytes(name)
            arrays = [self._taken("the array of '%s' for block %d" % (name, i), array)
                      for i, array in enumerate(_faults.one_per_block(name, arrays, len(self._blocks)))]
            masked = [_Masked(array) if isinstance(array, np.ma.MaskedArray) else None for array in arrays]
            arrays = [array if copy is None else copy.values for array, copy in zip(arrays, masked)]
            if offset is None and not points:
                # A rank whose blocks lack the array can't tell, but takes part in the call.
                arrays, offset = self._faces(arrays)
                offset = offset or self._offsets.get(name, (0, 0, 0))
            number, components, pointers, strides = self._given(name, arrays, points)
            numbers = [] if missing is None else [float(number) for number in np.ravel(missing)]
            offsets = None if offset is None else (ctypes.c_double * 3)(
                *_faults.triple("the offset of '%s'" % name, offset, float, "(-0.5, 0, 0), in cells"))
        self._check(self._library.vdi_catalyst_set_array_strided(
            self._handle, key, number, association, components, pointers, strides))
        self._kept[association, name] = arrays
        self._masked[association, name] = [copy for copy in masked if copy is not None]
        if missing is not None:
            self._check(self._library.vdi_catalyst_set_array_missing(
                self._handle, key, association, len(numbers), (ctypes.c_double * max(len(numbers), 1))(*numbers)))
        if offsets is not None:
            self._check(self._library.vdi_catalyst_set_array_offset(self._handle, key, association, offsets))
            if not points:
                self._offsets[name] = offset

    def set_stream(self, stream):
        """Sets the CUDA stream on which this rank's values are written: execute() waits for the work that was queued on it.
        None means the default stream. `stream` is a handle, or a stream of CuPy, PyTorch or cuda.core. Not collective."""
        number = _device.stream_handle(stream)
        code = self._library.vdi_catalyst_set_stream(self._handle, number or None)
        if code != 0:
            raise CatalystError(code, self._error())
        self._stream = number

    def _taken(self, what, given):
        """NumPy's array on the memory of another library's; everything else unchanged."""
        array, stream = _device.as_array(what, given, self._stream or self._array_stream)
        if stream is None or self._stream is not None:
            return array
        if self._array_stream not in (None, stream):
            raise ValueError("%s is written on the stream %d, and others are on %d; write set_stream(stream), with one that "
                             "waits for all of them" % (what, stream, self._array_stream))
        if self._array_stream is None:
            self._check(self._library.vdi_catalyst_set_stream(self._handle, stream))
            self._array_stream = stream
        return array

    def _faces(self, arrays):
        """The arrays and their offset: those of faces as cells' lower faces, of which the last layer has none. A block without
        a neighbour there continues its values over the last half of a cell."""
        axes = set()
        for array, block in zip(arrays, self._blocks):
            if array is not None and getattr(array, "ndim", 0) >= 3:
                more = np.subtract(array.shape[2::-1], block.cells)
                axes.add(int(np.argmax(more)) if sorted(more) == [0, 0, 1] else None)
        if len(axes) != 1 or None in axes:
            return arrays, None
        axis = axes.pop()
        lower = tuple(slice(None, -1 if place == axis else None) for place in (2, 1, 0))
        offset = [-0.5 if place == axis else 0 for place in range(3)]
        return [None if array is None else array[lower] for array in arrays], offset

    def _given(self, name, arrays, points):
        """The type, the number of components, the pointers and the strides of one array for each block. Raises ValueError."""
        for i, array in enumerate(arrays):
            if array is not None:
                _faults.require_array("the array of '%s' for block %d" % (name, i), array)
        _faults.require_types(name, {array.dtype for array in arrays if array is not None}, [*_TYPES, *_COMPLEX])
        for array, block in zip(arrays, self._blocks):
            if array is not None:
                _faults.require_shape(name, array.shape, block.cells, points)
                _faults.require_one_component(name, array)
        # A view of complex numbers as pairs is no copy, and follows the values when these change.
        views = [_as_pairs(array) for array in arrays]
        present = [view for view in views if view is not None]
        components = {view.shape[3] if view.ndim == 4 else 1 for view in present} or {1}
        if len(components) > 1:
            raise ValueError("the arrays of '%s' are %s; write the same number of components for all blocks" % (
                name, " and ".join(str(view.shape) for view in present)))
        pointers = (ctypes.c_void_p * max(len(views), 1))(*(None if view is None else view.ctypes.data for view in views))
        strides = (_Strides * max(len(views), 1))(
            *(_Strides() if view is None else _Strides(view.strides[2::-1], view.strides[3] if view.ndim == 4 else 0)
              for view in views))
        return _TYPES[present[0].dtype if present else np.dtype("float64")], components.pop(), pointers, strides

    def set_particles(self, name, positions, weights=None, lengths=None, density=False, periodic=False):
        """Makes a cell array of this rank's particles, which may lie in blocks of any rank: the particles' weight in each
        cell, with `density` divided by the cell's volume. `positions` is [particle][3], or three arrays x, y and z. `weights`
        (1 unless given) and smoothing lengths `lengths` (cloud in cell unless given) are an array each, or a number for all.
        `periodic`, a flag or one for each axis, wraps positions and weight around the extent of all ranks' blocks.
        vdi_catalyst.h has the rules.

        Arrays are kept alive and used in place: change them in place between steps, or set others when their number
        changes. Raises ValueError for shapes that don't fit and for types other than float32 and float64; ranks without such
        a fault raise CatalystError then."""
        with self._or_refused():
            key = _faults.name_bytes(name)
            made, kept = _particles(positions, weights, lengths, density, periodic, self._taken)
        self._check(self._library.vdi_catalyst_set_particles(self._handle, key, made))
        self._masked.pop((_CELLS, name), None)
        self._kept[_CELLS, name] = kept  # an array of cells, as far as the engine is concerned

    def wants(self, step, time=0.0):
        """True if this step makes anything, the same on all ranks; if not, there is no need to call execute."""
        with self._or_refused(self._library.vdi_catalyst_wants, -1, 0.0):
            step, time = _faults.whole_number("the step", step, "int(step)"), float(time)
        wanted = self._library.vdi_catalyst_wants(self._handle, step, time) != 0
        if not wanted:
            self._raise_if_busy()
        return wanted

    def execute(self, step, time=0.0):
        """Makes what the scripts or the JSON ask for, from the current values. `step` is the same on all ranks and at least 0,
        with scripts below 2**31, and `time` is finite."""
        with self._or_refused(self._library.vdi_catalyst_execute, -1, 0.0):
            step, time = _faults.whole_number("the step", step, "int(step)"), float(time)
            for copies in self._masked.values():
                for copy in copies:
                    copy.fill()
        self._check(self._library.vdi_catalyst_execute(self._handle, step, time))

    def parameter(self, name, value, low, high):
        """A number from `low` to `high` that viewers may change, if a script or the JSON lets them. Returns the value in force,
        the same on all ranks: the `value` of the first rank's first call, until a viewer sets another. Other ranks may pass any
        value, and later calls any bounds, too. The parameter takes only whole numbers if all three are of type int. Call it at
        each step, on all ranks; values change only in execute. Raises ValueError on all ranks unless the first value lies
        between finite bounds, and for an invalid name, another type than before, or a 65th parameter."""
        with self._or_refused():
            key = _faults.name_bytes(name)
            whole = all(isinstance(number, int) for number in (value, low, high))
            if not whole:
                value, low, high = float(value), float(low), float(high)
        ask = self._library.vdi_catalyst_parameter_i64 if whole else self._library.vdi_catalyst_parameter_f64
        in_force = ask(self._handle, key, value, low, high)
        self._raise_if_busy()
        error = self._error()  # empty after a success
        if error:
            self._raise(ValueError(error))
        return in_force

    def close(self):
        """Ends the run, before MPI is finalized. A second call does nothing. ParaView stays for another run with scripts."""
        code = self._run.end()
        if code != BUSY:
            self._kept = {}
            self._masked = {}
        self._check(code)

    def __enter__(self):
        return self

    def __exit__(self, kind, error, trace):
        # Only all ranks together can end a run. If this one fails alone, the others wait in a step, not here.
        if error is None or self._is_alone or error is self._shared_error:
            self.close()

    @contextlib.contextmanager
    def _or_refused(self, call=None, *arguments):
        """If the block raises, takes part in the call that the other ranks make, and fails it on all of them: by the text of
        the exception or, if a call is given, by arguments that fail."""
        try:
            yield
        except Exception as error:
            if call:
                call(self._handle, *arguments)
            else:
                self._library.vdi_catalyst_refuse(self._handle, (str(error) or repr(error)).encode())
            self._shared_error = error
            raise

    def _error(self):
        """The text of the last error; "" if there was none."""
        return self._library.vdi_catalyst_error(self._handle).decode(errors="replace")

    def _raise(self, error):
        self._shared_error = error
        raise error

    def _raise_if_busy(self):
        text = self._error()
        if "VDI_CATALYST_BUSY" in text:
            raise CatalystError(BUSY, text)

    def _check(self, code):
        if code == BUSY:
            raise CatalystError(code, self._error())
        if code != 0:
            self._raise(CatalystError(code, self._error() or "this run has ended, by close() or by a later one"))
