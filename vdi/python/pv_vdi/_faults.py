"""Faults of what a simulation hands over, as texts that say what to write instead. Each function raises ValueError, or returns
the value in the form that the engine takes."""

import operator

import numpy as np


def whole_number(what, given, example):
    """The number as an int; NumPy's are taken, floats aren't."""
    try:
        return operator.index(given)
    except TypeError:
        raise ValueError("%s is %r, not a whole number; write %s" % (what, given, example)) from None


def triple(what, given, convert, example):
    """Three numbers, x, y and z."""
    try:
        numbers = tuple(convert(number) for number in given)
    except (TypeError, ValueError):
        numbers = ()
    if len(numbers) != 3:
        raise ValueError("%s is %r; write x, y and z, such as %s" % (what, given, example))
    return numbers


def whole_triple(what, given, example):
    return triple(what, given, operator.index, "%s; int() makes whole numbers" % example)


def name_bytes(name):
    if not isinstance(name, str):
        raise ValueError("the name is %r; write a text" % (name,))
    return name.encode()


def one_per_block(name, given, blocks):
    """The list of one array for each block."""
    if getattr(given, "ndim", 0) in (3, 4) and len(given) != blocks:
        raise ValueError("the arrays of '%s' are one array of shape %s; write a list with one array for each block, [values]" %
                         (name, tuple(given.shape)))
    try:
        arrays = list(given)
    except TypeError:
        raise ValueError("the arrays of '%s' are of type %s; write a list with one array for each block, [values]" %
                         (name, type(given).__name__)) from None
    if len(arrays) != blocks:
        raise ValueError("%d arrays of '%s' for %d blocks; write one for each block, and None for a block that lacks it%s" %
                         (len(arrays), name, blocks, "" if blocks else "; set_blocks comes first"))
    return arrays


def require_array(what, given):
    if not isinstance(given, np.ndarray):
        raise ValueError("%s is of type %s.%s, not a NumPy array; write numpy.asarray(values), once, and change that array in "
                         "place between steps" % (what, type(given).__module__, type(given).__name__))


def other_type(dtype):
    """How to get values of this type into one that the engine takes; "" if no way is known."""
    if not dtype.isnative:
        name = "complex" if dtype.kind == "c" else {"f": "float", "i": "int", "u": "uint"}.get(dtype.kind)
        return "" if name is None else "; write values.astype('%s%d')" % (name, 8 * dtype.itemsize)
    if dtype.kind == "b":
        return "; write values.view('uint8')"
    if dtype.kind in "fc":
        wanted = "complex128" if dtype.kind == "c" else "float32" if dtype.itemsize < 4 else "float64"
        return "; write values.astype('%s')" % wanted
    if dtype.kind == "O":
        return "; write values.astype('float64')"
    return ""


def require_one_component(name, array):
    """Complex numbers are vectors of two already."""
    if array.dtype.kind == "c" and array.ndim > 3:
        raise ValueError("an array of '%s' has complex vectors, %s; write an array for each component, values[..., 0]" % (
            name, array.shape))


def require_types(name, dtypes, known):
    """All values of one array have one type."""
    if len(dtypes) > 1:
        raise ValueError("the values of '%s' are %s; write one type for all blocks" % (
            name, " and ".join(sorted(map(str, dtypes)))))
    for dtype in dtypes:
        if dtype not in known:
            way = other_type(dtype)
            raise ValueError("the values of '%s' are %s, and must be one of %s%s%s" % (
                name, dtype, ", ".join(map(str, known)), way,
                "" if not way or "view" in way else ": that is a copy, so set it again when the values change"))


def require_shape(name, shape, cells, points):
    """A block has one value for each cell, or one more along each axis for points, [z][y][x] or [z][y][x][component]."""
    counts = tuple(reversed(cells))
    wanted = tuple(count + bool(points) for count in counts)
    if shape[:3] == wanted and len(shape) in (3, 4):
        return
    other = tuple(count + (not points) for count in counts)
    way = ""
    if shape[:3] == other:
        way = "; that is the shape of %s: write points=%s" % (("cells", False) if points else ("points", True))
    elif shape == wanted[::-1]:
        way = "; [x][y][z] becomes [z][y][x] by values.transpose()"
    elif len(shape) == 4 and shape[1:] == wanted:
        way = "; components come last: write numpy.moveaxis(values, 0, -1)"
    elif len(shape) < 3 and np.prod(shape) == np.prod(wanted):
        way = "; write values.reshape(%d, %d, %d) if x varies fastest" % wanted
    raise ValueError("an array of '%s' is %s, its block has %s values [z][y][x]%s" % (name, shape, wanted, way))
