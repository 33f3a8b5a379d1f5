"""Runs a simulation through Catalyst 2's implementation vdi, and through the adaptor itself: the same files, bit for bit.

    catalyst2.py same LAYOUT CUDA LAUNCHER... PROGRAM
    catalyst2.py script LAUNCHER... PROGRAM
    catalyst2.py bad LAUNCHER... PROGRAM
    catalyst2.py lost DIE_AT LAUNCHER... PROGRAM

CUDA is a library of CUDA (cuda.h), or "": the values lie there as well.

In a folder of its own below the present one. CATALYST_IMPLEMENTATION_PATHS is in the environment.
"""

import json
import os
import shutil
import subprocess
import sys

RUN = {"field": "V", "every": 2, "resolution": [64, 48], "colors": {"range": [0.1, 1.0]},
       "orbit": {"azimuth": 30, "elevation": 20}}
SAYS = ["has neither scripts nor vdi/json",
        "catalyst has scripts and a run without a script; choose one",
        "catalyst/pipelines are ParaView's own",
        "catalyst/mpi_comm is no communicator's Fortran handle",
        "catalyst_initialize was called before",
        "step 0: rank 2: catalyst/channels/grid/data/coordsets/coords/type is 'rectilinear'; this implementation takes only",
        "step 1: rank 0: catalyst/channels/grid/data/topologies/topo/type is 'unstructured'; ",
        "dims/k is 1: a block needs 2 points per axis",
        "dims/k isn't a whole number",
        "coords isn't one: spacing must be finite and > 0",
        "fields/V has 7 values, and not ",
        "fields/V points outside its ",
        "fields/V has no association 'vertex' or 'element'",
        "step 8: rank 2: catalyst/channels/grid/data/fields/ascent_ghosts marks cells that aren't whole layers",
        "catalyst/channels/grid/type is 'particles'; ",
        "catalyst/state/time isn't a number",
        "the ranks give different steps",
        "steps count from 0",
        "catalyst/channels has no channel"]


def run(folder, *command, **environment):
    """The output of a command that runs in a new folder."""
    shutil.rmtree(folder, ignore_errors=True)
    os.makedirs(folder)
    done = subprocess.run(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=100,
                          env={**os.environ, "CATALYST_IMPLEMENTATION_NAME": "vdi", **environment})
    print(done.stdout)
    assert done.returncode == 0, "%s: status %d" % (command[-3:], done.returncode)
    return done.stdout


def files(folder):
    found = {name: open(os.path.join(folder, name), "rb").read() for name in os.listdir(folder) if name.endswith(".vdi")}
    assert all(len(content) > 5000 for content in found.values()), {name: len(found[name]) for name in found}
    return found


def same(layout, cuda, *program):
    folder = "catalyst2_%s_%s" % (layout, program[-2])
    run(folder + "/native", *program, "native", layout, json.dumps(RUN))
    run(folder + "/catalyst", *program, "catalyst", layout, json.dumps(RUN))
    made = files(folder + "/catalyst")
    assert sorted(made) == ["vdi_000000.vdi", "vdi_000002.vdi"], sorted(made)
    assert made["vdi_000000.vdi"] != made["vdi_000002.vdi"], "nothing has changed from step to step"
    assert made == files(folder + "/native"), "the files differ"
    if cuda:
        run(folder + "/cuda", *program, "catalyst", layout, json.dumps(RUN), VDI_TEST_CUDA=cuda)
        assert made == files(folder + "/cuda"), "the files differ from those of values in CUDA's memory"


def script(*program):
    here = os.path.dirname(os.path.abspath(__file__))
    says = run("catalyst2_script", *program, "catalyst", "mesh", os.path.join(here, "catalyst2_script.py"), "--name", "made")
    for name in ("mine", "species"):
        assert says.count("the field '%s' is left out" % name) == 1
    assert sorted(files("catalyst2_script")) == ["made_0.vdi", "made_1.vdi", "made_2.vdi"]


def bad(*program):
    says = run("catalyst2_bad", *program, "bad", json.dumps(dict(RUN, every=1)))
    for text in SAYS:
        assert text in says, "it doesn't say: " + text
    assert len(files("catalyst2_bad")) == 1


def lost(die_at, *program):
    """If the processes that make frames die, all later steps fail, and one line says so."""
    says = run("catalyst2_lost", *program, "lost", json.dumps(dict(RUN, every=1, isolation="process")),
               LD_PRELOAD=die_at + ":libvulkan.so.1", VDI_TEST_DIE="taking:0:kill")
    lines = [line for line in says.splitlines() if line.startswith("vdi_catalyst: ")]
    assert len(lines) == 1 and "was killed by signal 9" in lines[0] and "no more frames" in lines[0], lines


{"same": same, "script": script, "bad": bad, "lost": lost}[sys.argv[1]](*sys.argv[2:])
