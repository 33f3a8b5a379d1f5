"""A simulation in Python whose arrays lie in CUDA's memory, described as CuPy, PyTorch and Numba do: it makes the files of the
same arrays on the host. VDI_TEST_CUDA names the library."""

import ctypes
import os
import shutil

import numpy as np

from pv_vdi.catalyst import Block, Catalyst, CatalystError

N = 16
FOLDER = os.environ["VDI_OUTPUT"]
shutil.rmtree(FOLDER, ignore_errors=True)
os.makedirs(FOLDER)
os.chdir(FOLDER)
cuda = None


def call(name, *arguments):
    result = getattr(cuda, name)(*arguments)
    assert result == 0, "%s returned %d" % (name, result)


class Memory:
    """An array in CUDA's memory, written on a stream, with the layout of NumPy's array `like`, which it owns."""

    def __init__(self, like, stream):
        self.like, self.stream = like, stream
        self.base = like if like.base is None else like.base
        self.offset = like.ctypes.data - self.base.ctypes.data
        address = ctypes.c_uint64()
        call("cuMemAlloc_v2", ctypes.byref(address), ctypes.c_size_t(self.base.nbytes))
        self.address = address.value

    def write(self):
        """Queues the values of NumPy's array, and spoils these."""
        call("cuMemcpyHtoDAsync_v2", ctypes.c_uint64(self.address), ctypes.c_void_p(self.base.ctypes.data),
             ctypes.c_size_t(self.base.nbytes), ctypes.c_void_p(self.stream))
        self.base.view("uint8").fill(255)


class Interface(Memory):
    """As CuPy and Numba describe it."""

    @property
    def __cuda_array_interface__(self):
        return {"shape": self.like.shape, "typestr": self.like.dtype.str, "data": (self.address + self.offset, False),
                "version": 3, "strides": self.like.strides, "stream": self.stream or 1}


class Tensor(Memory):
    """As PyTorch and JAX describe it."""

    kind = 2

    def __dlpack_device__(self):
        return self.kind, 0

    def __dlpack__(self, stream):
        assert stream == (self.stream or 1), stream
        size = self.like.itemsize
        numbers = [*self.like.shape, *(stride // size for stride in self.like.strides)]
        self.numbers = (ctypes.c_int64 * len(numbers))(*numbers)
        self.words = (ctypes.c_uint64 * 6)(
            self.address, self.kind, self.like.ndim | ({"f": 2, "c": 5}[self.like.dtype.kind] | 8 * size << 8 | 1 << 16) << 32,
            ctypes.addressof(self.numbers), ctypes.addressof(self.numbers) + 8 * self.like.ndim, self.offset)
        new = ctypes.pythonapi.PyCapsule_New
        new.restype, new.argtypes = ctypes.py_object, [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_void_p]
        self.name = b"dltensor"
        return new(ctypes.addressof(self.words), self.name, None)


def files():
    found = {}
    for name in os.listdir("."):
        with open(name, "rb") as file:
            found[name] = file.read()
        os.remove(name)
    return found


def simulate(made, stream=None):
    """The files of two steps. `made` turns NumPy's arrays into those that are handed over."""
    whole = np.zeros((N, N + 2, N + 40))
    arrays = [whole[:, 1:-1, 5:N + 5], np.zeros((N, N, N)), np.zeros((N, N, N), complex)]
    places = np.zeros((40, 3))
    given = [made(array) for array in arrays]
    given_places = made(places)
    for field in ("V", "psi", "rho"):
        run = {"field": field, "resolution": [48, 32], "output": field + "_{timestep}.vdi"}
        with Catalyst(None, json=run) as catalyst:
            catalyst.set_blocks([Block((N, N, N), (b, 0, 0), (1 / N,) * 3) for b in range(2)])
            if stream is not None:
                catalyst.set_stream(stream)
            catalyst.set_array("V", given[:2])
            catalyst.set_array("psi", [given[2], None])
            catalyst.set_particles("rho", given_places, weights=2.0)
            for step in range(2):
                z, y, x = np.meshgrid(*[np.linspace(0, 1, N)] * 3, indexing="ij")
                for b in range(2):
                    arrays[b][...] = 1 + np.sin(5 * x + step + b) * np.cos(4 * y) * z
                arrays[2][...] = np.exp(1j * (5 * x + step)) * y
                places[...] = 0.5 + 0.4 * np.sin(np.arange(120).reshape(40, 3) * 0.7 + step)
                for one in [*given, given_places]:
                    if isinstance(one, Memory):
                        one.write()
                catalyst.execute(step)
    return files()


def expect(error, words, action):
    try:
        action()
    except error as raised:
        assert words in str(raised), raised
        return
    raise AssertionError("nothing is raised: " + words)


host = simulate(lambda array: array)
assert len(host) == 6 and len(set(host.values())) == 6 and min(map(len, host.values())) > 1000, sorted(host)
with Catalyst(None, json={"field": "V"}) as catalyst:
    expect(CatalystError, "hasn't loaded CUDA", lambda: catalyst.set_stream(1))
    expect(ValueError, "such as torch.cuda.current_stream()", lambda: catalyst.set_stream("mine"))

cuda = ctypes.CDLL(os.environ["VDI_TEST_CUDA"])
context = ctypes.c_void_p()
call("cuInit", 0)
call("cuDevicePrimaryCtxRetain", ctypes.byref(context), 0)
call("cuCtxSetCurrent", context)
streams = [ctypes.c_void_p() for _ in range(2)]
for own in streams:
    call("cuStreamCreate", ctypes.byref(own), 1)  # the default stream doesn't wait for it
first, second = (own.value for own in streams)
assert simulate(lambda array: Interface(array, first)) == host, "files differ: the array's stream"
assert simulate(lambda array: Tensor(array, first), stream=first) == host, "files differ: DLPack"
assert simulate(lambda array: Interface(array, 0), stream=None) == host, "files differ: the default stream"

with Catalyst(None, json={"field": "V"}) as catalyst:
    catalyst.set_blocks([Block((N, N, N))])
    catalyst.set_array("V", [Interface(np.zeros((N, N, N)), first)])
    expect(ValueError, "write set_stream(stream)", lambda: catalyst.set_array("V", [Interface(np.zeros((N, N, N)), second)]))
    expect(ValueError, "[z][y][x]", lambda: catalyst.set_array("V", [Interface(np.zeros((N, N)), first)]))
    catalyst.set_stream(second)
    Tensor.kind = 10
    expect(ValueError, "a device of kind 10", lambda: catalyst.set_array("V", [Tensor(np.zeros((N, N, N)), second)]))
    expect(ValueError, "in an array of type Interface",
           lambda: catalyst.set_particles("rho", np.zeros((5, 3)), weights=Interface(np.zeros(()), second)))
    beyond = Interface(np.zeros((N, N, N)), second)
    beyond.address += 8
    expect(CatalystError, "reaches 8 bytes beyond", lambda: catalyst.set_array("V", [beyond]))
    catalyst.set_array("V", [Interface(np.zeros((N, N, N)), second)])
    catalyst.execute(0)
