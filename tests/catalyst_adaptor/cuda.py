"""Runs a simulation with its values on the host and in memory of CUDA: the same files, bit for bit.

    cuda.py memory LAUNCHER... PROGRAM
    cuda.py script SCRIPT LAUNCHER... PROGRAM
    cuda.py faults LAUNCHER... PROGRAM

In a folder of its own below the present one. VDI_TEST_CUDA, VDI_TEST_HIP and VDI_TEST_LEVEL_ZERO name libraries.
"""

import json
import os
import shutil
import subprocess
import sys

RUN = {"field": "V", "every": 2, "resolution": [64, 48], "when": {"max": "w", "above": 0.1}, "orbit": {"azimuth": 30}}
PARTICLES = dict(RUN, field="P", when={"mean": "P", "above": 0.001}, output="p_{timestep}.vdi")


def run(folder, *command, **environment):
    """The .vdi files of a command that runs in a new folder, and its output."""
    shutil.rmtree(folder, ignore_errors=True)
    os.makedirs(folder)
    done = subprocess.run(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=250,
                          env={**os.environ, "VDI_OUTPUT": os.path.abspath(folder), **environment})
    print(done.stdout)
    assert done.returncode == 0, "%s: status %d" % (folder, done.returncode)
    return {name: open(os.path.join(folder, name), "rb").read() for name in os.listdir(folder) if name.endswith(".vdi")}, \
        done.stdout


def memory(*program):
    runs = [json.dumps(RUN), json.dumps(PARTICLES)]
    host, _ = run("cuda_host", *program, "host", *runs)
    assert sorted(host) == ["p_0.vdi", "p_2.vdi", "vdi_000000.vdi", "vdi_000002.vdi"], sorted(host)
    assert len(set(host.values())) == 4 and min(map(len, host.values())) > 2000, "the files show nothing"
    for place in ("device", "mixed"):
        assert run("cuda_" + place, *program, place, *runs)[0] == host, "files differ: " + place
    assert run("cuda_isolated", *program, "device", *runs, VDI_ISOLATION="process")[0] == host, "files differ: isolated"


def script(file, *program):
    made, _ = run("cuda_script_host", *program, "host", file)
    assert len(made) == 2 and min(map(len, made.values())) > 2000, sorted(made)
    assert run("cuda_script", *program, "mixed", file)[0] == made, "files differ: script"


def faults(*program):
    _, says = run("cuda_faults", *program, "faults", json.dumps(dict(RUN, every=1, when={"max": "V", "above": 0.0})))
    assert "FAILED" not in says


{"memory": memory, "script": script, "faults": faults}[sys.argv[1]](*sys.argv[2:])
