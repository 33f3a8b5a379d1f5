"""Arrays of other libraries (CuPy, PyTorch, JAX, Numba), also in a GPU's memory, as NumPy arrays on the same memory. Such an
array has a shape, strides and an address, and can be sliced, but its values must not be read here. No library is imported:
objects with __cuda_array_interface__ or __dlpack__ describe themselves."""

import ctypes
import operator

import numpy as np

_CPU, _CUDA, _CUDA_HOST, _CUDA_MANAGED = 1, 2, 3, 13  # DLDeviceType
_KINDS = {0: "i", 1: "u", 2: "f", 5: "c", 6: "b"}  # DLDataTypeCode


class _Tensor(ctypes.Structure):  # DLTensor, with which a DLManagedTensor begins
    _fields_ = [("data", ctypes.c_void_p), ("device_type", ctypes.c_int32), ("device", ctypes.c_int32),
                ("ndim", ctypes.c_int32), ("code", ctypes.c_uint8), ("bits", ctypes.c_uint8), ("lanes", ctypes.c_uint16),
                ("shape", ctypes.POINTER(ctypes.c_int64)), ("strides", ctypes.POINTER(ctypes.c_int64)),
                ("byte_offset", ctypes.c_uint64)]


class _Memory:
    """What NumPy asks for an array, and the owner of the memory, which the array keeps alive."""

    def __init__(self, owner, address, shape, strides, typestr):
        self.owner = owner
        self.__array_interface__ = {"version": 3, "shape": tuple(shape), "strides": strides, "typestr": typestr,
                                    "data": (address, True)}


def is_array(given):
    """Whether it is an array of NumPy, or one that `as_array` takes."""
    return isinstance(given, np.ndarray) or hasattr(given, "__cuda_array_interface__") or \
        (hasattr(given, "__dlpack__") and hasattr(given, "__dlpack_device__"))


def as_array(what, given, stream):
    """The array on the memory of `given`, and the stream on which its values are written, None if it doesn't say. `stream` is
    the run's, of which DLPack takes note. What isn't such an array comes back unchanged. Raises ValueError."""
    if isinstance(given, np.ndarray) or not is_array(given):
        return given, None
    interface = getattr(given, "__cuda_array_interface__", None)
    if interface is not None:
        if interface.get("mask") is not None:
            raise ValueError("%s has a mask on the GPU; write NaN or one of the numbers `missing` where it masks" % what)
        memory = _Memory(given, interface["data"][0] or 0, interface["shape"], interface.get("strides"), interface["typestr"])
        return np.asarray(memory), interface.get("stream")
    return np.asarray(_of_dlpack(what, given, stream)), None


def _of_dlpack(what, given, stream):
    kind, _ = given.__dlpack_device__()
    if kind not in (_CPU, _CUDA, _CUDA_HOST, _CUDA_MANAGED):
        raise ValueError("%s lies in memory of a device of kind %d (DLPack), from which values can't be taken; copy them "
                         "to the host first" % (what, kind))
    capsule = given.__dlpack__() if kind in (_CPU, _CUDA_HOST) else given.__dlpack__(stream=stream or 1)
    take = ctypes.pythonapi.PyCapsule_GetPointer
    take.restype, take.argtypes = ctypes.c_void_p, [ctypes.py_object, ctypes.c_char_p]
    tensor = _Tensor.from_address(take(capsule, b"dltensor"))
    if tensor.code not in _KINDS or tensor.lanes != 1 or tensor.bits % 8 != 0:
        raise ValueError("the values of %s are of a type that NumPy lacks (DLPack's %d with %d bits); write one of float32 or "
                         "float64" % (what, tensor.code, tensor.bits))
    size = tensor.bits // 8
    shape = tensor.shape[:tensor.ndim]
    strides = tuple(size * stride for stride in tensor.strides[:tensor.ndim]) if tensor.strides else None
    # The capsule frees the tensor when it goes.
    return _Memory((capsule, given), (tensor.data or 0) + tensor.byte_offset, shape, strides,
                   "|b1" if tensor.code == 6 else "%s%s%d" % ("|" if size == 1 else "<", _KINDS[tensor.code], size))


def stream_handle(given):
    """The handle of a stream: an int, or an object of CuPy, PyTorch or cuda.core; 0 for None. Raises ValueError."""
    if hasattr(given, "__cuda_stream__"):
        return int(given.__cuda_stream__()[1])
    for name in ("cuda_stream", "ptr"):
        given = getattr(given, name, given)
    try:
        return 0 if given is None else operator.index(given)
    except TypeError:
        raise ValueError("the stream is of type %s; write its handle, a whole number, such as torch.cuda.current_stream()"
                         ".cuda_stream" % type(given).__name__) from None
