"""A simulation in Python without a script: files, a picture, and a stream that vdi receive takes. Argument: vdi."""

import os
import shutil
import subprocess
import sys
import weakref

import numpy as np
from mpi4py import MPI

import pv_vdi
from pv_vdi.catalyst import BAD_ARGUMENT, ENGINE, SCRIPT, Block, Catalyst, CatalystError

N = 16
FOLDER = os.environ["VDI_OUTPUT"]
shutil.rmtree(FOLDER, ignore_errors=True)
os.makedirs(FOLDER)
os.chdir(FOLDER)


def refused(code, **what):
    try:
        Catalyst(MPI.COMM_WORLD, **what)
    except CatalystError as error:
        assert error.code == code, error.code
        return
    raise AssertionError("it's taken: %s" % what)


def refused_particles(catalyst):
    """Particles whose shapes or types don't fit."""
    good = np.zeros((5, 3))
    for arguments in [(np.zeros((5, 2)),), (np.zeros(15),), (np.zeros((5, 3), np.int32),), ((good[:, 0], good[:, 1]),),
                      ((good[:, 0], good[:, 1], good[:4, 2]),), ((good[:, 0], good[:, 1], np.zeros(5)),),
                      (good, np.zeros(4)), (good, np.zeros(5, np.int64)), (good, None, np.zeros((5, 1)))]:
        try:
            catalyst.set_particles("density", *arguments)
        except ValueError:
            continue
        raise AssertionError("they're taken: %s" % (arguments,))


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
            refused(BAD_ARGUMENT, json={"field": "V"})
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


refused(SCRIPT, json={"field": "V", "evry": 10})
refused(SCRIPT, json="none.json")
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
    refused(ENGINE, json=run)
    refused_particles(catalyst)
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

# Particles: one array or three, of any stride, weights and lengths for each or for all.
places = np.random.default_rng(3).uniform(0.2, 0.8, (2000, 3))
expected = shown(places, np.full(2000, 0.5), np.full(2000, 0.1), True)
assert len(expected.segments) > 500
wide = np.zeros((2000, 8), np.float64)
wide[:, 1:4] = places
for other in (shown(wide[:, 1:4], 0.5, 0.1, True), shown(tuple(np.asfortranarray(places).T), 0.5, np.full(2000, 0.1), True)):
    assert (other.segments == expected.segments).all()
summed = shown(places, 0.5 * N ** 3, 0.1, False).metadata["array"]
assert summed["name"] == "particles" and summed == expected.metadata["array"], (summed, expected.metadata["array"])
