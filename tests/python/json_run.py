"""A simulation in Python without a script: files, a picture, and a stream that vdi receive takes. Argument: vdi."""

import os
import shutil
import subprocess
import sys
import threading
import weakref

import numpy as np
from mpi4py import MPI

import pv_vdi
from pv_vdi.catalyst import BAD_ARGUMENT, BUSY, SCRIPT, Block, Catalyst, CatalystError

N = 16
FOLDER = os.environ["VDI_OUTPUT"]
shutil.rmtree(FOLDER, ignore_errors=True)
os.makedirs(FOLDER)
os.chdir(FOLDER)


def refused(code, words, **what):
    try:
        Catalyst(MPI.COMM_WORLD, **what)
    except CatalystError as error:
        assert error.code == code and words in str(error), (error.code, error)
        return
    raise AssertionError("it's taken: %s" % what)


def check_faults(catalyst):
    """What doesn't fit is refused by a text that says what to write."""
    good = np.zeros((N, N, N))
    particles = np.zeros((5, 3))
    x, y, z = particles.T

    def array(values, **options):
        return lambda: catalyst.set_array("V", values, **options)

    def block(**fields):
        return lambda: catalyst.set_blocks([Block(**{"cells": (N, N, N), **fields})])

    def deposit(*arguments):
        return lambda: catalyst.set_particles("density", *arguments)

    for call, words in [
            (array([good.tolist()]), "numpy.asarray(values)"),
            (array(good), "a list with one array for each block, [values]"),
            (array(5), "a list with one array for each block, [values]"),
            (array([good, good]), "2 arrays of 'V' for 1 blocks"),
            (array([good.astype(">f4")]), "values.astype('float32')"),
            (array([good.astype(">i2")]), "values.astype('int16')"),
            (array([good.astype(">c16")]), "values.astype('complex128')"),
            (array([good.astype("float16")]), "values.astype('float32')"),
            (array([good.astype("longdouble")]), "values.astype('float64')"),
            (array([good.astype(object)]), "values.astype('float64')"),
            (array([good > 0]), "values.view('uint8')"),
            (array([good.astype("datetime64[s]")]), "must be one of uint8, "),
            (array([np.zeros((N + 1,) * 3)]), "write points=True"),
            (array([good], points=True), "write points=False"),
            (array([good.ravel()]), "values.reshape(16, 16, 16)"),
            (array([np.zeros((3, N, N, N))]), "numpy.moveaxis(values, 0, -1)"),
            (array([np.zeros((N, N, N, 2), complex)]), "values[..., 0]"),
            (array([good], offset=0.5), "(-0.5, 0, 0)"),
            (lambda: catalyst.set_array(b"V", [good]), "write a text"),
            (block(cells=(16.0, N, N)), "(64, 64, 64); int() makes whole numbers"),
            (block(cells=N), "write x, y and z"),
            (block(ghost_lo=(0.5, 0, 0)), "ghost_lo of block 0"),
            (block(spacing="wide"), "(0.1, 0.1, 0.1)"),
            (lambda: catalyst.set_blocks([(N, N, N)]), "write Block("),
            (lambda: catalyst.execute(0.5), "int(step)"),
            (deposit(np.zeros((5, 2))), "[particle][3]"),
            (deposit(np.zeros((3, 5))), "positions.T"),
            (deposit(np.zeros(15)), "[particle][3]"),
            (deposit(np.zeros((5, 3), np.int32)), "positions.astype('float64')"),
            (deposit(particles.astype(">f8")), "positions.astype('float64')"),
            (deposit((x, y)), "three of x, y and z"),
            (deposit((x, y, z[:4])), "type, length or stride"),
            (deposit((x, y, np.zeros(5))), "type, length or stride"),
            (deposit(particles, np.zeros(4)), "for 5 particles"),
            (deposit(particles, np.zeros(5, np.int64)), "weights.astype('float64')"),
            (deposit(particles, None, np.zeros((5, 1))), "for 5 particles"),
            (lambda: Catalyst(MPI.COMM_WORLD), "either scripts="),
            (lambda: Catalyst(MPI.COMM_WORLD, "minimal.py"), "['minimal.py']"),
            (lambda: Catalyst(5, json={"field": "V"}), "MPI.COMM_WORLD")]:
        try:
            call()
        except ValueError as error:
            assert words in str(error), (words, error)
            continue
        raise AssertionError("it's taken: %s" % words)
    catalyst.set_array("V", [np.asfortranarray(good)])  # in place, with NumPy's own numbers
    catalyst.set_blocks([Block(cells=np.array([N, N, N]), spacing=np.float32([1, 1, 1]))])


def check_lost():
    """A run that is lost or goes on ends when the next one begins, which works; a failed cell of a notebook keeps the run's
    variable in its traceback."""
    run = {"field": "V", "resolution": [40, 30], "output": "lost_{timestep}.vdi", "existing": "overwrite"}

    def cell(step, fails):
        catalyst = Catalyst(MPI.COMM_WORLD, json=run)
        catalyst.set_blocks([Block(cells=(N, N, N))])
        catalyst.set_array("V", [np.random.default_rng(1).random((N, N, N))])
        catalyst.execute(np.int64(step))
        assert not fails, "the cell fails"
        return catalyst

    before = cell(0, False)
    kept = None
    try:
        cell(1, True)
    except AssertionError as error:
        kept = error
    assert kept is not None and "the cell fails" in str(kept)
    try:
        before.execute(5)
    except CatalystError as error:
        assert error.code == BAD_ARGUMENT and "has ended" in str(error), error
    else:
        raise AssertionError("a run that has ended goes on")
    before.close()  # ends nothing
    try:
        with cell(2, False) as catalyst:
            catalyst.set_array("W", [])
    except ValueError:
        pass
    cell(3, False)  # lost at once
    cell(4, False).close()
    assert all(os.path.exists("lost_%d.vdi" % step) for step in range(5))


def check_threads():
    """While one thread is in a call, the calls of another one are refused, and lose nothing."""
    run = {"field": "V", "resolution": [160, 120], "output": "threads_{timestep}.vdi"}
    with Catalyst(MPI.COMM_WORLD, json=run) as catalyst:
        catalyst.set_blocks([Block(cells=(N, N, N))])
        values = np.random.default_rng(1).random((N, N, N))
        catalyst.set_array("V", [values])
        refusals = {"set_array": 0, "execute": 0, "wants": 0}
        is_over = threading.Event()
        others = []

        def intrude():
            while not is_over.is_set():
                for name, call in [("set_array", lambda: catalyst.set_array("V", [values])),
                                   ("wants", lambda: catalyst.wants(0)), ("execute", lambda: catalyst.execute(-1))]:
                    try:
                        call()
                    except CatalystError as error:
                        if error.code == BUSY:
                            refusals[name] += 1
                        elif not (name == "execute" and error.code == BAD_ARGUMENT):
                            others.append(error)

        thread = threading.Thread(target=intrude)
        thread.start()
        made = 0
        while made < 3:
            try:
                catalyst.execute(made)
                made += 1
            except CatalystError as error:
                assert error.code == BUSY, error
        is_over.set()
        thread.join()
        assert not others and all(refusals.values()), (others, refusals)
    assert all(os.path.exists("threads_%d.vdi" % step) for step in range(3))


def shown(positions, weights, lengths, density):
    """The VDI of a deposit of these particles."""
    file = "particles_{timestep}.vdi"
    with Catalyst(MPI.COMM_WORLD, json={"field": "particles", "resolution": [48, 32], "output": file,
                                        "existing": "overwrite"}) as catalyst:
        catalyst.set_blocks([Block(cells=(N, N, N), spacing=(1 / N,) * 3)])
        catalyst.set_particles("particles", positions, weights, lengths, density)
        catalyst.execute(0)
    return pv_vdi.read("particles_0.vdi")


def end_in_a_child(catalyst):
    """A forked child doesn't affect the run, whatever it calls."""
    child = os.fork()
    if child == 0:
        code = 1
        try:
            refused(BAD_ARGUMENT, "forked", json={"field": "V"})
            try:
                catalyst.execute(20, 2.0)
            except CatalystError as error:
                catalyst.close()
                code = 0 if error.code == BAD_ARGUMENT else 2
        finally:
            os._exit(code)
    assert os.waitpid(child, 0)[1] == 0
    assert os.path.exists("link"), "the child has ended the stream"


def check_kept():
    """Arrays live until others of the same name and the same kind, cells or points, take their place."""
    with Catalyst(MPI.COMM_WORLD, json={"field": "V"}) as catalyst:
        catalyst.set_blocks([Block(cells=(N, N, N), spacing=(1 / N,) * 3)])

        def set_new(points):
            array = np.zeros((N + points,) * 3)
            catalyst.set_array("V", [array], points)
            return weakref.ref(array)

        cells, points = set_new(False), set_new(True)
        assert cells() is not None and points() is not None
        others = set_new(True)
        assert cells() is not None and points() is None and others() is not None
        catalyst.set_particles("V", np.full((5, 3), 0.5))  # they become cells
        assert cells() is None and others() is not None


def check_levels():
    """Opacities hold over the same distance where a level of refinement comes and goes."""
    with Catalyst(MPI.COMM_WORLD, json={"field": "V", "resolution": [48, 32], "output": "levels_{timestep}.vdi"}) as catalyst:
        for step in range(3):
            blocks = [Block(cells=(N, N, N), spacing=(1 / N,) * 3)]
            if step == 1:
                blocks.append(Block(cells=(N, N, N), origin=(0.25,) * 3, spacing=(0.5 / N,) * 3))
            catalyst.set_blocks(blocks)
            catalyst.set_array("V", [np.linspace(0, 1, N ** 3).reshape(N, N, N) for _ in blocks])
            catalyst.execute(step)
    distances = {pv_vdi.read("levels_%d.vdi" % step).metadata["transferFunction"]["unitDistance"] for step in range(3)}
    assert len(distances) == 1, distances


def check_missing():
    """Masked arrays, `missing` of an array and of a run: the VDI and the range of NaN, whatever the type."""
    whole = np.round(40 * np.sin(5 * x)[:, None, None] * np.cos(4 * x)[None, :, None] * np.ones(N) + 50)
    hole = np.zeros(whole.shape, bool)
    hole[4:9, 2:13, 5:11] = True

    def shown(values, missing=None, run_missing=(), change=lambda: None):
        run = {"field": "V", "resolution": [48, 32], "output": "missing_{timestep}.vdi", "existing": "overwrite",
               "missing": list(run_missing), "when": {"max": "V", "below": 100}}
        with Catalyst(MPI.COMM_WORLD, json=run) as catalyst:
            catalyst.set_blocks([Block(cells=(N, N, N), spacing=(1 / N,) * 3)])
            catalyst.set_array("V", [values], missing=missing)
            change()
            assert not os.path.exists("missing_7.vdi")
            catalyst.execute(7)
        made = pv_vdi.read("missing_7.vdi")
        os.remove("missing_7.vdi")
        assert made.metadata["range"] == [whole[~hole].min(), whole[~hole].max()], made.metadata["range"]
        return made

    expected = shown(np.where(hole, np.nan, whole)).segments
    for kind, fill in (("uint8", 255), ("float32", 1e20), ("int64", 2 ** 40)):
        filled = np.where(hole, fill, whole).astype(kind)
        named = shown(filled, run_missing=[-1.5, fill]).segments
        assert len(named) == len(expected), kind
        assert (shown(np.ma.masked_equal(filled, fill)).segments == named).all(), kind
    assert (shown(np.where(hole, 1e20, whole), missing=1e20).segments == expected).all()
    # Masks and values that change after set_array count as they are at execute.
    masked = np.ma.masked_array(np.zeros_like(whole), np.zeros_like(hole))

    def change():
        masked.data[...] = np.where(hole, 1e20, whole)
        masked.mask[...] = hole

    assert (shown(masked, change=change).segments == expected).all()


def periodic(places):
    with Catalyst(MPI.COMM_WORLD, json={"field": "p", "resolution": [48, 32], "output": "periodic_{timestep}.vdi",
                                        "existing": "overwrite"}) as catalyst:
        catalyst.set_blocks([Block(cells=(N, N, N), spacing=(1 / N,) * 3)])
        catalyst.set_particles("p", places, periodic=(True, False, True))
        catalyst.execute(0)
    return pv_vdi.read("periodic_0.vdi").segments


def check_faces():
    """Arrays of all faces across an axis: what cells' lower faces show, and, but for the last half cell, points' means."""
    def made(shape, offset):
        with Catalyst(MPI.COMM_WORLD, json={"field": "V", "resolution": [48, 32], "output": "faces_{timestep}.vdi",
                                            "existing": "overwrite", "colors": {"range": [0, 3]}}) as catalyst:
            catalyst.set_blocks([Block(cells=(N, N, N), spacing=(1 / N,) * 3)])
            z, y, x = np.meshgrid(*map(np.arange, shape), indexing="ij")
            catalyst.set_array("V", [(z + 2 * y + 3 * x) / (2 * N)], offset=offset)
            catalyst.execute(0)
        return pv_vdi.read("faces_0.vdi").segments

    for axis in (0, 2):
        shape, offset = [N, N, N], [0, 0, 0]
        shape[2 - axis], offset[axis] = N + 1, -0.5
        assert (made(shape, None) == made([N, N, N], offset)).all(), axis


def check_together():
    """Two components together are colour and opacity, each by its own range; four are red, green, blue and opacity."""
    field = 0.5 + 0.5 * np.sin(5 * x)[:, None, None] * np.cos(4 * x)[None, :, None] * np.ones(N)

    def made(values, component="together"):
        with Catalyst(MPI.COMM_WORLD, json={"field": "V", "component": component, "resolution": [48, 32],
                                            "output": "together_{timestep}.vdi", "existing": "overwrite"}) as catalyst:
            catalyst.set_blocks([Block(cells=(N, N, N), spacing=(1 / N,) * 3)])
            catalyst.set_array("V", [values])
            catalyst.execute(0)
        return pv_vdi.read("together_0.vdi")

    alone = made(field, 0).render()[0]
    assert alone.max() > 0.5
    pair = made(np.stack([300 + 50 * field, field], axis=-1))
    assert np.allclose(pair.metadata["range"], [300 + 50 * field.min(), 300 + 50 * field.max()]), pair.metadata
    assert np.abs(pair.render()[0] - alone).max() < 0.03
    red, dark, half = (np.full(field.shape, value) for value in (255, 0, 127.5))
    four = made((257 * np.stack([red, dark, half, 255 * field], axis=-1)).astype(np.uint16)).render()[0]
    assert np.abs(four - four[..., 3:] * [1, 0, 0.5, 1]).max() < 0.01
    assert np.abs(four[..., 3] - alone[..., 3]).max() < 0.01
    try:
        made(np.stack([field] * 3, axis=-1))
    except CatalystError as error:
        assert "they must be two, colour and opacity, or four" in str(error), error
        return
    raise AssertionError("three components are taken together")


refused(SCRIPT, "no such field", json={"field": "V", "evry": 10})
refused(SCRIPT, "none.json", json="none.json")
run = {"field": "V", "every": 10, "resolution": [48, 32], "stream": {"link_file": "link"},
       "output": {"vdi": "v_{timestep:03d}.vdi", "png": "v_{timestep:03d}.png"}}
x = (np.arange(N) + 0.5) / N
with Catalyst(MPI.COMM_WORLD, json=run) as catalyst:
    catalyst.set_blocks([Block(cells=(N, N, N), spacing=(1 / N,) * 3)])
    values = np.zeros((N, N, N))
    catalyst.set_array("V", [values])
    catalyst.set_array("cell", [np.arange(N ** 3).reshape(N, N, N)])  # of int64
    catalyst.set_array("unsigned", [np.zeros((N, N, N), np.uint64)])
    for step in range(21):
        values[...] = np.sin(5 * x)[:, None, None] * np.cos(4 * x)[None, :, None] * (x + 0.01 * step)
        assert catalyst.wants(step) == (step % 10 == 0), step
        catalyst.execute(step, 0.1 * step)
    check_faults(catalyst)
    end_in_a_child(catalyst)
    link = open("link").read().strip()
    assert os.stat("link").st_mode & 0o777 == 0o600
    # The viewer isn't one of the ranks.
    alone = {name: value for name, value in os.environ.items() if not name.startswith(("OMPI_", "PMIX_"))}
    subprocess.run([sys.argv[1], "receive", link, "-o", "received", "--frames", "1"], env=alone, check=True, timeout=60)
assert not os.path.exists("link")
made = sorted(name for name in os.listdir(".") if name.startswith("v_"))
assert made == ["v_%03d.%s" % (step, kind) for step in (0, 10, 20) for kind in ("png", "vdi")], made
vdi = pv_vdi.read("v_020.vdi")
assert (vdi.width, vdi.height, vdi.time_step) == (48, 32, 20)
assert abs(vdi.time - 2.0) < 1e-12
assert vdi.metadata["array"]["name"] == "V", vdi.metadata
assert len(vdi.segments) > 1000
received = [os.path.join("received", name) for name in os.listdir("received")]
assert open(received[0], "rb").read() == open("v_020.vdi", "rb").read(), "what's received isn't what's written"
# Another run may follow in the same process.
with Catalyst(MPI.COMM_WORLD, json={"field": "V"}) as catalyst:
    catalyst.set_blocks([])
    assert catalyst.wants(1)
check_kept()
check_levels()
check_lost()
check_threads()
check_missing()
check_faces()
check_together()

# Particles: one array or three, of any stride, weights and lengths for each or for all.
places = np.random.default_rng(3).uniform(0.2, 0.8, (2000, 3))
expected = shown(places, np.full(2000, 0.5), np.full(2000, 0.1), True)
assert len(expected.segments) > 500
wide = np.zeros((2000, 8), np.float64)
wide[:, 1:4] = places
for other in (shown(wide[:, 1:4], 0.5, 0.1, True), shown(tuple(np.asfortranarray(places).T), 0.5, np.full(2000, 0.1), True)):
    assert (other.segments == expected.segments).all()
# Along periodic axes, particles of another period are those of this one.
exact = np.round(places * 2 ** 20) / 2 ** 20
assert (periodic(exact) == periodic(exact + [1, 0, -2])).all()
summed = shown(places, 0.5 * N ** 3, 0.1, False).metadata["array"]
assert summed["name"] == "particles" and summed == expected.metadata["array"], (summed, expected.metadata["array"])
